// Sees what a servo thread must not do: system calls, memory, locks, exceptions.
//
// For an executable of its own (servo_watch.cpp): malloc and its kin, the locks of pthread and the throwing
// of exceptions are defined there over those of the C library, and count; system calls are trapped by
// seccomp.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace bristle_test {

/// Counts of events on all threads of the process, unless a field says otherwise.
struct Counts {
  long allocations = 0;  ///< calls of malloc, free and their kin
  long locks = 0;        ///< calls of pthread's locks and conditions, on the watched thread
  long exceptions = 0;   ///< thrown
};

/// Whether this build can be watched: glibc, no sanitizer (these bring a malloc of their own).
bool can_watch() noexcept;

/// Since the program started; `locks` since the calling thread first asked.
Counts counts_so_far() noexcept;

/// Events that the watch saw in a child process.
struct Sighting {
  bool finished = false;          ///< the child came to its end
  bool trapped = false;           ///< the kernel let the filter in: system calls were watched
  Counts counts;                  ///< during `steps`
  std::vector<int> system_calls;  ///< numbers, of the watched thread during `steps`, in order, at most 64
  long system_call_count = 0;
  long value = 0;  ///< what `steps` returned
};

/// Forks. The child runs `prepare`, from then on watches its main thread, runs `steps` and ends. A system
/// call whose number is in `allowed` is let through, any other does not take place: it is written down and
/// fails (a futex wakes nobody). Fork before this process has threads.
Sighting watch(const std::function<void()>& prepare, const std::function<long()>& steps,
               const std::vector<int>& allowed = {});

/// "futex", "write", ...; the number where the name is not known.
std::string system_call_name(int number);

}  // namespace bristle_test
