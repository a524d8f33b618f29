// `bristle run --realtime`: steps a scene against the clock, alternating with a bare sleep loop.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <bristle/deadline_monitor.hpp>

#include "tools/run/paced_clock.hpp"
#include "tools/run/realtime_thread.hpp"

namespace cli {

struct RealtimeOptions {
  std::optional<double> rate_hz;  ///< ticks per second; none: one over the scene's dt
  double busy_wait_s = 0.0;
  double bare_share = 1.0;  ///< ticks of the bare sleep loop for each of ours, above 0 and at most 1
  RealtimeThreadOptions thread;
  std::string histograms;  ///< CSV file; empty: none
};

/// A loop over all its segments.
struct PacedLoopResult {
  bristle::DeadlineMonitor monitor;
  double seconds = 0.0;
  double stolen_s = 0.0;        ///< taken by the hypervisor, over all cores, in steps of 10 ms
  double stolen_worst_s = 0.0;  ///< in the segment of the worst tick
  double queued_worst_s =
      0.0;  ///< from the tick before to the end of the worst one, ready but without a core
};

struct RealtimeResult {
  double scene_dt = 0.0;  ///< s, what the file says
  double period = 0.0;    ///< s, the dt of every step
  double busy_wait = 0.0;
  std::optional<int> fifo, core;  ///< as granted
  bool locked_memory = false;
  std::vector<std::string> refused;
  PacedLoopResult ours, bare;
  std::uint64_t held_up = 0;  ///< ticks left out because of the tool's own accounts
  bool stopped = false;       ///< by a signal
};

/// Time for which this thread was ready to run while its core did something else, as Linux reports it: what a
/// busy machine costs. To be made and read on one thread; a read is a system call of about a microsecond.
class QueueClock {
 public:
  QueueClock() noexcept;
  ~QueueClock();
  QueueClock(const QueueClock&) = delete;
  QueueClock& operator=(const QueueClock&) = delete;

  double now() const noexcept;  ///< s since the thread was made; 0 where the system does not tell

 private:
  int file_;
};

/// Loops that have not run yet, with what the thread was granted.
RealtimeResult start_realtime(const RealtimeOptions& options, double period_s, double deadline_s,
                              const RealtimeThread& thread);

/// Runs `segment` of a loop and counts its wall time and what was stolen meanwhile.
template <class Segment>
void run_segment(PacedLoopResult& loop, Segment&& segment);

/// Ticks in which nothing is done: what the machine does to any loop.
void run_bare_segment(PacedLoopResult& loop, std::uint64_t ticks, PacedClock& clock, const QueueClock& queue);

/// Records a tick, and how long it was queued if it is the worst so far.
void record_tick(PacedLoopResult& loop, const bristle::Tick& tick, const QueueClock& queue, double& queued_s);

/// CPU time that the hypervisor has taken from all cores since the system started, s; 0 where the system does
/// not report it.
double stolen_now();

/// Says what delayed the worst tick of a loop, as far as the system reports it.
std::string worst_tick_text(const PacedLoopResult& loop, int threads);

std::string realtime_table(const RealtimeResult& result, int threads);
nlohmann::ordered_json to_json(const RealtimeResult& result, int threads);
/// `loop,histogram,low_us,high_us,count`: every bucket that holds something.
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
