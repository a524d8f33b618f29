// A servo loop to measure in: once a millisecond, on a core of its own.
#pragma once

#include <sched.h>
#include <time.h>

namespace bristle_bench {

constexpr int servo_core = 0;

/// Binds this thread to the servo core for as long as it lives. To be made after the workers: oneTBB takes
/// the number of threads from the cores that the process may use when it starts.
class BoundThread {
 public:
  BoundThread() {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(servo_core, &one);
    sched_setaffinity(0, sizeof one, &one);
  }
  ~BoundThread() { sched_setaffinity(0, sizeof before_, &before_); }
  BoundThread(const BoundThread&) = delete;
  BoundThread& operator=(const BoundThread&) = delete;

 private:
  cpu_set_t before_;
};

/// A servo loop's wait: sleeps up to the start of the next millisecond.
class PacedLoop {
 public:
  PacedLoop() { clock_gettime(CLOCK_MONOTONIC, &next_); }
  void wait() {
    next_.tv_nsec += period_ns;
    if (next_.tv_nsec >= second_ns) {
      next_.tv_nsec -= second_ns;
      ++next_.tv_sec;
    }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next_, nullptr);
    // Where a step ran over, the loop starts anew instead of catching up.
    timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    if ((now.tv_sec - next_.tv_sec) * second_ns + now.tv_nsec - next_.tv_nsec > period_ns) next_ = now;
  }

 private:
  static constexpr long period_ns = 1000000, second_ns = 1000000000;
  timespec next_;
};

}  // namespace bristle_bench
