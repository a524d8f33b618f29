// Servo loop: one tick per period.
#pragma once

#include <time.h>

#include <cmath>

namespace bristle_bench {

/// Timer of a servo loop. It sleeps until the next point of a grid of absolute times, so that delays do not
/// add up.
class PacedLoop {
 public:
  explicit PacedLoop(double period_s = 1e-3) : period_ns_(std::lround(1e9 * period_s)) {
    clock_gettime(CLOCK_MONOTONIC, &next_);
  }
  void wait() noexcept {
    next_.tv_nsec += period_ns_;
    while (next_.tv_nsec >= second_ns) {
      next_.tv_nsec -= second_ns;
      ++next_.tv_sec;
    }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next_, nullptr);
    due_s_ = static_cast<double>(next_.tv_sec) + 1e-9 * static_cast<double>(next_.tv_nsec);
    // Counts the times of ticks from now on if this tick is over a period late. Otherwise the loop would
    // catch up by ticks without a pause.
    timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    if ((now.tv_sec - next_.tv_sec) * second_ns + now.tv_nsec - next_.tv_nsec > period_ns_) next_ = now;
  }
  /// Returns the time at which this tick should have begun, s on the monotonic clock.
  double due_s() const noexcept { return due_s_; }

 private:
  static constexpr long second_ns = 1000000000;
  long period_ns_;
  timespec next_;
  double due_s_ = 0.0;
};

}  // namespace bristle_bench
