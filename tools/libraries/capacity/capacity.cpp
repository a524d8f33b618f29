#include "tools/libraries/capacity/capacity.hpp"

#include <thread>

#include <fmt/format.h>

#include "bench/plain_loops.hpp"

#include "tools/libraries/capacity/subject.hpp"
#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/reports/text_layout.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

using bristle::Outputs;
using bristle::Precision;
using bristle::SnapRule;

// Lists the cases whose capacity is measured: each kind of motion with one variant of the kernel, then the
// default material, then many small patches.
std::vector<CapacityCase> cases_of(int threads, bool first_thread_count, bool quick) {
  std::vector<CapacityCase> cases;
  const auto add = [&](Regime regime, SnapRule rule, Outputs outputs, int axes = 2,
                       Precision precision = Precision::single, std::uint32_t patch_bristles = 0) {
    cases.push_back({regime, rule, outputs, axes, precision, patch_bristles, threads});
  };
  // Leaves patches at rest out of quick runs. Any number of them fits the deadline, and making so many takes
  // longest.
  if (!quick) add(Regime::rest, SnapRule::keep, Outputs::end);
  if (first_thread_count || !quick) add(Regime::presliding, SnapRule::keep, Outputs::end);
  if (!quick) add(Regime::tremor, SnapRule::keep, Outputs::end);
  add(Regime::sliding, SnapRule::keep, Outputs::end);
  if (first_thread_count || !quick) {
    add(Regime::sliding, SnapRule::keep, Outputs::mean);
    add(Regime::one_snap, SnapRule::redraw, Outputs::mean);
  }
  const auto add_default = [&](Regime regime) {
    add(regime, SnapRule::redraw, Outputs::end);
    cases.back().default_material = true;
  };
  if (first_thread_count || !quick) {
    add_default(Regime::presliding);
    add_default(Regime::far);
  }
  add_default(Regime::one_snap);
  if (!quick) {
    add(Regime::presliding, SnapRule::redraw, Outputs::end);
    add(Regime::one_snap, SnapRule::redraw, Outputs::end);
    add(Regime::sliding, SnapRule::redraw, Outputs::mean);
    add(Regime::far, SnapRule::redraw, Outputs::mean);
  }
  if (first_thread_count && !quick) {
    add(Regime::sliding, SnapRule::keep, Outputs::end, 1);
    add(Regime::sliding, SnapRule::keep, Outputs::mean, 1);
    add(Regime::sliding, SnapRule::keep, Outputs::all);
#if BRISTLE_WITH_DOUBLE
    add(Regime::sliding, SnapRule::keep, Outputs::mean, 2, Precision::double_);
#endif
  }
  add(Regime::sliding, SnapRule::keep, Outputs::mean, 2, Precision::single, 100);
  if (first_thread_count || !quick)
    add(Regime::turning, SnapRule::slide, Outputs::end, 2, Precision::single, 32);
  if (!quick) {
    add(Regime::rest, SnapRule::keep, Outputs::end, 2, Precision::single, 100);
    add(Regime::one_snap, SnapRule::redraw, Outputs::mean, 2, Precision::single, 100);
  }
  return cases;
}

std::vector<int> thread_counts(const CapacityOptions& options) {
  if (!options.threads.empty()) return options.threads;
#if BRISTLE_WITH_TBB
  const int cores = static_cast<int>(std::thread::hardware_concurrency());
  if (cores > 1) return {1, cores};
#endif
  return {1};
}

}  // namespace

const RegimeFacts& facts_of(Regime regime) noexcept {
  static constexpr RegimeFacts facts[] = {
      {"rest", 0.0, "no motion, after sliding"},
      {"tremor", 0.05, "to and fro by 0.05 mean snap lengths: nothing snaps any more"},
      {"presliding", 0.003, "0.003 mean snap lengths a step: few snap"},
      {"one snap", 1.0, "1.0 mean snap lengths a step: one snap of each bristle on average, none to two"},
      {"all snap", 1.6, "1.6 mean snap lengths a step: every bristle snaps, one to three times"},
      {"turning", 1.6, "1.6 mean snap lengths a step, every other one sideways"},
      {"far", 100.0, "100 mean snap lengths a step"}};
  return facts[static_cast<int>(regime)];
}

std::string CapacityCase::motion_name() const {
  if (!step) return to_string(regime);
  const char* path = "straight";
  if (zigzag)
    path = "zigzag";
  else if (either_side)
    path = "corners";
  else if (turn > 0.0)
    path = turn > 1.0 ? "square" : "bend";
  return fmt::format("{}{}", path, ripple > 0.0 ? ", rippling load" : "");
}

std::string CapacityCase::kernel_name() const {
  return fmt::format("{}{} {}, {}, end{}{}, {}", default_material ? "default material, " : "", axes,
                     axes == 1 ? "axis" : "axes", is_infinite() ? "infinite" : to_string(rule),
                     has(outputs, Outputs::mean) ? " + mean" : "",
                     has(outputs, Outputs::energy) ? " + energy" : "",
                     precision == Precision::double_ ? "double" : "single");
}

std::string CapacityCase::layout_name() const {
  return patch_bristles ? fmt::format("patches of {}", patch_bristles) : "one patch";
}

void capacity_command(const CapacityOptions& options) {
  const bool on_stdout = check_files({}, {{"--json", options.json}, {"--csv", options.csv}});
  if (!options.csv.empty() && options.targets)
    throw UserError("--csv: holds the curves of the search, which --targets leaves out");
  OutputFile json(options.json), csv(options.csv);

  CapacityResult result;
  {
    const CapacityCase fixed{Regime::one_snap, SnapRule::redraw, Outputs::mean};
    const CapacitySubject subject(fixed, 900, options.isa);
    result.isa = subject.isa();
    result.state_hash = subject.state_hash();
  }
  result.plain_loops_run = bristle::plain::plain_loops_run_here();
  std::vector<CapacityCase> cases;
  const std::vector<int> threads = thread_counts(options);
  const bool everything = !options.targets;
  for (std::size_t i = 0; everything && i < threads.size(); ++i) {
    for (const CapacityCase& c : cases_of(threads[i], i == 0, options.quick)) cases.push_back(c);
  }
  {
    Progress progress("capacity");
    progress.update(0.0, "comparing loops");
    if (result.plain_loops_run && everything) result.comparisons = compare_loops(options);
    // Share of the study that is done, 0 to 1, as the progress line shows it.
    double done = 0.05;
    const Report report = [&](const std::string& what) { progress.update(done += 0.005, what.c_str()); };
    if (everything) {
      result.infinite = measure_infinite(options, report);
      result.contacts = measure_contacts(options, threads, report);
      result.snapshots = measure_snapshots(options);
    }
    if (options.targets || (everything && !options.quick)) result.targets = measure_targets(options, report);
    for (std::size_t i = 0; i < cases.size(); ++i) {
      const CapacityCase& c = cases[i];
      progress.update(done + (1.0 - done) * static_cast<double>(i) / static_cast<double>(cases.size()),
                      fmt::format("{}, {}, {}, threads: {}", to_string(c.regime), c.kernel_name(),
                                  c.layout_name(), c.threads)
                          .c_str());
      result.rows.push_back(find_capacity(c, options));
    }
  }
  if (!on_stdout) print_report(capacity_table(options, result));
  if (json) json.write(capacity_json(options, result));
  if (csv) csv.write(capacity_csv(options, result));
}

}  // namespace cli
