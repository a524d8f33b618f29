// Things that a tick of the virtual room must not do on the haptic thread.
#include <catch2/catch.hpp>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <utility>

#include "servo_watch.hpp"
#include "tools/products/virtual_room/hand_motion.hpp"
#include "tools/products/virtual_room/haptic_loop.hpp"
#include "tools/products/virtual_room/udp_device.hpp"

using namespace bristle_test;

namespace {

/// Returns a hand's motion: pushes the block over the floor, off centre, along the end wall, over its top.
room::HandMotion busy_hand() {
  const auto at = [](double t, double x, double y, double z) {
    return room::HandRow{t, {true, {x, y, z}, {0, 0, -1.0}}};
  };
  return {{at(0.0, -0.07, 0.02, 0.03), at(1.0, 0.19, 0.03, 0.05), at(1.5, 0.1, 0.1, 0.1),
           at(2.0, 0.22, -0.1, 0.04), at(2.5, 0.28, -0.18, 0.02)}};
}

void check_clean(const Sighting& seen) {
  REQUIRE(seen.finished);
  CHECK(seen.counts.allocations == 0);
  CHECK(seen.counts.locks == 0);
  CHECK(seen.counts.exceptions == 0);
  for (const int number : seen.system_calls) {
    INFO("system call " << system_call_name(number));
    CHECK(false);
  }
}

/// Sends one packet, as a device server would: a hand that holds still.
void send_hand(int port) {
  room::HandPacket packet;
  packet.sequence = packet.holds = 1;
  packet.position[0] = -0.07;
  packet.position[2] = 0.03;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int from = socket(AF_INET, SOCK_DGRAM, 0);
  sendto(from, &packet, sizeof packet, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  close(from);
}

}  // namespace

TEST_CASE(
    "A tick of the virtual room takes no memory and no lock, and asks the system for time and usage alone",
    "[servo][room]") {
  if (!can_watch()) {
    std::printf("skipped: this build's malloc and locks cannot be counted\n");
    return;
  }
  for (const room::FrictionModel model :
       {room::FrictionModel::brush, room::FrictionModel::lugre, room::FrictionModel::coulomb}) {
    INFO("model " << static_cast<int>(model));
    std::unique_ptr<room::HapticLoop> loop;
    const Sighting seen = watch(
        [&] {
          room::LoopOptions options;
          options.settings.model = model;
          options.settings.bristles = 256;
          options.settings.kinetic = 0.8;
          options.settings.peak = 0.9;
          loop = std::make_unique<room::HapticLoop>(
              options, std::make_unique<room::PlayedHand>("script", busy_hand()));
        },
        [&] {
          loop->advance(3000);
          loop->exchange().room.refresh();
          return static_cast<long>(1e6 * loop->exchange().room.latest().block_position[0]);
        },
        // Calls that a tick may make: the clock; getrusage at the beginning and if the tick is late.
        {SYS_clock_gettime, SYS_getrusage});
    check_clean(seen);
    CHECK(seen.value > 100000);  // distance in um: the block has moved far
  }
}

TEST_CASE("With the network device a tick asks the system for packets beside that, in a pause too",
          "[servo][room]") {
  if (!can_watch()) {
    std::printf("skipped: this build's malloc and locks cannot be counted\n");
    return;
  }
  std::unique_ptr<room::HapticLoop> loop;
  const Sighting seen = watch(
      [&] {
        auto device = std::make_unique<room::UdpDevice>(0, 60.0);
        send_hand(device->port());
        room::LoopOptions options;
        options.settings.bristles = 256;
        loop = std::make_unique<room::HapticLoop>(options, std::move(device));
      },
      [&] {
        loop->advance(200);
        loop->exchange().room.refresh();
        const bool held = !loop->exchange().room.latest().device_lost;
        loop->exchange().acts.push(room::Act::pause);
        loop->advance(20);
        return static_cast<long>(held);
      },
      {SYS_clock_gettime, SYS_getrusage, SYS_recvfrom, SYS_sendto});
  check_clean(seen);
  CHECK(seen.value == 1);
}
