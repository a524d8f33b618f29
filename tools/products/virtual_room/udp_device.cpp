#include "tools/products/virtual_room/udp_device.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string>

#include <fmt/format.h>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/files/user_error.hpp"

namespace room {
namespace {

constexpr std::uint16_t version = 1;
constexpr std::int64_t most_ahead = 1 << 16;  // largest plausible jump of the sequence number
constexpr int most_packets = 32;              // limit of packets read in one tick, so that a flood does not
                                              // stop the loop

template <class T>
void put(unsigned char* to, T value) noexcept {
  static_assert(sizeof(T) <= 8);
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof value);  // copies bytes as they are: right on little-endian machines
                                             // only
  std::memcpy(to, &bits, sizeof value);
}
template <class T>
T get(const unsigned char* from) noexcept {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// Returns the tag of a packet's first 64 bytes, by SipHash-2-4 (Aumasson and Bernstein, 2012).
std::uint64_t tag_of(const unsigned char* packet, std::uint64_t key) noexcept {
  std::uint64_t v[4] = {key ^ 0x736f6d6570736575, 0x646f72616e646f6d, key ^ 0x6c7967656e657261,
                        0x7465646279746573};
  const auto mix = [](std::uint64_t& sum, std::uint64_t& turned, int bits) {
    sum += turned;
    turned = std::rotl(turned, bits) ^ sum;
  };
  const auto rounds = [&v, mix](int count) {
    for (; count > 0; --count) {
      mix(v[0], v[1], 13);
      v[0] = std::rotl(v[0], 32);
      mix(v[2], v[3], 16);
      mix(v[0], v[3], 21);
      mix(v[2], v[1], 17);
      v[2] = std::rotl(v[2], 32);
    }
  };
  const auto take = [&](std::uint64_t word) {
    v[3] ^= word;
    rounds(2);
    v[0] ^= word;
  };
  for (int at = 0; at < 64; at += 8) take(get<std::uint64_t>(packet + at));
  take(std::uint64_t{64} << 56);
  v[2] ^= 0xff;
  rounds(4);
  return v[0] ^ v[1] ^ v[2] ^ v[3];
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
  if (p.token != 0) put(to + 64, tag_of(to, p.token));
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

UdpDevice::UdpDevice(int port, const char* address, double silence_s, std::uint64_t token)
    : silence_s_(silence_s), token_(token) {
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(static_cast<std::uint16_t>(port));
  if (inet_pton(AF_INET, address, &own.sin_addr) != 1)
    throw cli::UserError(fmt::format("udp device: '{}' is not an IPv4 address", address));
  socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const auto* bound = reinterpret_cast<const sockaddr*>(&own);
  if (socket_ < 0 || bind(socket_, bound, sizeof own) != 0) {
    const std::string why = std::strerror(errno);
    if (socket_ >= 0) close(socket_);
    throw cli::UserError(
        fmt::format("udp device: cannot listen on {}:{}: {}; try another --port", address, port, why));
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
  unsigned char bytes[hand_packet_size + 1];  // has one byte more than a packet, so that a longer packet is
                                              // noticed
  for (int i = 0; i < most_packets; ++i) {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t got =
        recvfrom(socket_, bytes, sizeof bytes, 0, reinterpret_cast<sockaddr*>(&from), &length);
    if (got < 0) break;
    HandPacket packet;
    const bool good = decode(bytes, static_cast<std::size_t>(got), packet) &&
                      (token_ == 0 || get<std::uint64_t>(bytes + 64) == tag_of(bytes, token_));
    // Compares sequence numbers by their signed difference, since they may wrap around.
    const std::int64_t ahead = static_cast<std::int32_t>(packet.sequence - newest_.sequence);
    const bool newer = token_ != 0 ? !heard_ || ahead > 0 : !there_ || (ahead > 0 && ahead <= most_ahead);
    if (!good || !newer) {
      ++refused_;
      continue;
    }
    newest_ = packet;
    peer_ = from;
    there_ = heard_ = true;
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
