#include "tools/cli/realtime.hpp"

#include <unistd.h>

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

void run_bare_segment(DeadlineMonitor& monitor, std::uint64_t ticks, PacedClock& clock) {
  monitor.pause();
  monitor.refresh_events();
  clock.start();
  for (std::uint64_t k = 0; k < ticks; ++k) {
    const std::uint64_t left_out = clock.wait();
    if (stop_requested()) return;
    if (left_out > 0) monitor.record_skipped(left_out);
    const double cpu = DeadlineMonitor::cpu_now();
    const double start = DeadlineMonitor::wall_now();
    const double end = DeadlineMonitor::wall_now();
    monitor.record(bristle::Tick{clock.due_s(), start, end, DeadlineMonitor::cpu_now() - cpu});
    monitor.refresh_events();
  }
}

double stolen_now() {
  // "cpu  user nice system idle iowait irq softirq steal ...", in ticks of the system.
  std::ifstream stat("/proc/stat");
  std::string label;
  double ticks = 0.0;
  stat >> label;
  for (int field = 0; field < 8; ++field) stat >> ticks;
  const long per_second = sysconf(_SC_CLK_TCK);
  return stat && label == "cpu" && per_second > 0 ? ticks / static_cast<double>(per_second) : 0.0;
}

}  // namespace cli
