// Writes reports of `bristle capacity`: tables for people, JSON for programs, CSV for the plot.
#include <utility>

#include <fmt/format.h>

#include "tools/libraries/capacity/capacity.hpp"
#include "tools/libraries/capacity/subject.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/report_tables.hpp"

namespace cli {
namespace {

constexpr Regime regimes[] = {Regime::rest,    Regime::tremor,  Regime::presliding, Regime::one_snap,
                              Regime::sliding, Regime::turning, Regime::far};

const char* const note_on_p99 =
    "Steps run back to back on this machine as it is: preemption and other load count in p99. Where only p99 "
    "is late and the median well inside, a probe is tried up to four times, the confirming run twice.";

Json times_json(const StepTimes& t) {
  return {{"bristles", t.bristles},
          {"steps", t.steps},
          {"p50_s", t.p50_s},
          {"p99_s", t.p99_s},
          {"p999_s", t.p999_s},
          {"max_s", t.max_s},
          {"ns_per_bristle", t.bristles ? Json(t.ns_per_bristle()) : Json(nullptr)}};
}

/// Returns the JSON keys that describe how the infinite patches of a case slide.
Json motion_json(const CapacityCase& what) {
  return {{"motion", what.motion_name()},
          {"step_over_mean_snap_length", what.step_in_lengths()},
          {"turn_rad", what.turn},
          {"ripple", what.ripple}};
}

Json report_of(const CapacityOptions& options, const CapacityResult& result) {
  Json report = {{"schema", "bristle-capacity-1"}};
  report["conditions"] = to_json(conditions());
  report["conditions"]["isa"] = result.isa;
  report["state_hash"] = fmt::format("{:016x}", result.state_hash);
  report["deadline_s"] = options.deadline_s;
  report["dt_s"] = capacity_dt_s;
  report["mean_snap_length_m"] = mean_snap_length_m;
  report["snap_length"] =
      "uniform, 0.5 to 1.5 of the mean; of the default material lognormal, with residual and shared renewal";
  report["quick"] = options.quick;
  report["note"] = note_on_p99;
  report["motions"] = Json::array();
  for (const Regime regime : regimes) {
    const RegimeFacts& facts = facts_of(regime);
    report["motions"].push_back(
        {{"name", facts.name}, {"step_over_mean_snap_length", facts.step}, {"meaning", facts.meaning}});
  }
  report["paper"] = {{"bristles", 900}, {"deadline_s", 1e-3}, {"machine", "1 GHz Pentium III, 2004"}};
  report["targets"] = Json::array();
  for (const TargetRow& row : result.targets) {
    report["targets"].push_back({{"name", row.name},
                                 {"what", row.what},
                                 {"measured", row.measured.median},
                                 {"spread", {row.measured.low, row.measured.high}},
                                 {"limit", row.limit},
                                 {"at_least", row.at_least},
                                 {"unit", row.unit},
                                 {"met", row.met()},
                                 {"missed_by", row.missed_by()},
                                 {"bound", bound_of(row.name)}});
  }
  report["infinite"] = Json::array();
  for (const InfiniteRow& row : result.infinite) {
    Json entry = motion_json(row.what);
    entry.update({{"kernel", row.what.kernel_name()},
                  {"resolution", row.resolution},
                  {"patches", row.patches},
                  {"bytes_per_patch", row.bytes_per_patch},
                  {"ns_per_patch", row.ns_per_patch.median},
                  {"quartiles", {row.ns_per_patch.low, row.ns_per_patch.high}},
                  {"p99_s", row.p99_s}});
    report["infinite"].push_back(std::move(entry));
  }
  report["contacts"] = Json::array();
  for (const CapacityRow& row : result.contacts) {
    Json entry = motion_json(row.what);
    entry.update({{"resolution", row.what.resolution},
                  {"threads", row.what.threads},
                  {"bristles", row.unconfirmed ? 0 : row.fits.bristles},
                  {"unconfirmed", row.unconfirmed},
                  {"more_would_fit", row.capped},
                  {"at_capacity", times_json(row.fits)}});
    report["contacts"].push_back(std::move(entry));
  }
  report["snapshots"] = Json::array();
  for (const SnapshotRow& row : result.snapshots) {
    report["snapshots"].push_back({{"contact", row.what},
                                   {"memory_bytes", row.memory_bytes},
                                   {"state_bytes", row.state_bytes},
                                   {"batch_bytes", row.batch_bytes},
                                   {"save_s", 1e-9 * row.save_ns},
                                   {"restore_s", 1e-9 * row.restore_ns}});
  }
  report["comparisons"] = Json::array();
  for (const ComparisonRow& row : result.comparisons) {
    report["comparisons"].push_back({{"bristles", row.bristles},
                                     {"motion", row.regime},
                                     {"loop", row.what},
                                     {"ns_per_bristle", row.ns.median},
                                     {"time_over_bristle", row.ratio.median},
                                     {"quartiles", {row.ratio.low, row.ratio.high}}});
  }
  report["capacities"] = Json::array();
  for (const CapacityRow& row : result.rows) {
    Json curve = Json::array();
    for (const StepTimes& t : row.curve) curve.push_back(times_json(t));
    report["capacities"].push_back({{"motion", to_string(row.what.regime)},
                                    {"kernel", row.what.kernel_name()},
                                    {"layout", row.what.layout_name()},
                                    {"threads", row.what.threads},
                                    {"bristles", row.unconfirmed ? 0 : row.fits.bristles},
                                    {"unconfirmed", row.unconfirmed},
                                    {"more_would_fit", row.capped},
                                    {"at_capacity", times_json(row.fits)},
                                    {"in_cache", times_json(row.in_cache)},
                                    {"curve", curve}});
  }
  return report;
}

/// Returns a line for each missed target, which says by how much it is missed and what bounds the time.
std::string missed_lines(const std::vector<TargetRow>& targets) {
  std::string text;
  for (const TargetRow& row : targets) {
    if (row.met()) continue;
    text += fmt::format("  {}  {:.1f} %; {}\n", row.name, 100.0 * row.missed_by(), bound_of(row.name));
  }
  return text.empty() ? text : "Missed, by how much of the limit, and what bounds them:\n\n" + text + '\n';
}

}  // namespace

std::string capacity_table(const CapacityOptions& options, const CapacityResult& result) {
  const Json report = report_of(options, result);
  std::string text = capacity_answer(report);
  if (!text.empty()) text += '\n';
  text += fmt::format(
      "{}, state hash of a fixed scene {:016x}\ndeadline {}, dt {}, snap lengths uniform on 5 to 15 um "
      "(default material: lognormal), motion along (0.8, 0.6)\n",
      measured_with(conditions(), result.isa), result.state_hash, time_text(options.deadline_s),
      time_text(capacity_dt_s));
  for (const Regime regime : regimes)
    text += fmt::format("  {:<11} {}\n", facts_of(regime).name, facts_of(regime).meaning);
  text += '\n';
  if (!result.infinite.empty())
    text +=
        "Patches of infinitely many bristles of the default material, one thread: a step of each, alone (in "
        "cache), among a hundred and among ten thousand, and of all at p99.\n\n" +
        infinite_table(report).text() + '\n';
  if (!result.contacts.empty()) {
    text += fmt::format(
        "Contacts of infinitely many bristles that slide and whose step fits {} at p99. With {:g} pieces the "
        "rms error of the force is at most 1.1 % on these paths.\n\n",
        time_text(options.deadline_s), coarse_resolution);
    text += contacts_table(report).text() + '\n';
  }
  if (!result.snapshots.empty())
    text +=
        "Bytes of a contact and of its share in a saved state; time per contact to save and restore "
        "100.\n\n" +
        snapshots_table(report).text() + '\n';
  if (!result.targets.empty())
    text += "Targets. Medians; for p99 the best of three runs.\n\n" + targets_table(report).text() + '\n' +
            missed_lines(result.targets);
  if (result.rows.empty()) return text;
  if (!result.comparisons.empty()) {
    text +=
        "One thread beside plain loops, interleaved. The plain loops have every compiler flag turned on.\n\n";
    text += comparisons_table(report).text() + '\n';
  } else {
    text += "plain loops left out: built for another machine or without them\n\n";
  }
  text += fmt::format(
      "Bristles whose step fits {} at p99, confirmed by a run of its own. In cache: 14,400 bristles.\n\n",
      time_text(options.deadline_s));
  text += capacities_table(report).text();
  text += fmt::format("\n{}\n", note_on_p99);
  return text;
}

std::string capacity_json(const CapacityOptions& options, const CapacityResult& result) {
  return json_text(report_of(options, result));
}

std::string capacity_csv(const CapacityOptions& options, const CapacityResult& result) {
  Json points = Json::array();
  Json report = report_of(options, result);
  for (Json& row : report["capacities"]) {
    for (Json& point : row["curve"]) {
      for (const char* key : {"motion", "kernel", "layout", "threads"}) point[key] = row[key];
      point["deadline_s"] = options.deadline_s;
      points.push_back(std::move(point));
    }
  }
  static constexpr CsvColumn columns[] = {{"motion", "/motion"},
                                          {"kernel", "/kernel"},
                                          {"layout", "/layout"},
                                          {"threads", "/threads"},
                                          {"bristles", "/bristles"},
                                          {"p50_us", "/p50_s", 1e6},
                                          {"p99_us", "/p99_s", 1e6},
                                          {"max_us", "/max_s", 1e6},
                                          {"ns_per_bristle", "/ns_per_bristle"},
                                          {"deadline_us", "/deadline_s", 1e6}};
  return csv_text(points, columns);
}

}  // namespace cli
