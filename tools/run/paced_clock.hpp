// The points in time at which a paced loop starts its ticks.
#pragma once

#include <cstdint>

namespace cli {

/// A grid of points one period apart, and a sleep from one to the next. Absolute times: it never drifts. A
/// tick that is woken late starts at once. Points that have passed when it is done are left out and never
/// made up for: a late tick costs whole periods, and the loop continues in step with the grid, one tick a
/// point.
class PacedClock {
 public:
  /// Sleeps up to busy_wait_s before a point, and from there on looks at the clock all the time: spends a
  /// core to start closer to the point.
  PacedClock(double period_s, double busy_wait_s);

  /// A new grid from now on.
  void start() noexcept;
  /// Sleeps up to the next point that has not passed; returns how many had and are left out. Returns early
  /// when a signal has set stop_requested().
  std::uint64_t wait() noexcept;
  /// The point last waited for, and the one after it, in seconds of DeadlineMonitor::wall_now.
  double due_s() const noexcept { return 1e-9 * static_cast<double>(due_ns_); }
  double next_due_s() const noexcept { return 1e-9 * static_cast<double>(due_ns_ + period_ns_); }
  double period_s() const noexcept { return 1e-9 * static_cast<double>(period_ns_); }

 private:
  std::int64_t period_ns_, busy_wait_ns_;
  std::int64_t due_ns_ = 0;
};

/// To the end of the program SIGINT or SIGTERM only sets stop_requested(); one that comes more than half a
/// second after the first ends the program. (One Ctrl-C may arrive twice, from the terminal and passed on by
/// `timeout`: the second may come while the program writes its reports, or later still.)
void stop_on_signals() noexcept;
bool stop_requested() noexcept;

}  // namespace cli
