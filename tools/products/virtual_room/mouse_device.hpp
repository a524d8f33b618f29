// The mouse as a haptic device: takes the hand that the graphic loop sends by the exchange, and smooths it at
// the rate of ticks. A mouse reports pixels sixty times a second, and a spring of 400 N/m would turn each
// jump into a blow.
#pragma once

#include <algorithm>
#include <cmath>

#include "tools/products/virtual_room/device.hpp"
#include "tools/products/virtual_room/exchange.hpp"

namespace room {

/// Filter of a hand's position and press: two equal low-passes in series, exact for an input that is constant
/// between calls. Its output follows a jump after about `delay`, without jump, kink or overshoot.
class HandFilter {
 public:
  static constexpr double delay = 0.04;  ///< mean delay of the filtered hand, s

  void begin(const double (&at)[4]) noexcept {
    for (int i = 0; i < 4; ++i) first_[i] = second_[i] = at[i];
  }
  /// Advances the filter by `dt_s`, during which the hand was at `at`: position (m) and press on the tool
  /// (N).
  void follow(const double (&at)[4], double dt_s) noexcept {
    const double steps = std::max(dt_s, 0.0) / (0.5 * delay), rest = std::exp(-steps);
    for (int i = 0; i < 4; ++i) {
      const double first = first_[i] - at[i], second = second_[i] - at[i];
      first_[i] = at[i] + rest * first;
      second_[i] = at[i] + rest * (second + steps * first);
    }
  }
  double operator[](int i) const noexcept { return second_[i]; }

 private:
  double first_[4] = {0, 0, 0, 0}, second_[4] = {0, 0, 0, 0};
};

class MouseDevice final : public Device {
 public:
  explicit MouseDevice(Exchange& exchange) : exchange_(exchange) {}
  const char* name() const noexcept override { return "mouse"; }
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
