// Wakes a loop at regular times (ticks), for runs in real time.
#pragma once

#include <cstdint>

namespace cli {

/// Clock for a loop that runs once per period. Its times form a fixed grid, so that they never drift. A tick
/// that wakes late starts at once; grid times that have passed by then are skipped and not made up for, so
/// that a late tick costs whole periods and the loop then goes on at one tick per grid time.
class PacedClock {
 public:
  /// Sets the period. During the last busy_wait_s before a grid time the thread polls the clock instead of
  /// sleeping, which occupies a core but wakes it closer to that time.
  PacedClock(double period_s, double busy_wait_s);

  /// Starts a new grid of times. The first of them is now.
  void start() noexcept;
  /// Sleeps until the next grid time that is still ahead. Returns the number of grid times skipped. Returns
  /// early after a stop signal (see stop_requested()).
  std::uint64_t wait() noexcept;
  /// Return the grid time last waited for, and the next one, in s, on the clock DeadlineMonitor::wall_now.
  double due_s() const noexcept { return 1e-9 * static_cast<double>(due_ns_); }
  double next_due_s() const noexcept { return 1e-9 * static_cast<double>(due_ns_ + period_ns_); }
  double period_s() const noexcept { return 1e-9 * static_cast<double>(period_ns_); }

 private:
  std::int64_t period_ns_, busy_wait_ns_;
  std::int64_t due_ns_ = 0;
};

/// Makes SIGINT and SIGTERM set stop_requested(). A second signal, more than half a second after the first,
/// ends the program at once. (One Ctrl-C may arrive twice, from the terminal and through `timeout`, even
/// while the program writes its reports.)
void stop_on_signals() noexcept;
bool stop_requested() noexcept;

}  // namespace cli
