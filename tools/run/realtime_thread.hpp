// Asks the system for a thread's real-time priority, core and locked memory.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace cli {

struct RealtimeThreadOptions {
  std::optional<int> fifo_priority;  ///< SCHED_FIFO priority, 1 to 99
  std::optional<int> core;           ///< number of the core to which the thread is bound
  bool lock_memory = false;          ///< whether pages in use stay in memory (mlockall)
};

/// Makes the calling thread a real-time thread while this object lives, as far as the system permits. Reports
/// what the system refuses, and does without. Its timers become exact (without the usual 50 us of slack),
/// which needs no permission. Threads made later do not inherit the priority.
class RealtimeThread {
 public:
  /// Asks the system for the options. `has_workers` says that other threads work for this one, which must not
  /// take their cores.
  RealtimeThread(const RealtimeThreadOptions& options, bool has_workers);
  ~RealtimeThread();
  RealtimeThread(const RealtimeThread&) = delete;
  RealtimeThread& operator=(const RealtimeThread&) = delete;

  bool has_fifo() const noexcept { return has_fifo_; }
  bool is_bound() const noexcept { return before_.has_value(); }
  bool has_locked_memory() const noexcept { return has_locked_memory_; }
  /// Returns a line for each request that the system refused: what, why, and what to do.
  const std::vector<std::string>& refused() const noexcept { return refused_; }

 private:
  void take_fifo(int priority);
  void bind(int core);
  void lock_memory();

  bool has_fifo_ = false, has_locked_memory_ = false;
  std::optional<std::vector<int>> before_;  // cores on which the thread might run before
  int timers_;                              // what undoes the exact timers
  std::vector<std::string> refused_;
};

}  // namespace cli
