// All services of the operating system that core needs besides threads: clocks and counters of a thread. Each
// family of systems has one source: posix.cpp, windows.cpp.
#pragma once

#include "bristle/deadline_monitor.hpp"

namespace bristle::detail {

/// Returns the seconds of a clock that never goes back.
double monotonic_seconds() noexcept;

/// Returns the seconds for which the calling thread has had a core.
double thread_seconds() noexcept;

/// Returns the counters of the calling thread and its process so far; zeros for those that the system lacks.
ThreadEvents thread_events() noexcept;

}  // namespace bristle::detail
