// Servo loop: one tick per period, on a core of its own.
#pragma once

#include <sched.h>
#include <time.h>

#include <cmath>

namespace bristle_bench {

/// Returns the first core that this process may use.
inline int servo_core() noexcept {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  sched_getaffinity(0, sizeof cores, &cores);
  int core = 0;
  while (core + 1 < CPU_SETSIZE && !CPU_ISSET(core, &cores)) ++core;
  return core;
}

/// Binds this thread to the servo core for as long as it lives. Make it after the workers: oneTBB takes the
/// number of threads from the cores that the process may use at its start.
class BoundThread {
 public:
  BoundThread() {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(servo_core(), &one);
    sched_setaffinity(0, sizeof one, &one);
  }
  ~BoundThread() { sched_setaffinity(0, sizeof before_, &before_); }
  BoundThread(const BoundThread&) = delete;
  BoundThread& operator=(const BoundThread&) = delete;

 private:
  cpu_set_t before_;
};

/// Timer of a servo loop, which sleeps until the next point of a grid of absolute times.
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
    // Restarts the grid at the present time if the tick is over a period late, instead of catching up.
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
