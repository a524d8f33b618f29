// Detects what a servo thread must not do: system calls, memory allocation, locks, exceptions.
//
// A test needs an executable of its own (servo_watch.cpp): there malloc and its kin, the locks of pthread and
// the throwing of exceptions are replaced by counting versions; seccomp traps system calls.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace bristle_test {

/// Counts of events on all threads of the process, unless a field says otherwise.
struct Counts {
  long allocations = 0;  ///< number of calls of malloc, free and their kin
  long locks = 0;        ///< number of calls of pthread's locks and conditions, on the watched thread
  long exceptions = 0;   ///< number of exceptions thrown
};

/// Whether this build can be watched: it needs glibc, and no sanitizer (these bring a malloc of their own).
bool can_watch() noexcept;

/// Returns the counts since the program started; `locks` counts from the calling thread's first call of this
/// function.
Counts counts_so_far() noexcept;

/// Allocations, locks, exceptions and system calls seen in a child process.
struct Sighting {
  bool finished = false;  ///< whether the child ran to its end
  /// Whether the kernel accepted the filter, so that system calls were watched.
  bool trapped = false;
  Counts counts;  ///< numbers of events while `steps` ran
  /// Numbers of the watched thread's system calls during `steps`, in order, at most 64.
  std::vector<int> system_calls;
  long system_call_count = 0;
  long value = 0;  ///< value that the watched function `steps` returned
};

/// Forks a child, which runs `prepare`, then `steps` under watch, and ends. System calls with a number in
/// `allowed` are made; any other is recorded and fails instead (a futex wakes nobody). Call it before this
/// process has threads.
Sighting watch(const std::function<void()>& prepare, const std::function<long()>& steps,
               const std::vector<int>& allowed = {});

/// Returns the name of a system call, such as "futex" or "write"; its number if the name is not known.
std::string system_call_name(int number);

}  // namespace bristle_test
