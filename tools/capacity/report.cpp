// What `bristle capacity` says: tables for people, JSON for programs, CSV for the plot.
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tools/capacity/capacity.hpp"
#include "tools/capacity/subject.hpp"
#include "tools/reports/conditions.hpp"
#include "tools/reports/text_table.hpp"

namespace cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr double papers_bristles = 900.0;

struct Motion {
  Regime regime;
  const char* meaning;
};
constexpr Motion motions[] = {
    {Regime::rest, "no motion, after sliding"},
    {Regime::tremor, "to and fro by 0.05 mean snap lengths: nothing snaps any more"},
    {Regime::presliding, "0.003 mean snap lengths a step: few snap"},
    {Regime::one_snap, "1.0 mean snap lengths a step: one snap of each bristle on average, none to two"},
    {Regime::sliding, "1.6 mean snap lengths a step: every bristle snaps, one to three times"},
    {Regime::far, "100 mean snap lengths a step"},
};

const char* const note_on_p99 =
    "Steps run back to back on this machine as it is: preemption and other load count in p99. Where only p99 "
    "is "
    "late and the median well inside, a probe is tried up to four times, the confirming run twice.";

std::string ns_text(double ns) {
  return ns < 0.001 ? "< 0.001" : fmt::format("{:.{}f}", ns, ns < 10.0 ? 3 : 1);
}

Json times_json(const StepTimes& t) {
  return {{"bristles", t.bristles},
          {"steps", t.steps},
          {"p50_s", t.p50_s},
          {"p99_s", t.p99_s},
          {"p999_s", t.p999_s},
          {"max_s", t.max_s},
          {"ns_per_bristle", t.bristles ? Json(t.ns_per_bristle()) : Json(nullptr)}};
}

std::string comparison_table(const CapacityResult& result) {
  TextTable table(
      {"bristles", "<motion", "<loop", "ns per bristle", "a step us", "time / bristle's", "quartiles"});
  std::string last;
  for (const ComparisonRow& row : result.comparisons) {
    const std::string group = fmt::format("{} {}", row.bristles, row.regime);
    const bool first = group != last;
    last = group;
    table.add({first ? count_text(row.bristles) : "", first ? row.regime : "", row.what,
               ns_text(row.ns_per_bristle),
               fmt::format("{:.3g}", row.ns_per_bristle * 1e-3 * static_cast<double>(row.bristles)),
               first ? "1" : fmt::format("{:.2f}", row.ratio),
               first ? "" : fmt::format("{:.2f} to {:.2f}", row.ratio_low, row.ratio_high)});
  }
  return table.text();
}

std::string rows_table(const CapacityResult& result) {
  TextTable table({"<motion", "<kernel", "<layout", "threads", "bristles that fit", "x 900", "ns per bristle",
                   "in cache", "p50", "p99", "max"});
  table.add({"the paper (2004)", "1 GHz Pentium III", "one patch", "1", "900", "1", "-", "-", "-", "-", "-"});
  for (const CapacityRow& row : result.rows) {
    const StepTimes& t = row.fits;
    std::vector<std::string> cells = {to_string(row.what.regime), row.what.kernel_name(),
                                      row.what.layout_name(), fmt::format("{}", row.what.threads)};
    if (row.unconfirmed || t.bristles == 0) {
      cells.insert(cells.end(), {row.unconfirmed ? "not confirmed: machine too busy" : "fewer than 900", "-",
                                 "-", "-", "-", "-", "-"});
    } else {
      cells.push_back((row.capped ? "> " : "") + count_text(t.bristles));
      cells.push_back(
          count_text(static_cast<unsigned long long>(static_cast<double>(t.bristles) / papers_bristles)));
      cells.push_back(ns_text(t.ns_per_bristle()));
      cells.push_back(row.in_cache.bristles ? ns_text(row.in_cache.ns_per_bristle()) : "-");
      for (const double s : {t.p50_s, t.p99_s, t.max_s}) cells.push_back(time_text(s));
    }
    table.add(std::move(cells));
  }
  return table.text();
}

std::string targets_table(const CapacityResult& result) {
  TextTable table({"<target", "measured", "<", "spread", "limit", "<", "<what"});
  for (const TargetRow& row : result.targets) {
    table.add({row.name, fmt::format("{:.3g}", row.measured), row.unit,
               fmt::format("{:.3g} to {:.3g}", row.low, row.high),
               fmt::format("{} {:.3g}", row.at_least ? ">=" : "<=", row.limit), row.met() ? "met" : "MISSED",
               row.what});
  }
  return table.text();
}

std::string features_table(const CapacityResult& result) {
  TextTable table(
      {"<motion", "<feature", "<kernel", "bytes per bristle", "ns per bristle", "time / least", "quartiles"});
  std::string last;
  for (const FeatureRow& row : result.features) {
    table.add({row.regime == last ? "" : row.regime, row.feature, row.kernel,
               fmt::format("{}", row.bytes_per_bristle), ns_text(row.ns_per_bristle),
               fmt::format("{:.2f}", row.ratio),
               fmt::format("{:.2f} to {:.2f}", row.ratio_low, row.ratio_high)});
    last = row.regime;
  }
  return table.text();
}

}  // namespace

