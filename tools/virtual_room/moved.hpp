// Measures the creep of a block without its swing under the taps, by its mean place over each pair of taps.
#pragma once

#include <cmath>
#include <limits>

#include "tools/virtual_room/world.hpp"

namespace room {

class Moved {
 public:
  static constexpr double settles = 6.0;  ///< s, time after the beginning from which on creep is counted

  /// Restarts the count: motion that a hand causes is no creep.
  void begin(double time_s = 0.0) noexcept {
    *this = {};
    since_ = time_s;
  }
  /// Adds a tick. Call it every tick; `x` is the place down the slope, m.
  void take(double time_s, double x) noexcept {
    const double pair = std::floor(time_s / tap_pair);
    if (pair != pair_) {
      if (count_ > 0.0) {  // the last pair of taps is over
        const double place = sum_ / count_;
        if (pair_ * tap_pair >= since_ + settles && begun_) {
          moved_ = place - from_;
        } else {
          from_ = place;
          begun_ = true;
        }
      }
      pair_ = pair;
      sum_ = count_ = 0.0;
    }
    sum_ += x;
    count_ += 1.0;
  }
  /// Returns the creep (m); NaN until counting starts.
  double metres() const noexcept { return moved_; }

 private:
  double pair_ = -1.0, sum_ = 0.0, count_ = 0.0, from_ = 0.0, since_ = 0.0;
  double moved_ = std::numeric_limits<double>::quiet_NaN();
  bool begun_ = false;
};

}  // namespace room
