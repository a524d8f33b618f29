#include "tools/libraries/run/realtime_thread.hpp"

#include <fmt/format.h>

#include "tools/libraries/platform/platform.hpp"

namespace cli {

RealtimeThread::RealtimeThread(const RealtimeThreadOptions& options, bool has_workers)
    : timers_(platform::use_exact_timers()) {
  if (options.core) bind(*options.core);
  if (options.lock_memory) lock_memory();
  if (!options.fifo_priority) return;
  if (has_workers)
    refused_.push_back(fmt::format(
        "SCHED_FIFO {}: not asked for with several threads, because a worker behind this one would "
        "never run; usual scheduling instead",
        *options.fifo_priority));
  else
    take_fifo(*options.fifo_priority);
}

RealtimeThread::~RealtimeThread() {
  if (has_fifo_) platform::use_usual_scheduling();
  if (has_locked_memory_) platform::unlock_memory();
  if (before_) platform::use_cores(*before_);
  platform::use_timers(timers_);
}

void RealtimeThread::take_fifo(int priority) {
  const std::string why_not = platform::take_fifo(priority);
  has_fifo_ = why_not.empty();
  if (!has_fifo_) refused_.push_back(fmt::format("SCHED_FIFO {}: {}", priority, why_not));
}

void RealtimeThread::bind(int core) {
  std::vector<int> before;
  const std::string why_not = platform::bind_thread(core, before);
  if (why_not.empty())
    before_ = before;
  else
    refused_.push_back(fmt::format("core {}: {}", core, why_not));
}

void RealtimeThread::lock_memory() {
  const std::string why_not = platform::lock_memory();
  has_locked_memory_ = why_not.empty();
  if (!has_locked_memory_) refused_.push_back(fmt::format("locked memory: {}", why_not));
}

}  // namespace cli
