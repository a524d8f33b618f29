#include "tools/products/virtual_room/udp_device.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string>

#include <fmt/format.h>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/files/user_error.hpp"

namespace room {
namespace {

constexpr std::uint16_t version = 2;
constexpr std::int64_t most_ahead = 1 << 16;  // largest plausible jump of the sequence number
// Largest number of packets read in one tick, so that a flood of packets does not stop the loop.
constexpr int most_packets = 32;

template <class T>
void put(unsigned char* to, T value) noexcept {
  static_assert(sizeof(T) <= 8);
  std::uint64_t bits = 0;
  // Copies bytes as they are, which is right on little-endian machines only.
  std::memcpy(&bits, &value, sizeof value);
  std::memcpy(to, &bits, sizeof value);
}
template <class T>
T get(const unsigned char* from) noexcept {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

bool has_head(const unsigned char* from, const char* magic) noexcept {
  return std::memcmp(from, magic, 4) == 0 && get<std::uint16_t>(from + 4) == version;
}

}  // namespace

void encode(const HandPacket& p, unsigned char (&to)[hand_packet_size]) noexcept {
  std::memset(to, 0, sizeof to);
  std::memcpy(to, "BRHD", 4);
  put(to + 4, version);
  put(to + 6, static_cast<std::uint16_t>(p.hand.holds ? 1 : 0));
  put(to + 8, p.sequence);
  for (int i = 0; i < 3; ++i) put(to + 16 + 8 * i, p.hand.position[i]);
  for (int i = 0; i < 3; ++i) put(to + 40 + 8 * i, p.hand.force[i]);
}

void encode(const ForcePacket& p, unsigned char (&to)[force_packet_size]) noexcept {
  std::memset(to, 0, sizeof to);
  std::memcpy(to, "BRFC", 4);
  put(to + 4, version);
  put(to + 8, p.sequence);
  for (int i = 0; i < 3; ++i) put(to + 16 + 8 * i, p.force[i]);
  put(to + 40, p.time_s);
}

bool decode(const unsigned char* from, std::size_t size, HandPacket& p) noexcept {
  if (size != hand_packet_size || !has_head(from, "BRHD")) return false;
  HandPacket read;
  read.hand.holds = get<std::uint16_t>(from + 6) & 1;
  read.sequence = get<std::uint32_t>(from + 8);
  for (int i = 0; i < 3; ++i) {
    read.hand.position[i] = get<double>(from + 16 + 8 * i);
    read.hand.force[i] = get<double>(from + 40 + 8 * i);
    if (!std::isfinite(read.hand.position[i]) || !std::isfinite(read.hand.force[i])) return false;
  }
  p = read;
  return true;
}

bool decode(const unsigned char* from, std::size_t size, ForcePacket& p) noexcept {
  if (size != force_packet_size || !has_head(from, "BRFC")) return false;
  p.sequence = get<std::uint32_t>(from + 8);
  for (int i = 0; i < 3; ++i) p.force[i] = get<double>(from + 16 + 8 * i);
  p.time_s = get<double>(from + 40);
  return true;
}

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
  // Has room for one byte more than a packet, so that a longer packet is noticed and refused.
  unsigned char bytes[hand_packet_size + 1];
  for (int i = 0; i < most_packets; ++i) {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t got =
        recvfrom(socket_, bytes, sizeof bytes, 0, reinterpret_cast<sockaddr*>(&from), &length);
    if (got < 0) break;
    HandPacket packet;
    const bool good = decode(bytes, static_cast<std::size_t>(got), packet);
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
  if (there_) hand = newest_.hand;
  return there_;
}

void UdpDevice::write(const double (&force)[3]) noexcept {
  if (!there_) return;
  ForcePacket packet;
  packet.sequence = newest_.sequence;
  packet.time_s = time_s_;
  for (int i = 0; i < 3; ++i) packet.force[i] = force[i];
  unsigned char bytes[force_packet_size];
  encode(packet, bytes);
  sendto(socket_, bytes, sizeof bytes, MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&peer_), sizeof peer_);
}

}  // namespace room
