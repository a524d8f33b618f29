// Wakes a loop at regular times, its ticks.
#pragma once

#include <cstdint>

namespace cli {

/// Grid of times one period apart, and a sleep until the next one. Times are absolute, so the grid never
/// drifts. A tick that wakes late starts at once. Grid times that have passed by then are skipped and not
/// made up for, so a late tick costs whole periods, and the loop goes on at one tick per grid time.
class PacedClock {
 public:
  /// Sets the period. From busy_wait_s before a grid time the thread polls the clock instead of sleeping,
  /// which occupies a core but starts closer to that time.
  PacedClock(double period_s, double busy_wait_s);

  /// Starts a new grid, whose first time is now.
  void start() noexcept;
  /// Sleeps until the next grid time that has not passed. Returns the number of times skipped. Returns early
  /// when a signal has set stop_requested().
  std::uint64_t wait() noexcept;
  /// Return the grid time last waited for, and the next one, in seconds of DeadlineMonitor::wall_now.
  double due_s() const noexcept { return 1e-9 * static_cast<double>(due_ns_); }
  double next_due_s() const noexcept { return 1e-9 * static_cast<double>(due_ns_ + period_ns_); }
  double period_s() const noexcept { return 1e-9 * static_cast<double>(period_ns_); }

 private:
  std::int64_t period_ns_, busy_wait_ns_;
  std::int64_t due_ns_ = 0;
};

/// Makes SIGINT and SIGTERM set stop_requested(), until the program ends. A signal more than half a second
/// after the first ends the program at once. (One Ctrl-C may arrive twice, from the terminal and through
/// `timeout`, also while the program writes its reports.)
void stop_on_signals() noexcept;
bool stop_requested() noexcept;

}  // namespace cli
