// The services of the operating system that core needs besides threads: clocks, and counters of a thread.
// Each family of systems has one source file: posix.cpp, windows.cpp.
#pragma once

#include "bristle/deadline_monitor.hpp"

namespace bristle::detail {

/// Returns the reading of a clock that never goes back, in s.
double monotonic_seconds() noexcept;

/// Returns the time for which the calling thread has had a core, in s.
double thread_seconds() noexcept;

/// Returns the counters of the calling thread and its process so far; zeros for those that the system lacks.
ThreadEvents thread_events() noexcept;

}  // namespace bristle::detail
