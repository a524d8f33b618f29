// The mouse: what the graphic loop made of it, through the exchange.
#pragma once

#include "tools/virtual_room/device.hpp"
#include "tools/virtual_room/exchange.hpp"

namespace room {

class MouseDevice final : public Device {
 public:
  explicit MouseDevice(Exchange& exchange) : exchange_(exchange) {}
  const char* name() const noexcept override { return "mouse"; }
  DeviceLimits limits() const noexcept override { return {}; }
  bool read(double, Hand& hand) noexcept override {
    exchange_.mouse.refresh();
    const MouseHand& mouse = exchange_.mouse.latest();
    hand.holds = mouse.holds;
    for (int i = 0; i < 3; ++i) hand.position[i] = mouse.position[i];
    hand.force[2] = mouse.holds ? -mouse.press : 0.0;
    return true;
  }
  void write(const double (&)[3]) noexcept override {}  // a mouse pushes nobody

 private:
  Exchange& exchange_;
};

}  // namespace room
