// Clock for a paced loop: the times at which its ticks start.
#pragma once

#include <cstdint>

namespace cli {

/// Grid of times one period apart, and a sleep from one to the next. Times are absolute, so it never drifts.
/// A tick that is woken late starts at once. Grid points that have passed by then are left out and not made
/// up for: a late tick costs whole periods, and the loop continues on the grid, one tick per point.
class PacedClock {
 public:
  /// Sets the period. From busy_wait_s before a point the thread polls the clock instead of sleeping, which
  /// uses a core but starts closer to the point.
  PacedClock(double period_s, double busy_wait_s);

  /// Starts a new grid at the present time.
  void start() noexcept;
  /// Sleeps until the next point that has not passed; returns the number of points left out. Returns early
  /// when a signal has set stop_requested().
  std::uint64_t wait() noexcept;
  /// Return the point last waited for, and the one after it, in seconds of DeadlineMonitor::wall_now.
  double due_s() const noexcept { return 1e-9 * static_cast<double>(due_ns_); }
  double next_due_s() const noexcept { return 1e-9 * static_cast<double>(due_ns_ + period_ns_); }
  double period_s() const noexcept { return 1e-9 * static_cast<double>(period_ns_); }

 private:
  std::int64_t period_ns_, busy_wait_ns_;
  std::int64_t due_ns_ = 0;
};

/// Makes SIGINT and SIGTERM set stop_requested() until the end of the program; a signal more than half a
/// second after the first ends the program. (One Ctrl-C may arrive twice, from the terminal and through
/// `timeout`, also while the program writes its reports.)
void stop_on_signals() noexcept;
bool stop_requested() noexcept;

}  // namespace cli
