// Smooths the position of a hand that arrives in jumps: a mouse reports pixels sixty times a second, and a
// spring of 400 N/m would turn each jump into a blow.
#pragma once

#include <algorithm>
#include <cmath>

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

}  // namespace room
