// Steps a scene in real time, `bristle run --realtime`, alternately with a bare loop that only sleeps. Delays
// of the bare loop are the machine's, and the delays of the stepping loop are judged by them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/platform/platform.hpp"
#include "tools/libraries/platform/realtime_thread.hpp"
#include "tools/libraries/run/paced_clock.hpp"

namespace cli {

struct RealtimeOptions {
  std::optional<double> rate_hz;  ///< rate of steps, Hz; none: 1 over the scene's time step
  double busy_wait_s = 0.0;
  double bare_share = 1.0;  ///< ticks of the bare loop per tick of the stepping loop, in (0, 1]
  RealtimeThreadOptions thread;
  std::string histograms;  ///< CSV file to write histograms of times to; empty: none
};

/// Measured times of one of the two loops (stepping or bare), over all its turns.
struct PacedLoopResult {
  bristle::DeadlineMonitor monitor;
  double seconds = 0.0;
  /// Time that a hypervisor took from all cores, s. The system counts it in steps of 10 ms.
  double stolen_s = 0.0;
  double stolen_worst_s = 0.0;  ///< time that a hypervisor took in the turn with the worst tick, s
  /// Time, s, for which the thread was ready but waited for a core, from the tick before the worst one to the
  /// end of the worst. It tells whether other programs caused the delay.
  double queued_worst_s = 0.0;
};

struct RealtimeResult {
  double scene_dt = 0.0;  ///< time step in the scene file, s
  double period = 0.0;    ///< time step and period of the run, s
  double busy_wait = 0.0;
  std::optional<int> fifo, core;  ///< real-time priority and core, if granted by the system
  bool locked_memory = false;
  std::vector<std::string> refused;
  PacedLoopResult ours, bare;
  std::uint64_t held_up = 0;  ///< number of ticks skipped for this program's bookkeeping, not for steps
  bool stopped = false;       ///< whether a signal (Ctrl-C) ended the run early
};

using platform::QueueClock;
using platform::stolen_now;

/// Returns a result without any times, which says what the system granted the thread. The turns of the loops
/// add their times.
RealtimeResult start_realtime(const RealtimeOptions& options, double period_s, double deadline_s,
                              const RealtimeThread& thread);

/// Runs one turn (`segment`) of the stepping or the bare loop. Adds its wall time, and the time that a
/// hypervisor took in it, to the loop's result.
template <class Segment>
void run_segment(PacedLoopResult& loop, Segment&& segment);

/// Runs `ticks` ticks of the bare loop, which only sleeps from tick to tick.
void run_bare_segment(PacedLoopResult& loop, std::uint64_t ticks, PacedClock& clock, const QueueClock& queue);

/// Records the times of a tick and, if it is the worst so far, how long it waited for a core.
void record_tick(PacedLoopResult& loop, const bristle::Tick& tick, const QueueClock& queue, double& queued_s);

/// Returns a text that says what delayed the worst tick of a loop, as far as the system reports it.
std::string worst_tick_text(const PacedLoopResult& loop, int threads);

std::string realtime_table(const RealtimeResult& result, int threads);
nlohmann::ordered_json to_json(const RealtimeResult& result, int threads);
/// Returns the histograms of times of both loops as CSV `loop,histogram,low_us,high_us,count`, without empty
/// buckets.
std::string histogram_csv(const RealtimeResult& result);

template <class Segment>
void run_segment(PacedLoopResult& loop, Segment&& segment) {
  const std::uint64_t ticks_before = loop.monitor.count();
  const double start = bristle::DeadlineMonitor::wall_now(), stolen = stolen_now();
  segment();
  const double stolen_here = stolen_now() - stolen;
  loop.seconds += bristle::DeadlineMonitor::wall_now() - start;
  loop.stolen_s += stolen_here;
  if (loop.monitor.count() > ticks_before && loop.monitor.worst().number >= ticks_before)
    loop.stolen_worst_s = stolen_here;
}

}  // namespace cli
