// Steps a scene in real time, alternating with a bare sleep loop: `bristle run --realtime`.
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
  std::optional<double> rate_hz;  ///< Hz, rate of ticks; none: one over the scene's dt
  double busy_wait_s = 0.0;
  double bare_share = 1.0;  ///< ticks of the bare sleep loop per tick of ours, above 0 and at most 1
  RealtimeThreadOptions thread;
  std::string histograms;  ///< CSV file; empty: none
};

/// Times of a loop over all its segments.
struct PacedLoopResult {
  bristle::DeadlineMonitor monitor;
  double seconds = 0.0;
  double stolen_s = 0.0;        ///< s, taken by the hypervisor over all cores, in steps of 10 ms
  double stolen_worst_s = 0.0;  ///< s, taken in the segment of the worst tick
  double queued_worst_s = 0.0;  ///< s, in which the thread was ready but had no core, from the tick before
                                ///< the worst one to its end
};

struct RealtimeResult {
  double scene_dt = 0.0;  ///< s, dt in the scene file
  double period = 0.0;    ///< s, dt of every step
  double busy_wait = 0.0;
  std::optional<int> fifo, core;  ///< real-time priority and core that the system granted
  bool locked_memory = false;
  std::vector<std::string> refused;
  PacedLoopResult ours, bare;
  std::uint64_t held_up = 0;  ///< ticks left out because of the tool's own accounting
  bool stopped = false;       ///< whether a signal stopped the run
};

/// Clock of the time for which this thread was ready to run while its core did something else, as Linux
/// reports it: the effect of a busy machine. Make and read it on one thread; a read is a system call of about
/// a microsecond.
class QueueClock {
 public:
  QueueClock() noexcept;
  ~QueueClock();
  QueueClock(const QueueClock&) = delete;
  QueueClock& operator=(const QueueClock&) = delete;

  double now() const noexcept;  ///< s since the thread was made; 0 if the system does not tell

 private:
  int file_;
};

/// Returns results of loops that have not run yet, with the rights that the thread was granted.
RealtimeResult start_realtime(const RealtimeOptions& options, double period_s, double deadline_s,
                              const RealtimeThread& thread);

/// Runs `segment` of a loop; adds its wall time, and the time stolen by the hypervisor.
template <class Segment>
void run_segment(PacedLoopResult& loop, Segment&& segment);

/// Runs ticks in which nothing is done: their delays are the machine's.
void run_bare_segment(PacedLoopResult& loop, std::uint64_t ticks, PacedClock& clock, const QueueClock& queue);

/// Records a tick, and its queueing time if it is the worst so far.
void record_tick(PacedLoopResult& loop, const bristle::Tick& tick, const QueueClock& queue, double& queued_s);

/// Returns the CPU time (s) that the hypervisor has taken from all cores since the system started; 0 if the
/// system does not report it.
double stolen_now();

/// Says what delayed the worst tick of a loop, as far as the system reports it.
std::string worst_tick_text(const PacedLoopResult& loop, int threads);

std::string realtime_table(const RealtimeResult& result, int threads);
nlohmann::ordered_json to_json(const RealtimeResult& result, int threads);
/// Returns CSV `loop,histogram,low_us,high_us,count` of every bucket that is not empty.
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
