#include "tools/libraries/run/realtime.hpp"

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

}  // namespace cli
