#include "tools/run/realtime.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <string>

namespace cli {

using bristle::DeadlineMonitor;

RealtimeResult start_realtime(const RealtimeOptions& options, double period_s, double deadline_s,
                              const RealtimeThread& thread) {
  RealtimeResult result;
  result.period = result.scene_dt = period_s;
  result.busy_wait = options.busy_wait_s;
  if (thread.has_fifo()) result.fifo = options.thread.fifo_priority;
  if (thread.is_bound()) result.core = options.thread.core;
  result.locked_memory = thread.has_locked_memory();
  result.refused = thread.refused();
  result.ours.monitor = result.bare.monitor = DeadlineMonitor(deadline_s, period_s);
  return result;
}

void run_bare_segment(PacedLoopResult& loop, std::uint64_t ticks, PacedClock& clock,
                      const QueueClock& queue) {
  DeadlineMonitor& monitor = loop.monitor;
  monitor.pause();
  monitor.refresh_events();
  double queued_s = queue.now();
  clock.start();
  for (std::uint64_t k = 0; k < ticks; ++k) {
    const std::uint64_t left_out = clock.wait();
    if (stop_requested()) return;
    if (left_out > 0) monitor.record_skipped(left_out);
    const double cpu = DeadlineMonitor::cpu_now();
    const double start = DeadlineMonitor::wall_now();
    const double end = DeadlineMonitor::wall_now();
    record_tick(loop, {clock.due_s(), start, end, DeadlineMonitor::cpu_now() - cpu}, queue, queued_s);
  }
}

void record_tick(PacedLoopResult& loop, const bristle::Tick& tick, const QueueClock& queue,
                 double& queued_s) {
  const std::uint64_t number = loop.monitor.count();
  loop.monitor.record_tick(tick);
  const double queued_now = queue.now();
  if (loop.monitor.worst().number == number) loop.queued_worst_s = queued_now - queued_s;
  queued_s = queued_now;
  loop.monitor.refresh_events();
}

QueueClock::QueueClock() noexcept : file_(open("/proc/thread-self/schedstat", O_RDONLY | O_CLOEXEC)) {}

QueueClock::~QueueClock() {
  if (file_ >= 0) close(file_);
}

double QueueClock::now() const noexcept {
  // Contents of schedstat: ns run on a core, ns waiting for a core, number of time slices.
  char text[64];
  const ssize_t length = file_ >= 0 ? pread(file_, text, sizeof text, 0) : 0;
  if (length <= 0) return 0.0;
  const char* const end = text + length;
  const char* const space = std::find(static_cast<const char*>(text), end, ' ');
  std::uint64_t ns = 0;
  if (space != end) std::from_chars(space + 1, end, ns);
  return 1e-9 * static_cast<double>(ns);
}

double stolen_now() {
  // First line of /proc/stat: "cpu user nice system idle iowait irq softirq steal ...", in clock ticks of the
  // system.
  std::ifstream stat("/proc/stat");
  std::string label;
  double ticks = 0.0;
  stat >> label;
  for (int field = 0; field < 8; ++field) stat >> ticks;
  const long per_second = sysconf(_SC_CLK_TCK);
  return stat && label == "cpu" && per_second > 0 ? ticks / static_cast<double>(per_second) : 0.0;
}

}  // namespace cli
