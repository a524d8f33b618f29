// Steps a scene in real time, alternately with a loop that only sleeps (the bare loop): `bristle run
// --realtime`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <bristle/deadline_monitor.hpp>

#include "tools/platform/platform.hpp"
#include "tools/run/paced_clock.hpp"
#include "tools/run/realtime_thread.hpp"

namespace cli {

struct RealtimeOptions {
  std::optional<double> rate_hz;  ///< Hz, rate of steps; none: one over the scene's dt
  double busy_wait_s = 0.0;
  double bare_share = 1.0;  ///< number of the bare loop's ticks per tick of ours, in (0, 1]
  RealtimeThreadOptions thread;
  std::string histograms;  ///< CSV file for histograms; empty: none
};

/// Times of one of the two loops, over all its turns.
struct PacedLoopResult {
  bristle::DeadlineMonitor monitor;
  double seconds = 0.0;
  double stolen_s = 0.0;        ///< s, time that the hypervisor took from all cores, counted in steps of
                                ///< 10 ms
  double stolen_worst_s = 0.0;  ///< s, time that the hypervisor took during the turn with the worst tick
  double queued_worst_s = 0.0;  ///< s, time that the thread waited for a core, from the tick before the worst
                                ///< one to the worst one's end
};

struct RealtimeResult {
  double scene_dt = 0.0;  ///< s, time step in the scene file
  double period = 0.0;    ///< s, time step used, in every step
  double busy_wait = 0.0;
  std::optional<int> fifo, core;  ///< real-time priority and core that the system granted
  bool locked_memory = false;
  std::vector<std::string> refused;
  PacedLoopResult ours, bare;
  std::uint64_t held_up = 0;  ///< number of ticks skipped because this program's own accounting took too long
  bool stopped = false;       ///< whether a signal ended the run early
};

using platform::QueueClock;
using platform::stolen_now;

/// Returns a result with empty times of both loops, and what the system granted the thread.
RealtimeResult start_realtime(const RealtimeOptions& options, double period_s, double deadline_s,
                              const RealtimeThread& thread);

/// Runs one turn (`segment`) of a loop. Adds its wall time to the result, and the time that the hypervisor
/// stole meanwhile.
template <class Segment>
void run_segment(PacedLoopResult& loop, Segment&& segment);

/// Runs ticks of the bare loop, in which nothing is done, so that its delays are those of the machine.
void run_bare_segment(PacedLoopResult& loop, std::uint64_t ticks, PacedClock& clock, const QueueClock& queue);

/// Records a tick, and how long it waited for a core if it is the worst tick so far.
void record_tick(PacedLoopResult& loop, const bristle::Tick& tick, const QueueClock& queue, double& queued_s);

/// Returns a text on what delayed the worst tick of a loop, as far as the system reports it.
std::string worst_tick_text(const PacedLoopResult& loop, int threads);

std::string realtime_table(const RealtimeResult& result, int threads);
nlohmann::ordered_json to_json(const RealtimeResult& result, int threads);
/// Returns the histograms as CSV `loop,histogram,low_us,high_us,count`, with a row for every bucket that is
/// not empty.
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
