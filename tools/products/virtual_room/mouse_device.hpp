// The mouse as a haptic device: takes the hand that the graphic loop sends by the exchange, and smooths it at
// the rate of ticks.
#pragma once

#include "tools/products/virtual_room/device.hpp"
#include "tools/products/virtual_room/exchange.hpp"
#include "tools/products/virtual_room/hand_filter.hpp"

namespace room {

class MouseDevice final : public Device {
 public:
  explicit MouseDevice(Exchange& exchange) : exchange_(exchange) {}
  const char* name() const noexcept override { return "mouse"; }
  DeviceLimits limits() const noexcept override { return {}; }
  bool read(double time_s, Hand& hand) noexcept override {
    exchange_.mouse.refresh();
    const MouseHand& mouse = exchange_.mouse.latest();
    const double at[4] = {mouse.position[0], mouse.position[1], mouse.position[2], mouse.press};
    if (held_ && mouse.holds) {
      filter_.follow(at, time_s - last_time_);
    } else {
      filter_.begin({at[0], at[1], at[2], 0.0});
    }
    const double turn[4] = {mouse.angle, 0.0, 0.0, 0.0};
    if (turned_ && mouse.turns) {
      turn_filter_.follow(turn, time_s - last_time_);
    } else {
      turn_filter_.begin(turn);
    }
    held_ = mouse.holds;
    turned_ = mouse.turns;
    last_time_ = time_s;
    hand.turns = mouse.turns;
    hand.angle = turn_filter_[0];
    hand.holds = mouse.holds;
    for (int i = 0; i < 3; ++i) hand.position[i] = filter_[i];
    hand.force[2] = mouse.holds ? -filter_[3] : 0.0;
    return true;
  }
  void write(const double (&)[3]) noexcept override {}  // a mouse gives no force feedback

 private:
  Exchange& exchange_;
  HandFilter filter_, turn_filter_;
  bool held_ = false, turned_ = false;
  double last_time_ = 0.0;
};

}  // namespace room
