// Smooths a hand that arrives in leaps: a mouse speaks in pixels, sixty times a second, and a spring of 400
// N/m makes a blow of each.
#pragma once

#include <algorithm>
#include <cmath>

namespace room {

/// Two equal low-pass filters in turn, exact for a hand that stands between calls: a leap arrives after
/// about `delay`, with neither a jump nor a kink, and does not overshoot.
class HandFilter {
 public:
  static constexpr double delay = 0.04;  ///< s

  void begin(const double (&at)[4]) noexcept {
    for (int i = 0; i < 4; ++i) first_[i] = second_[i] = at[i];
  }
  /// Position (m) and press (N) after `dt_s` in which the hand stood at `at`.
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
