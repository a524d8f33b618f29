#include "tools/libraries/platform/realtime_thread.hpp"

#include <sys/mman.h>
#include <sys/prctl.h>

#include <cerrno>
#include <cstring>

#include <fmt/format.h>

namespace cli {

RealtimeThread::RealtimeThread(const RealtimeThreadOptions& options, bool has_workers)
    : timer_slack_ns_(::prctl(PR_GET_TIMERSLACK, 0, 0, 0, 0)) {
  ::prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0);
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
  const sched_param usual{};
  if (has_fifo_) ::sched_setscheduler(0, SCHED_OTHER, &usual);
  if (has_locked_memory_) ::munlockall();
  if (before_) ::sched_setaffinity(0, sizeof *before_, &*before_);
  if (timer_slack_ns_ > 0) ::prctl(PR_SET_TIMERSLACK, timer_slack_ns_, 0, 0, 0);
}

void RealtimeThread::take_fifo(int priority) {
  sched_param wanted{};
  wanted.sched_priority = priority;
  has_fifo_ = ::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &wanted) == 0;
  if (has_fifo_) return;
  refused_.push_back(
      fmt::format("SCHED_FIFO {}: {}; usual scheduling instead (needs root, CAP_SYS_NICE or ulimit -r {})",
                  priority, std::strerror(errno), priority));
}

void RealtimeThread::bind(int core) {
  cpu_set_t before, one;
  CPU_ZERO(&before);
  ::sched_getaffinity(0, sizeof before, &before);
  CPU_ZERO(&one);
  if (core < CPU_SETSIZE) CPU_SET(core, &one);
  if (::sched_setaffinity(0, sizeof one, &one) == 0)
    before_ = before;
  else
    refused_.push_back(fmt::format("core {}: {}; any core instead (this process may use {})", core,
                                   std::strerror(errno), CPU_COUNT(&before)));
}

void RealtimeThread::lock_memory() {
  // Locks only memory that is in use. If future memory were locked too, an allocation beyond the system's
  // limit would fail.
  has_locked_memory_ = ::mlockall(MCL_CURRENT) == 0;
  if (has_locked_memory_) return;
  refused_.push_back(fmt::format(
      "locked memory: {}; pages may be taken away (needs root, CAP_IPC_LOCK or a larger ulimit -l)",
      std::strerror(errno)));
}

}  // namespace cli
