// Step times and periods of a loop, compared with its deadline, in constant memory.
#pragma once

#include <cstdint>

#include "bristle/export.hpp"
#include "bristle/time_histogram.hpp"

namespace bristle {

/// Events that the system has counted for the calling thread so far; the difference of two counts shows what
/// disturbed it. All zero on systems that do not count (other than Linux).
struct BRISTLE_API ThreadEvents {
  /// Number of times that the system took the thread off its core to run another.
  std::uint64_t involuntary_switches = 0;
  /// Number of times that other threads of the process, such as workers, were taken off their cores.
  std::uint64_t other_switches = 0;
  std::uint64_t minor_faults = 0;  ///< number of first accesses to pages already in memory
  std::uint64_t major_faults = 0;  ///< number of accesses to pages that had to be read from disk

  /// Returns the present counts. Makes two system calls, about a microsecond: call it between ticks, not in a
  /// step.
  static ThreadEvents now() noexcept;
  friend ThreadEvents operator+(const ThreadEvents& a, const ThreadEvents& b) noexcept {
    return {a.involuntary_switches + b.involuntary_switches, a.other_switches + b.other_switches,
            a.minor_faults + b.minor_faults, a.major_faults + b.major_faults};
  }
  /// Returns the number of events between two counts. Where a count fell it returns 0: `other_switches` is
  /// the difference of two counters that are read one after the other.
  friend ThreadEvents operator-(const ThreadEvents& a, const ThreadEvents& b) noexcept {
    const auto since = [](std::uint64_t x, std::uint64_t y) { return x > y ? x - y : 0; };
    return {since(a.involuntary_switches, b.involuntary_switches), since(a.other_switches, b.other_switches),
            since(a.minor_faults, b.minor_faults), since(a.major_faults, b.major_faults)};
  }
};

/// One turn of a periodic loop: when it was due, started and ended, in s of DeadlineMonitor::wall_now.
struct Tick {
  double due_s = 0.0;    ///< time at which the step should have started, by the time grid
  double start_s = 0.0;  ///< time at which the step started
  double end_s = 0.0;    ///< time at which the step ended
  double cpu_s = -1.0;   ///< CPU time of the stepping thread in the tick, s; negative: not measured
};

/// Percentiles of step time, deadline misses by cause, and jitter of the period.
///
/// A tick misses its deadline (is late) if its step ends more than the deadline after it was due. The miss is
/// caused by this program ("ours") if the thread's CPU time in the tick exceeds the deadline or was not
/// measured. Other misses are caused by the machine: the thread was woken late, was preempted, or waited for
/// a worker that was. Two kinds of time count as CPU time, and so as ours, all the same: spinning while the
/// thread waits for a worker, and time that a hypervisor takes without reporting it.
///
/// Thread rule: one thread records and resets, and never waits for a reader. Any thread may read at the same
/// time: each number is whole, but two numbers may be some ticks apart. snapshot() gives all numbers of one
/// moment. 19 kB; no allocation, no lock.
class BRISTLE_API DeadlineMonitor {
 public:
  /// Makes a monitor for this deadline of a tick and nominal period, s. A period of 0 means that ticks have
  /// no period.
  explicit DeadlineMonitor(double deadline_s = 1e-3, double period_s = 0.0) noexcept;
  /// Copies the numbers. Copy only on the thread that records into `other`, or while no thread does. Assign
  /// only on the thread that records here; snapshot() on other threads gives the numbers from before or after
  /// the assignment.
  DeadlineMonitor(const DeadlineMonitor& other) noexcept : numbers_(other.numbers_) {}
  DeadlineMonitor& operator=(const DeadlineMonitor& other) noexcept;
  ~DeadlineMonitor() = default;

  /// Records one step that was due when it started: wall time and CPU time of the stepping thread, s. A
  /// negative cpu_s means that CPU time was not measured; a miss then counts as this program's.
  void record(double wall_s, double cpu_s = -1.0) noexcept;
  /// Records one tick of a loop with a period. Makes a system call (ThreadEvents) only if the tick was late
  /// or the first.
  void record_tick(const Tick& tick) noexcept;
  /// Records ticks that the loop skipped to catch up with its period. They count in the longest run of
  /// misses.
  void record_skipped(std::uint64_t ticks) noexcept;
  /// Records a pause of the loop: the next tick starts a new grid, and the time until it does not count as a
  /// period.
  void pause() noexcept;
  /// Reads ThreadEvents, so that the events of a late tick are counted from this call and not from the last
  /// late tick. For loops that have a microsecond to spare between ticks; call it on the stepping thread.
  void refresh_events() noexcept;
  void reset() noexcept;

