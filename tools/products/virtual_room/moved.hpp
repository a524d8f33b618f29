// Measures how far a block creeps on a tapped slope. The block swings under the taps, so its place is
// averaged over pairs of taps.
#pragma once

#include <cmath>
#include <limits>

#include "tools/products/virtual_room/world.hpp"

namespace room {

class Moved {
 public:
  static constexpr double settles = 6.0;  ///< time for the block to settle before creep is counted, s

  /// Restarts the measurement of creep at the time `time_s`. Call it after the user has moved the block,
  /// because that motion is no creep.
  void begin(double time_s = 0.0) noexcept {
    *this = {};
    since_ = time_s;
  }
  /// Adds the block's place down the slope (m) at a tick. Call it every tick.
  void take(double time_s, double x) noexcept {
    const double pair = std::floor(time_s / tap_pair);
    if (pair != pair_) {
      if (count_ > 0.0) {  // a pair of taps has ended: takes its mean place
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
  /// Returns the creep (m) since the measurement began; NaN before that.
  double metres() const noexcept { return moved_; }

 private:
  double pair_ = -1.0, sum_ = 0.0, count_ = 0.0, from_ = 0.0, since_ = 0.0;
  double moved_ = std::numeric_limits<double>::quiet_NaN();
  bool begun_ = false;
};

}  // namespace room
