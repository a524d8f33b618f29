// A device behind a device server on this machine, which sends where its hand is and gets the force back.
//
// One datagram each way per device tick, little-endian, no padding:
//
//   to the room, 64 bytes                         from the room, 48 bytes
//   0  char[4]  "BRHD"                            0  char[4]  "BRFC"
//   4  u16      version, 2                        4  u16      version, 2
//   6  u16      flags: 1 = holds the tool         6  u16      0
//   8  u32      sequence number                   8  u32      sequence number of the newest hand used
//   12 u32      0                                 12 u32      0
//   16 f64[3]   position, m                       16 f64[3]   force on the hand, N
//   40 f64[3]   force on the tool beside the      40 f64      time of the simulation, s
//               spring, N
//
// The port listens on the loopback address alone, and every program of this machine may send to it. Packets
// of another size, magic or version, with a number that is not finite, or with a sequence number that is not
// newer than the last are counted and dropped. A number more than 65,536 ahead is dropped too, so that a
// stray packet cannot lock the device out. After 0.1 s without a packet the device is lost; the next good
// packet, of any sequence number, brings it back. The room answers the sender of the newest packet.
#pragma once

#include <cstddef>
#include <cstdint>

#include <netinet/in.h>

#include "tools/products/virtual_room/device.hpp"

namespace room {

inline constexpr std::size_t hand_packet_size = 64, force_packet_size = 48;

struct HandPacket {
  std::uint32_t sequence = 0;
  Hand hand;
};
struct ForcePacket {
  std::uint32_t sequence = 0;
  double force[3] = {0, 0, 0}, time_s = 0.0;
};
void encode(const HandPacket& packet, unsigned char (&to)[hand_packet_size]) noexcept;
void encode(const ForcePacket& packet, unsigned char (&to)[force_packet_size]) noexcept;
/// Reads a packet from bytes. Returns false if they are not a valid packet.
bool decode(const unsigned char* from, std::size_t size, HandPacket& packet) noexcept;
bool decode(const unsigned char* from, std::size_t size, ForcePacket& packet) noexcept;

class UdpDevice final : public Device {
 public:
  /// Listens for hands on this port of the loopback address (0 = any free one). The device is lost after
  /// `silence_s` without a packet. Throws cli::UserError.
  explicit UdpDevice(int port, double silence_s = 0.1);
  ~UdpDevice() override;
  UdpDevice(const UdpDevice&) = delete;
  UdpDevice& operator=(const UdpDevice&) = delete;

  const char* name() const noexcept override { return "udp"; }
  DeviceLimits limits() const noexcept override { return {}; }
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
