// Asks the system for real-time priority, a fixed core and locked memory for a thread, and reports what it
// refuses.
#pragma once

#include <sched.h>

#include <optional>
#include <string>
#include <vector>

namespace cli {

struct RealtimeThreadOptions {
  std::optional<int> fifo_priority;  ///< SCHED_FIFO priority, 1 to 99
  std::optional<int> core;           ///< core to which the thread is bound
  bool lock_memory = false;          ///< whether memory in use is kept from being paged out (mlockall)
};

/// Makes the calling thread a real-time thread for as long as this object lives. What the system refuses is
/// left out, and listed. Always makes the thread's timers exact (without the usual slack of 50 us), which
/// needs no permission. Threads made later do not inherit the priority.
class RealtimeThread {
 public:
  /// Asks the system for what `options` want. `has_workers` says that this thread waits for worker threads,
  /// which its priority could keep from running.
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
  std::optional<cpu_set_t> before_;  // cores on which the thread might run before
  int timer_slack_ns_;               // slack of the thread's timers before
  std::vector<std::string> refused_;
};

}  // namespace cli
