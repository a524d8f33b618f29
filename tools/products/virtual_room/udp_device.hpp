// A device behind a device server on this machine, which sends where its hand is and gets the force back: one
// datagram each way per device tick, which has the bytes of the structs below.
//
// The port listens on the loopback address alone, and every program of this machine may send to it. Packets
// of another size, magic or version, with a number that is not finite, or with a sequence number that is not
// newer than the last are counted and dropped. A number more than 65,536 ahead is dropped too, so that a
// stray packet cannot lock the device out. After 0.1 s without a packet the device is lost; the next good
// packet, of any sequence number, brings it back. The room answers the sender of the newest packet.
#pragma once

#include <bit>
#include <cstdint>

#include <netinet/in.h>

#include "tools/products/virtual_room/device.hpp"

namespace room {

inline constexpr std::uint16_t packet_version = 2;

/// Datagram to the room: 64 bytes, little-endian, no padding.
struct HandPacket {
  char magic[4] = {'B', 'R', 'H', 'D'};
  std::uint16_t version = packet_version;
  std::uint16_t holds = 0;  ///< 1: the hand holds the tool; other bits are ignored
  std::uint32_t sequence = 0;
  std::uint32_t zero = 0;
  double position[3] = {0, 0, 0};  ///< position of the hand, m
  double force[3] = {0, 0, 0};     ///< force on the tool beside the spring, N
};
/// Datagram from the room: 48 bytes, little-endian, no padding.
struct ForcePacket {
  char magic[4] = {'B', 'R', 'F', 'C'};
  std::uint16_t version = packet_version;
  std::uint16_t zero = 0;
  std::uint32_t sequence = 0;  ///< sequence number of the newest hand used
  std::uint32_t zero_too = 0;
  double force[3] = {0, 0, 0};  ///< force on the hand, N
  double time = 0.0;            ///< time of the simulation, s
};
static_assert(std::endian::native == std::endian::little);
static_assert(sizeof(HandPacket) == 64 && sizeof(ForcePacket) == 48);

class UdpDevice final : public Device {
 public:
  /// Listens for hands on this port of the loopback address (0 = any free one). The device is lost after
  /// `silence_s` without a packet. Throws cli::UserError.
  explicit UdpDevice(int port, double silence_s = 0.1);
  ~UdpDevice() override;
  UdpDevice(const UdpDevice&) = delete;
  UdpDevice& operator=(const UdpDevice&) = delete;

  const char* name() const noexcept override { return "udp"; }
  bool read(double time_s, Hand& hand) noexcept override;
  void write(const double (&force)[3]) noexcept override;

  int port() const noexcept { return port_; }
  std::uint64_t refused() const noexcept { return refused_; }

 private:
  int socket_ = -1, port_ = 0;
  double silence_s_;
  sockaddr_in peer_{};
  bool there_ = false;
  double heard_at_ = 0.0, time_s_ = 0.0;  // wall time of the last packet, s; simulated time, s
  HandPacket newest_;
  std::uint64_t refused_ = 0;
};

}  // namespace room
