#include "bristle/deadline_monitor.hpp"

#include <cmath>

#include "core/runtime/platform/platform.hpp"

namespace bristle {

ThreadEvents ThreadEvents::now() noexcept { return detail::thread_events(); }

ThreadEvents DeadlineMonitor::SharedEvents::get() const noexcept {
  return {involuntary_switches.get(), other_switches.get(), minor_faults.get(), major_faults.get()};
}

void DeadlineMonitor::SharedEvents::set(const ThreadEvents& events) noexcept {
  involuntary_switches.set(events.involuntary_switches);
  other_switches.set(events.other_switches);
  minor_faults.set(events.minor_faults);
  major_faults.set(events.major_faults);
}

DeadlineMonitor::DeadlineMonitor(double deadline_s, double period_s) noexcept {
  numbers_.deadline_s = deadline_s;
  numbers_.period_s = period_s;
}

namespace {

/// Marks a change of the monitor's numbers by a sequence count: it is odd during the change, and a reader
/// that finds it odd or changed copies again, so the writer never waits. Uses no fences, which the thread
/// sanitizer does not support. Every number is stored with release and read with acquire, so a reader that
/// sees a number of a new tick also finds the count odd or increased.
class Change {
 public:
  explicit Change(detail::SharedNumber<std::uint64_t>& changes) noexcept : changes_(changes) {
    changes_.add(1);
  }
  ~Change() { changes_.add(1); }
  Change(const Change&) = delete;
  Change& operator=(const Change&) = delete;

 private:
  detail::SharedNumber<std::uint64_t>& changes_;
};

}  // namespace

DeadlineMonitor& DeadlineMonitor::operator=(const DeadlineMonitor& other) noexcept {
  const Change change(changes_);
  numbers_ = other.numbers_;
  return *this;
}

bool DeadlineMonitor::snapshot(DeadlineMonitor& to) const noexcept {
  constexpr double longest_wait_s = 0.01;
  for (int copies = 0; copies < 1000; ++copies) {
    std::uint64_t before = changes_.get();
    if (before % 2 != 0) {
      const double start = wall_now();
      while ((before = changes_.get()) % 2 != 0)
        if (wall_now() - start > longest_wait_s) return false;
    }
    to = *this;
    if (changes_.get() == before) return true;
  }
  return false;
}

void DeadlineMonitor::record(double wall_s, double cpu_s) noexcept {
  const Step step = judge(0.0, wall_s, cpu_s);
  const Change change(changes_);
  keep(step);
}

void DeadlineMonitor::record_tick(const Tick& tick) noexcept {
  const Step step = judge(tick.start_s - tick.due_s, tick.end_s - tick.start_s, tick.cpu_s);
  const Change change(changes_);
  Numbers& n = numbers_;
  const double last = n.last_start_s.get(), period = n.period_s.get();
  if (last >= 0.0 && period > 0.0) n.jitter.record(std::fabs(tick.start_s - last - period));
  n.last_start_s = tick.start_s;
  keep(step);
}

/// Compares a step with its deadline, and reads the thread's counters if needed. Called before a Change
/// begins, so that a Change lasts only a few nanoseconds and readers seldom copy again.
DeadlineMonitor::Step DeadlineMonitor::judge(double started_late_s, double wall_s,
                                             double cpu_s) const noexcept {
  Step step;
  if (started_late_s >= 0.0) step.started_late_s = started_late_s;
  if (wall_s >= 0.0) step.wall_s = wall_s;  // keeps 0 for a clock that went back or gave NaN
  step.cpu_s = cpu_s;
  step.end_s = step.started_late_s + step.wall_s;
  step.late = step.end_s > numbers_.deadline_s.get();
  step.reads_events = step.late || !numbers_.events_known.get();
  if (step.reads_events) step.events = ThreadEvents::now();
  return step;
}

void DeadlineMonitor::keep(const Step& step) noexcept {
  Numbers& n = numbers_;
  ThreadEvents events;
  if (step.reads_events) events = events_until(step.events);
  if (step.late) {
    n.misses.add(1);
    if (!(step.cpu_s >= 0.0) || step.cpu_s > n.deadline_s.get()) n.misses_ours.add(1);
    count_missed(1);
    n.late_events.set(n.late_events.get() + events);
  } else {
    n.run = 0;
    events = {};
  }
  const std::uint64_t number = n.steps.count();
  if (number == 0 || step.end_s > n.worst_end_s.get()) {
    n.worst_number = number;
    n.worst_end_s = step.end_s;
    n.worst_started_s = step.started_late_s;
    n.worst_step_s = step.wall_s;
    n.worst_cpu_s = step.cpu_s;
    n.worst_late = step.late;
    n.worst_events.set(events);
  }
  n.steps.record(step.wall_s);
}

/// Returns the system's events between the previous call and `now`; none in the first call.
ThreadEvents DeadlineMonitor::events_until(const ThreadEvents& now) noexcept {
  Numbers& n = numbers_;
  const ThreadEvents since = n.events_known.get() ? now - n.last_events.get() : ThreadEvents{};
  n.last_events.set(now);
  n.events_known = true;
  return since;
}

void DeadlineMonitor::count_missed(std::uint64_t ticks) noexcept {
  Numbers& n = numbers_;
  n.run.add(ticks);
  if (n.run.get() > n.longest_run.get()) n.longest_run = n.run.get();
}

void DeadlineMonitor::record_skipped(std::uint64_t ticks) noexcept {
  const Change change(changes_);
  numbers_.skipped.add(ticks);
  count_missed(ticks);
}

void DeadlineMonitor::pause() noexcept {
  const Change change(changes_);
  numbers_.last_start_s = -1.0;
  numbers_.run = 0;
}

void DeadlineMonitor::refresh_events() noexcept {
  const ThreadEvents now = ThreadEvents::now();
  const Change change(changes_);
  events_until(now);
}

void DeadlineMonitor::reset() noexcept { *this = DeadlineMonitor(deadline(), period()); }

std::uint64_t DeadlineMonitor::misses_machine() const noexcept {
  // Reads misses_ours() before misses(), so that a tick recorded between the two cannot make the difference
  // negative. (A reset can.)
  const std::uint64_t ours = misses_ours(), all = misses();
  return all > ours ? all - ours : 0;
}

DeadlineMonitor::WorstTick DeadlineMonitor::worst() const noexcept {
  const Numbers& n = numbers_;
  WorstTick worst;
  worst.number = n.worst_number.get();
  worst.end_after_due = n.worst_end_s.get();
  worst.started_late = n.worst_started_s.get();
  worst.step = n.worst_step_s.get();
  worst.cpu = n.worst_cpu_s.get();
  worst.late = n.worst_late.get();
  worst.events = n.worst_events.get();
  return worst;
}

double DeadlineMonitor::wall_now() noexcept { return detail::monotonic_seconds(); }

double DeadlineMonitor::cpu_now() noexcept { return detail::thread_seconds(); }

}  // namespace bristle