std::string capacity_table(const CapacityOptions& options, const CapacityResult& result) {
  const Conditions c = conditions();
  std::string text = fmt::format(
      "bristle {}, commit {}, {}, {} kernels\n{}, {} cores, state hash of a fixed scene {:016x}\ndeadline "
      "{}, dt {}, snap lengths uniform on 5 to "
      "15 um, "
      "motion along (0.8, 0.6)\n",
      c.version, c.commit, c.flags, result.isa, c.cpu, c.cores, result.state_hash,
      time_text(options.deadline_s), time_text(capacity_dt_s));
  for (const Motion& m : motions) text += fmt::format("  {:<11} {}\n", to_string(m.regime), m.meaning);
  text += '\n';
  if (!result.features.empty()) {
    text +=
        "What each feature adds to the least kernel: 14,400 bristles, one thread, interleaved. A kernel "
        "holds "
        "the\ncode of its own features only.\n\n" +
        features_table(result) + '\n';
  }
  if (!result.targets.empty()) {
    text +=
        "Targets. Median and quartiles; for p99 the best of three runs, from its median to the worst run's "
        "p99.\n\n" +
        targets_table(result) + '\n';
  }
  if (result.rows.empty()) return text;
  if (!result.comparisons.empty()) {
    text +=
        "One thread beside plain loops, interleaved. The plain loops have every compiler flag turned on; the "
        "paper's\n"
        "loop steps by its literal rule, which loses the overshoot, and knows no mean force.\n\n";
    text += comparison_table(result) + '\n';
  } else {
    text += "plain loops left out: built for another machine or without them\n\n";
  }
  text += fmt::format(
      "Bristles whose step fits {} at p99, confirmed by a run of its own. In cache: 14,400 bristles.\n\n",
      time_text(options.deadline_s));
  text += rows_table(result);
  text += fmt::format("\n{}\n", note_on_p99);
  return text;
}

std::string capacity_json(const CapacityOptions& options, const CapacityResult& result) {
  Json report = {{"schema", "bristle-capacity-1"}};
  report["conditions"] = to_json(conditions());
  report["conditions"]["isa"] = result.isa;
  report["state_hash"] = fmt::format("{:016x}", result.state_hash);
  report["deadline_s"] = options.deadline_s;
  report["dt_s"] = capacity_dt_s;
  report["mean_snap_length_m"] = mean_snap_length_m;
  report["snap_length"] = "uniform, 0.5 to 1.5 of the mean";
  report["quick"] = options.quick;
  report["note"] = note_on_p99;
  report["motions"] = Json::array();
  for (const Motion& m : motions) {
    report["motions"].push_back({{"name", to_string(m.regime)},
                                 {"step_over_mean_snap_length", step_length(m.regime)},
                                 {"meaning", m.meaning}});
  }
  report["paper"] = {{"bristles", 900}, {"deadline_s", 1e-3}, {"machine", "1 GHz Pentium III, 2004"}};
  report["targets"] = Json::array();
  for (const TargetRow& row : result.targets) {
    report["targets"].push_back({{"name", row.name},
                                 {"what", row.what},
                                 {"measured", row.measured},
                                 {"spread", {row.low, row.high}},
                                 {"limit", row.limit},
                                 {"at_least", row.at_least},
                                 {"unit", row.unit},
                                 {"met", row.met()}});
  }
  report["features"] = Json::array();
  for (const FeatureRow& row : result.features) {
    report["features"].push_back({{"motion", row.regime},
                                  {"feature", row.feature},
                                  {"kernel", row.kernel},
                                  {"bytes_per_bristle", row.bytes_per_bristle},
                                  {"ns_per_bristle", row.ns_per_bristle},
                                  {"time_over_least", row.ratio},
                                  {"quartiles", {row.ratio_low, row.ratio_high}}});
  }
  report["comparisons"] = Json::array();
  for (const ComparisonRow& row : result.comparisons) {
    report["comparisons"].push_back({{"bristles", row.bristles},
                                     {"motion", row.regime},
                                     {"loop", row.what},
                                     {"ns_per_bristle", row.ns_per_bristle},
                                     {"time_over_bristle", row.ratio},
                                     {"quartiles", {row.ratio_low, row.ratio_high}}});
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
  return report.dump(2) + '\n';
}

std::string capacity_csv(const CapacityOptions& options, const CapacityResult& result) {
  std::string text =
      "motion,kernel,layout,threads,bristles,p50_us,p99_us,max_us,ns_per_bristle,deadline_us\n";
  for (const CapacityRow& row : result.rows) {
    for (const StepTimes& t : row.curve) {
      fmt::format_to(std::back_inserter(text), "{},\"{}\",{},{},{},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}\n",
                     to_string(row.what.regime), row.what.kernel_name(), row.what.layout_name(),
                     row.what.threads, t.bristles, 1e6 * t.p50_s, 1e6 * t.p99_s, 1e6 * t.max_s,
                     t.ns_per_bristle(), 1e6 * options.deadline_s);
    }
  }
  return text;
}

}  // namespace cli
