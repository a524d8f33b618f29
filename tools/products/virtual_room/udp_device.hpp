// A device on the network: any lab's device server sends where its hand is and gets the force back.
//
// One datagram each way per device tick, little-endian, no padding:
//
//   to the room, 72 bytes                         from the room, 48 bytes
//   0  char[4]  "BRHD"                            0  char[4]  "BRFC"
//   4  u16      version, 1                        4  u16      version, 1
//   6  u16      flags: 1 = holds the tool         6  u16      0
//   8  u32      sequence number                   8  u32      sequence number of the newest hand used
//   12 u32      0                                 12 u32      0
//   16 f64[3]   position, m                       16 f64[3]   force on the hand, N
//   40 f64[3]   force on the tool beside the      40 f64      time of the simulation, s
//               spring, N
//   64 f64      the sender's clock, s (not read);
//               of a room that has a token: u64, a tag
//
// Whoever may send to the port moves the block. On a machine that others use too, the room and its device
// server share a token that nobody else knows. It never travels: a packet's tag is SipHash-2-4 of its first
// 64 bytes under the key of 16 bytes that the token, little-endian, and 8 zero bytes make.
//
// Packets of another size, with another tag, magic or version, with a number that is not finite, or with a
// sequence number that is not newer than the last are counted and dropped. After 0.1 s without a packet the
// device is lost. Without a token the next good packet, of any sequence number, brings it back, and while the
// device is there a number more than 65,536 ahead is dropped too: a stray packet cannot lock it out. With a
// token the number must be newer than any before, else a packet that somebody recorded would be taken again:
// a server that starts again goes on counting, from its clock in milliseconds for instance. The room answers
// the sender of the newest packet.
#pragma once

#include <cstddef>
#include <cstdint>

#include <netinet/in.h>

#include "tools/products/virtual_room/device.hpp"

namespace room {

inline constexpr std::size_t hand_packet_size = 72, force_packet_size = 48;

struct HandPacket {
  std::uint32_t sequence = 0;
  Hand hand;
  std::uint64_t token = 0;  ///< key by which encode() tags the packet; 0 = no tag. decode() leaves it as it
                            ///< is
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
  /// Listens for hands on `address` and `port` (0 = any free one). With an address other than loopback, the
  /// network can push the block. The device is lost after `silence_s` without a packet. `token` is the key of
  /// the tag that packets must carry; 0 = no tag. Throws cli::UserError.
  explicit UdpDevice(int port, const char* address = "127.0.0.1", double silence_s = 0.1,
                     std::uint64_t token = 0);
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
  std::uint64_t token_;
  sockaddr_in peer_{};
  bool there_ = false, heard_ = false;
  double heard_at_ = 0.0, time_s_ = 0.0;  // wall time of the last packet, s; simulated time, s
  HandPacket newest_;
  std::uint64_t refused_ = 0;
};

}  // namespace room
