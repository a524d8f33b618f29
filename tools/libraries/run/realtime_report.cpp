// Writes the report of `bristle run --realtime`: times of the loop that steps the scene and of the bare loop
// that only sleeps.
#include <iterator>

#include <fmt/format.h>

#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/table.hpp"
#include "tools/libraries/run/realtime.hpp"

namespace cli {
namespace {

using bristle::DeadlineMonitor;
using bristle::TimeHistogram;
using Json = nlohmann::ordered_json;

std::string times_text(std::uint64_t count) {
  return count == 1 ? "once" : fmt::format("{} times", count_text(count));
}

std::vector<Cell> times_row(const char* name, const TimeHistogram& histogram) {
  std::vector<Cell> row = {name};
  if (histogram.count() == 0) {
    row.insert(row.end(), 4, "-");
    return row;
  }
  for (double share : {0.5, 0.99, 0.999}) row.push_back(time_text(histogram.percentile(share)));
  row.push_back(time_text(histogram.max()));
  return row;
}

std::vector<Cell> lateness_row(const char* name, const PacedLoopResult& loop) {
  const DeadlineMonitor& m = loop.monitor;
  std::vector<Cell> row = {name};
  for (std::uint64_t count : {m.count(), m.misses_ours(), m.misses_machine(), m.skipped(), m.longest_run()})
    row.push_back(count_text(count));
  row.push_back(loop.stolen_s > 0.0 ? time_text(loop.stolen_s) : "0");
  return row;
}

Json times_json(const TimeHistogram& histogram) {
  const auto measured = [&](double seconds) { return histogram.count() > 0 ? Json(seconds) : Json(); };
  return {{"p50_s", measured(histogram.percentile(0.5))},
          {"p99_s", measured(histogram.percentile(0.99))},
          {"p999_s", measured(histogram.percentile(0.999))},
          {"max_s", measured(histogram.max())},
          {"mean_s", measured(histogram.mean())}};
}

Json events_json(const bristle::ThreadEvents& events) {
  return {{"involuntary_switches", events.involuntary_switches},
          {"switches_of_other_threads", events.other_switches},
          {"minor_faults", events.minor_faults},
          {"major_faults", events.major_faults}};
}

Json loop_json(const PacedLoopResult& loop, int threads) {
  const DeadlineMonitor& m = loop.monitor;
  const DeadlineMonitor::WorstTick worst = m.worst();
  return {{"ticks", m.count()},
          {"wall_s", loop.seconds},
          {"step_time", times_json(m.step_times())},
          {"period_jitter", times_json(m.period_jitter())},
          {"misses", m.misses()},
          {"misses_ours", m.misses_ours()},
          {"misses_machine", m.misses_machine()},
          {"skipped", m.skipped()},
          {"longest_run", m.longest_run()},
          {"late_events", events_json(m.late_events())},
          {"stolen_s", loop.stolen_s},
          {"worst_tick",
           {{"number", worst.number},
            {"end_after_due_s", worst.end_after_due},
            {"started_late_s", worst.started_late},
            {"step_s", worst.step},
            {"cpu_s", worst.cpu},
            {"late", worst.late},
            {"events", events_json(worst.events)},
            {"queued_s", loop.queued_worst_s},
            {"stolen_in_its_segment_s", loop.stolen_worst_s},
            {"cause", worst_tick_text(loop, threads)}}}};
}

void add_buckets(std::string& csv, const char* loop, const char* name, const TimeHistogram& histogram) {
  for (int b = 0; b < TimeHistogram::buckets; ++b) {
    const TimeHistogram::Bucket bucket = histogram.bucket(b);
    if (bucket.count == 0) continue;
    fmt::format_to(std::back_inserter(csv), "{},{},{:.9g},{:.9g},{}\n", loop, name, 1e6 * bucket.low_s,
                   1e6 * bucket.high_s, bucket.count);
  }
}

}  // namespace

std::string worst_tick_text(const PacedLoopResult& loop, int threads) {
  const DeadlineMonitor& m = loop.monitor;
  const DeadlineMonitor::WorstTick worst = m.worst();
  if (m.count() == 0) return "no tick";
  std::string text = fmt::format("tick {} ended {} after it was due: started {} late, step {}, CPU time {}",
                                 count_text(worst.number), time_text(worst.end_after_due),
                                 time_text(worst.started_late), time_text(worst.step), time_text(worst.cpu));
  if (!worst.late) return text + "; in time";
  std::vector<std::string> causes;
  const bool long_step = worst.step > m.deadline();
  if (worst.cpu > m.deadline()) {
    causes.push_back("this program: the step used more CPU time than the deadline");
  } else if (!long_step && worst.started_late > worst.step) {
    causes.push_back("the machine: woken late");
  } else {
    causes.push_back(fmt::format("the machine: off the CPU or waiting for {}",
                                 time_text(worst.step > worst.cpu ? worst.step - worst.cpu : 0.0)));
  }
  // Names waiting for a core as a cause of the worst tick if it took more than a tenth of the time from when
  // the tick was due to its end.
  if (loop.queued_worst_s > 0.1 * worst.end_after_due)
    causes.push_back(fmt::format("ready for {} while others had the core", time_text(loop.queued_worst_s)));
  if (worst.events.involuntary_switches > 0)
    causes.push_back("preempted " + times_text(worst.events.involuntary_switches));
  if (threads > 1 && worst.events.other_switches > 0)
    causes.push_back("workers preempted " + times_text(worst.events.other_switches));
  if (worst.events.minor_faults + worst.events.major_faults > 0)
    causes.push_back(fmt::format("page faults: {}, {} of them from disk",
                                 count_text(worst.events.minor_faults + worst.events.major_faults),
                                 count_text(worst.events.major_faults)));
  if (loop.stolen_worst_s > 0.0)
    causes.push_back(fmt::format("the hypervisor took {} in that segment", time_text(loop.stolen_worst_s)));
  if (causes.size() == 1 && worst.cpu <= m.deadline())
    causes.push_back(
        "no wait for a core, preemption, page fault or steal was counted: an interrupt, or a host that does "
        "not report");
  for (std::size_t i = 0; i < causes.size(); ++i) text += (i == 0 ? "; " : ", ") + causes[i];
  return text;
}

std::string realtime_table(const RealtimeResult& r, int threads) {
  std::string text = fmt::format(
      "{:<12}{:g} Hz, dt {}{}", "pacing", 1.0 / r.period, time_text(r.period),
      r.scene_dt == r.period ? "" : fmt::format(" in place of the scene's {}", time_text(r.scene_dt)));
  if (r.busy_wait > 0.0) text += fmt::format(", busy wait from {} before", time_text(r.busy_wait));
  if (r.fifo) text += fmt::format(", SCHED_FIFO {}", *r.fifo);
  if (r.core) text += fmt::format(", on core {}", *r.core);
  if (r.locked_memory) text += ", memory locked";
  text += '\n';
  for (const std::string& line : r.refused) text += fmt::format("{:<12}{}\n", "refused", line);
  if (r.stopped) text += fmt::format("{:<12}by a signal, before the end of the scene\n", "stopped");
  if (r.held_up > 0)
    text += fmt::format(
        "{:<12}{} ticks, because writing and counting between ticks took too long: give fewer "
        "patches, no --out, or a lower --rate\n",
        "left out", count_text(r.held_up));
  Table lateness({"<loop, alternating", "ticks", "late by program", "by machine", "skipped", "longest run",
                  "stolen by host"});
  lateness.add(lateness_row("bristle", r.ours));
  lateness.add(lateness_row("bare sleep", r.bare));
  Table times({"<time", "p50", "p99", "p99.9", "max"});
  times.add(times_row("step of bristle", r.ours.monitor.step_times()));
  times.add(times_row("jitter of bristle", r.ours.monitor.period_jitter()));
  times.add(times_row("jitter of bare sleep", r.bare.monitor.period_jitter()));
  text += '\n' + lateness.text() + '\n' + times.text();
  text += fmt::format("worst of bristle     {}\n", worst_tick_text(r.ours, threads));
  text += fmt::format("worst of bare sleep  {}\n", worst_tick_text(r.bare, 1));
  return text;
}

Json to_json(const RealtimeResult& r, int threads) {
  const auto granted = [](const std::optional<int>& value) { return value ? Json(*value) : Json(nullptr); };
  return {{"rate_hz", 1.0 / r.period},
          {"period_s", r.period},
          {"scene_dt", r.scene_dt},
          {"busy_wait_s", r.busy_wait},
          {"fifo_priority", granted(r.fifo)},
          {"core", granted(r.core)},
          {"locked_memory", r.locked_memory},
          {"refused", r.refused},
          {"stopped", r.stopped},
          {"held_up", r.held_up},
          {"bristle", loop_json(r.ours, threads)},
          {"bare_sleep", loop_json(r.bare, 1)}};
}

std::string histogram_csv(const RealtimeResult& r) {
  std::string csv = "loop,histogram,low_us,high_us,count\n";
  const struct {
    const char* name;
    const PacedLoopResult& loop;
  } loops[] = {{"bristle", r.ours}, {"bare sleep", r.bare}};
  for (const auto& [name, loop] : loops) {
    add_buckets(csv, name, "step", loop.monitor.step_times());
    add_buckets(csv, name, "jitter", loop.monitor.period_jitter());
  }
  return csv;
}

}  // namespace cli
