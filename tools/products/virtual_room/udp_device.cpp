#include "tools/products/virtual_room/udp_device.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string>

#include <fmt/format.h>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/files/user_error.hpp"

namespace room {
namespace {

constexpr std::int64_t most_ahead = 1 << 16;  // largest plausible jump of the sequence number
// Largest number of packets read in one tick, so that a flood of packets does not stop the loop.
constexpr int most_packets = 32;

bool is_good(const HandPacket& packet) noexcept {
  const HandPacket expected;
  if (std::memcmp(packet.magic, expected.magic, sizeof expected.magic) != 0 ||
      packet.version != packet_version)
    return false;
  const auto is_finite = [](double number) { return std::isfinite(number); };
  return std::all_of(packet.position, packet.position + 3, is_finite) &&
         std::all_of(packet.force, packet.force + 3, is_finite);
}

}  // namespace

UdpDevice::UdpDevice(int port, double silence_s) : silence_s_(silence_s) {
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(static_cast<std::uint16_t>(port));
  own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const auto* bound = reinterpret_cast<const sockaddr*>(&own);
  if (socket_ < 0 || bind(socket_, bound, sizeof own) != 0) {
    const std::string why = std::strerror(errno);
    if (socket_ >= 0) close(socket_);
    throw cli::UserError(
        fmt::format("udp device: cannot listen on 127.0.0.1:{}: {}; try another --port", port, why));
  }
  socklen_t length = sizeof own;
  getsockname(socket_, reinterpret_cast<sockaddr*>(&own), &length);
  port_ = ntohs(own.sin_port);
}

UdpDevice::~UdpDevice() { close(socket_); }

bool UdpDevice::read(double time_s, Hand& hand) noexcept {
  time_s_ = time_s;
  const double now = bristle::DeadlineMonitor::wall_now();
  if (there_ && now - heard_at_ > silence_s_) there_ = false;
  // Has room for more than a packet, so that a longer packet is noticed and refused.
  HandPacket bytes[2];
  for (int i = 0; i < most_packets; ++i) {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t got =
        recvfrom(socket_, bytes, sizeof bytes, 0, reinterpret_cast<sockaddr*>(&from), &length);
    if (got < 0) break;
    const HandPacket& packet = bytes[0];
    const bool good = got == sizeof packet && is_good(packet);
    // Compares sequence numbers by their signed difference, because they may wrap around.
    const std::int64_t ahead = static_cast<std::int32_t>(packet.sequence - newest_.sequence);
    const bool newer = !there_ || (ahead > 0 && ahead <= most_ahead);
    if (!good || !newer) {
      ++refused_;
      continue;
    }
    newest_ = packet;
    peer_ = from;
    there_ = true;
    heard_at_ = now;
  }
  if (!there_) return false;
  hand = {};
  hand.holds = newest_.holds & 1;
  std::copy_n(newest_.position, 3, hand.position);
  std::copy_n(newest_.force, 3, hand.force);
  return true;
}

void UdpDevice::write(const double (&force)[3]) noexcept {
  if (!there_) return;
  ForcePacket packet;
  packet.sequence = newest_.sequence;
  packet.time = time_s_;
  std::copy_n(force, 3, packet.force);
  sendto(socket_, &packet, sizeof packet, MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&peer_),
         sizeof peer_);
}

}  // namespace room
