// The services of platform.hpp on Linux and other systems with POSIX.
#include <sys/resource.h>

#include <ctime>

#include "core/runtime/platform/platform.hpp"

namespace bristle::detail {

namespace {

double read_clock(clockid_t clock) noexcept {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

double monotonic_seconds() noexcept { return read_clock(CLOCK_MONOTONIC); }

double thread_seconds() noexcept { return read_clock(CLOCK_THREAD_CPUTIME_ID); }

ThreadEvents thread_events() noexcept {
  ThreadEvents events;
#if defined(RUSAGE_THREAD)
  rusage thread{}, process{};
  getrusage(RUSAGE_THREAD, &thread);
  getrusage(RUSAGE_SELF, &process);
  events.involuntary_switches = static_cast<std::uint64_t>(thread.ru_nivcsw);
  events.other_switches = static_cast<std::uint64_t>(process.ru_nivcsw - thread.ru_nivcsw);
  events.minor_faults = static_cast<std::uint64_t>(thread.ru_minflt);
  events.major_faults = static_cast<std::uint64_t>(thread.ru_majflt);
#endif
  return events;
}

}  // namespace bristle::detail