  /// Copies all numbers of one moment between two ticks; any thread may call it. The copy takes some
  /// microseconds, waits while a tick is being recorded, and is repeated if one was recorded meanwhile.
  /// Returns false, with no meaning in `to`, after 1000 copies (a loop that leaves no such gap) or 10 ms of
  /// waiting (the recording thread was taken off its core just then).
  bool snapshot(DeadlineMonitor& to) const noexcept;

  double deadline() const noexcept { return numbers_.deadline_s.get(); }
  double period() const noexcept { return numbers_.period_s.get(); }
  std::uint64_t count() const noexcept { return numbers_.steps.count(); }
  /// Returns the step time, s, that the share `share` of the steps (0 to 1, for instance 0.999) does not
  /// exceed.
  double percentile(double share) const noexcept { return numbers_.steps.percentile(share); }
  double p50() const noexcept { return percentile(0.5); }
  double p99() const noexcept { return percentile(0.99); }
  double p999() const noexcept { return percentile(0.999); }
  double max() const noexcept { return numbers_.steps.max(); }  ///< longest step, s, exact
  double mean() const noexcept { return numbers_.steps.mean(); }

  /// Returns the number of ticks that missed the deadline.
  std::uint64_t misses() const noexcept { return numbers_.misses.get(); }
  /// Returns the number of misses caused by this program.
  std::uint64_t misses_ours() const noexcept { return numbers_.misses_ours.get(); }
  /// Returns the number of misses that the machine caused: the thread was woken late, was preempted, or
  /// waited for a worker that was.
  std::uint64_t misses_machine() const noexcept;
  std::uint64_t skipped() const noexcept { return numbers_.skipped.get(); }
  /// Returns the most ticks in a row that were late or skipped.
  std::uint64_t longest_run() const noexcept { return numbers_.longest_run.get(); }
  /// Returns the system's events during late ticks, summed, each counted from the last refresh_events or late
  /// tick before it. They show what made ticks late.
  ThreadEvents late_events() const noexcept { return numbers_.late_events.get(); }

  const TimeHistogram& step_times() const noexcept { return numbers_.steps; }
  /// Returns the jitter, |time from start to start - period|, s. Periods over skipped ticks are included,
  /// pauses are not.
  const TimeHistogram& period_jitter() const noexcept { return numbers_.jitter; }

  /// The tick that ended the longest after it was due, for a report.
  struct WorstTick {
    std::uint64_t number = 0;    ///< number of the tick, counted from 0
    double end_after_due = 0.0;  ///< time from when the tick was due to its end, s
    double started_late = 0.0;   ///< time from when the tick was due to the start of its step, s
    double step = 0.0;           ///< wall time of the step, s
    double cpu = -1.0;           ///< CPU time of the step, s; negative: not measured
    bool late = false;
    ThreadEvents events;  ///< events of the tick if it was late, counted as in late_events
  };
  WorstTick worst() const noexcept;

  /// Returns the time to pass to record() and record_tick(), s: of the monotonic wall clock, or CPU time of
  /// the calling thread.
  static double wall_now() noexcept;
  static double cpu_now() noexcept;

 private:
  template <class T>
  using Shared = detail::SharedNumber<T>;
  struct SharedEvents {
    Shared<std::uint64_t> involuntary_switches, other_switches, minor_faults, major_faults;
    ThreadEvents get() const noexcept;
    void set(const ThreadEvents& events) noexcept;
  };
  struct Numbers {
    Shared<double> deadline_s, period_s;
    Shared<double> last_start_s = -1.0;  // negative: no tick since the start or a pause
    Shared<std::uint64_t> misses, misses_ours, skipped, run, longest_run;
    Shared<bool> events_known;
    SharedEvents late_events, last_events;
    Shared<std::uint64_t> worst_number;
    Shared<double> worst_end_s, worst_started_s, worst_step_s, worst_cpu_s = -1.0;
    Shared<bool> worst_late;
    SharedEvents worst_events;
    TimeHistogram steps, jitter;
  };
  struct Step {
    double started_late_s = 0.0, wall_s = 0.0, end_s = 0.0, cpu_s = -1.0;
    bool late = false, reads_events = false;
    ThreadEvents events;  // event counters after the step, if reads_events
  };
  Step judge(double started_late_s, double wall_s, double cpu_s) const noexcept;
  void keep(const Step& step) noexcept;
  ThreadEvents events_until(const ThreadEvents& now) noexcept;
  void count_missed(std::uint64_t ticks) noexcept;

  Shared<std::uint64_t> changes_;  // count of changes, odd while numbers are written
  Numbers numbers_;
};

}  // namespace bristle
