#include "tools/run/realtime_thread.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <cerrno>
#include <cstring>

#include <fmt/format.h>

namespace cli {

RealtimeThread::RealtimeThread(const RealtimeThreadOptions& options, bool has_workers)
    : slack_ns_(prctl(PR_GET_TIMERSLACK, 0, 0, 0, 0)) {
  prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0);
  if (options.core) bind(*options.core);
  if (options.lock_memory) lock_memory();
  if (!options.fifo_priority) return;
  if (options.core && !is_bound()) {
    // Refuses a real-time priority without a core to bind to: the thread might occupy the core of a worker
    // thread, which has the usual priority and would never run.
    refused_.push_back(fmt::format("SCHED_FIFO {}: not asked for without core {}; usual scheduling instead",
                                   *options.fifo_priority, *options.core));
    return;
  }
  if (has_workers && before_ && before_->size() == 1) {
    refused_.push_back(fmt::format(
        "SCHED_FIFO {}: not asked for, workers have no other core than {}; usual scheduling instead",
        *options.fifo_priority, *options.core));
    return;
  }
  take_fifo(*options.fifo_priority);
}

RealtimeThread::~RealtimeThread() {
  if (has_fifo_) {
    sched_param usual{};
    sched_setscheduler(0, SCHED_OTHER, &usual);
  }
  if (has_locked_memory_) munlockall();
  if (before_) {
    cpu_set_t cores;
    CPU_ZERO(&cores);
    for (int core : *before_) CPU_SET(core, &cores);
    sched_setaffinity(0, sizeof cores, &cores);
  }
  if (slack_ns_ > 0) prctl(PR_SET_TIMERSLACK, slack_ns_, 0, 0, 0);
}

void RealtimeThread::take_fifo(int priority) {
  sched_param wanted{};
  wanted.sched_priority = priority;
  if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &wanted) == 0) {
    has_fifo_ = true;
    return;
  }
  refused_.push_back(
      fmt::format("SCHED_FIFO {}: {}; usual scheduling instead (needs root, CAP_SYS_NICE or ulimit -r {})",
                  priority, std::strerror(errno), priority));
}

void RealtimeThread::bind(int core) {
  cpu_set_t before;
  CPU_ZERO(&before);
  sched_getaffinity(0, sizeof before, &before);
  cpu_set_t one;
  CPU_ZERO(&one);
  if (core < CPU_SETSIZE) CPU_SET(core, &one);
  if (sched_setaffinity(0, sizeof one, &one) != 0) {
    refused_.push_back(fmt::format("core {}: {}; any core instead (this process may use {})", core,
                                   std::strerror(errno), CPU_COUNT(&before)));
    return;
  }
  before_.emplace();
  for (int i = 0; i < CPU_SETSIZE; ++i)
    if (CPU_ISSET(i, &before)) before_->push_back(i);
}

void RealtimeThread::lock_memory() {
  // Locks only the memory that is in use. If future memory were locked too, an allocation beyond the system's
  // limit would fail.
  if (mlockall(MCL_CURRENT) == 0) {
    has_locked_memory_ = true;
    return;
  }
  refused_.push_back(fmt::format(
      "locked memory: {}; pages may be taken away (needs root, CAP_IPC_LOCK or a larger ulimit -l)",
      std::strerror(errno)));
}

}  // namespace cli
