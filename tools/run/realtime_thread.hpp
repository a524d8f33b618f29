// Requests of a thread to the system in order to be on time.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace cli {

struct RealtimeThreadOptions {
  std::optional<int> fifo_priority;  ///< SCHED_FIFO, 1 to 99
  std::optional<int> core;           ///< to be bound to
  bool lock_memory = false;          ///< no page of the process is taken away (mlockall of what there is)
};

/// Makes the calling thread a real-time thread for as long as it lives, as far as the system permits. What
/// is refused is reported and skipped. Timers are made exact (without the usual 50 us of slack), which needs
/// no permission. Threads made later do not inherit the priority.
class RealtimeThread {
 public:
  /// `has_workers`: other threads work for it, and must not starve under its priority.
  RealtimeThread(const RealtimeThreadOptions& options, bool has_workers);
  ~RealtimeThread();
  RealtimeThread(const RealtimeThread&) = delete;
  RealtimeThread& operator=(const RealtimeThread&) = delete;

  bool has_fifo() const noexcept { return has_fifo_; }
  bool is_bound() const noexcept { return before_.has_value(); }
  bool has_locked_memory() const noexcept { return has_locked_memory_; }
  /// One line each: what was refused, why, and what to do.
  const std::vector<std::string>& refused() const noexcept { return refused_; }

 private:
  void take_fifo(int priority);
  void bind(int core);
  void lock_memory();

  bool has_fifo_ = false, has_locked_memory_ = false;
  std::optional<std::vector<int>> before_;  // cores that it might use before
  int slack_ns_;
  std::vector<std::string> refused_;
};

}  // namespace cli
