// Runs the reference of a study of accuracy, and chooses and runs the settings that are compared with it (the
// ladder, from cheap to expensive).
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/accuracy/accuracy.hpp"
#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

constexpr std::uint32_t pilot_few = 300, pilot_many = 3000;
constexpr double first_round_share = 0.4;  // share of the time for all rounds that the first may take
constexpr std::uint64_t pilot_steps = 20'000;
// Run time, s, above which a single run times a setting well enough, because disturbances by other programs
// are negligible.
constexpr double enough_timed_s = 0.2;
constexpr std::uint32_t most_reference_bristles = 1'000'000;
// Estimated ratio of the time of a step in double precision to one in single precision. Only single precision
// is timed in advance, so the estimate is on the high side.
constexpr double double_costs = 2.0;
// Estimated ratio of the time of a step of the paper's loop (plain arrays) to that of as many
// representatives.
constexpr double paper_loop_costs = 5.0;
// Number of representatives whose step takes as long as that of an infinite patch with one piece of path per
// mean snap length. An infinite patch of resolution r costs r times as much. For planning the study only.
constexpr double bristles_a_piece = 150.0;
constexpr double resolutions[] = {2.0, 4.0, 8.0, 16.0, 32.0};
// Smallest relative spread (standard deviation over mean) of snap lengths that the infinite brush accepts.
constexpr double least_infinite_spread = 0.05;

// Rounds a number of bristles down to two significant digits, which are easier to read.
std::uint32_t rounded(double count) {
  const double unit = std::pow(10.0, std::max(0.0, std::floor(std::log10(count)) - 1.0));
  return static_cast<std::uint32_t>(std::floor(count / unit) * unit);
}

Setting reference_setting(std::uint32_t bristles) {
  Setting setting;
  setting.bristles = bristles;
  setting.precision = BRISTLE_WITH_DOUBLE ? bristle::Precision::double_ : bristle::Precision::single;
  setting.mean = true;
  return setting;
}

// Measures the wall time of a step of the scene with few copies, as a fixed part and a part per bristle. Wall
// time, not CPU time, because the study as a whole has a limit in wall time. A short scene is run in full.
StepCost step_cost(const AccuracyStudy& study, Setting setting, std::uint32_t parts) {
  double cost[2];
  for (const int i : {0, 1}) {
    setting.bristles = i == 0 ? pilot_few : pilot_many;
    const Scene pilot = apply(study.cut, setting, study.dt(parts), 0);
    cost[i] = std::numeric_limits<double>::infinity();
    // Repeats the short runs that estimate the cost of a step, because one interruption would double the time
    // of a run of a few hundred microseconds.
    double spent = 0.0;
    for (int run = 0; run < 3 && spent < enough_timed_s; ++run) {
      const RunTime time = run_setting(pilot, 1, study.options.isa, false, pilot_steps).time;
      cost[i] = std::min(cost[i], time.wall_s / static_cast<double>(time.steps));
      spent += time.wall_s;
      study.spend("sizing");
    }
  }
  StepCost result;
  result.bristle_s = std::max(cost[1] - cost[0], 1e-9) / (pilot_many - pilot_few);
  result.fixed_s = std::max(cost[0] - pilot_few * result.bristle_s, 1e-8);
  return result;
}

void measure_path(AccuracyStudy& study, const Scene& fine) {
  AccuracyResult& r = study.result;
  r.path.assign(study.cut.patches.size(), 0.0);
  std::vector<double> moving(study.cut.patches.size(), 0.0);
  SceneStepper stepper(fine, {});
  std::vector<double> path(stepper.copies().size()), moved(stepper.copies().size());
  const std::uint64_t steps = step_count(fine);
  for (std::uint64_t k = 0; k < steps; ++k) {
    stepper.prescribe(static_cast<double>(k) * fine.dt);
    if (!stepper.bodies().empty()) stepper.step(static_cast<double>(k) * fine.dt);
    for (std::size_t c = 0; c < path.size(); ++c) {
      const auto& d = stepper.motions()[c].displacement;
      const double length = std::hypot(d[0], d[1]);
      path[c] += length;
      // Counts a step as moving only if it is longer than a thousandth of a mean snap length. A creeping body
      // moves a little in every step.
      const double snap =
          fine.materials[fine.patches[stepper.copies()[c].patch].material].material.snap_length.mean();
      if (length > 1e-3 * snap) moved[c] += 1.0;
    }
  }
  r.step_over_snap.assign(r.path.size(), 0.0);
  for (std::size_t c = 0; c < path.size(); ++c) {
    const std::size_t p = stepper.copies()[c].patch;
    const double snap = fine.materials[fine.patches[p].material].material.snap_length.mean();
    r.path[p] = std::max(r.path[p], path[c]);
    if (moved[c] > 0.0)
      r.step_over_snap[p] =
          std::max(r.step_over_snap[p], path[c] / moved[c] / snap * (study.scene.dt / fine.dt));
  }
}

/// Returns the reason why a scene cannot run with the infinite brush, for the report; empty if it can.
std::string infinite_obstacle(const Scene& scene) {
  for (const ScenePatch& patch : scene.patches) {
    const bristle::Material& m = scene.materials[patch.material].material;
    if (m.snap_rule != bristle::SnapRule::redraw)
      return fmt::format("patch '{}' has a material with rule = \"{}\"", patch.name, to_string(m.snap_rule));
    if (m.snap_length.cv() < least_infinite_spread)
      return fmt::format("the snap lengths of patch '{}' spread by less than {}", patch.name,
                         least_infinite_spread);
  }
  return {};
}

/// Returns the reason why a scene cannot run with the paper's loop, in which a snap loses the path left in
/// the step; empty if it can.
std::string paper_loop_obstacle(const Scene& scene) {
  for (const ScenePatch& patch : scene.patches) {
    const bristle::Material& m = scene.materials[patch.material].material;
    if (m.snap_rule == bristle::SnapRule::slide)
      return fmt::format("the bristles of patch '{}' slide, they do not snap", patch.name);
    if (m.residual_length != 0.0 || m.shared_renewal != 0.0 || m.ageing_strength != 0.0 ||
        m.speed_strengthening != 0.0)
      return fmt::format("the material of patch '{}' has residual, shared renewal, ageing or strengthening",
                         patch.name);
    if (!(patch.options.lay == bristle::Lay{})) return fmt::format("patch '{}' has a lay", patch.name);
    if (patch.is_carried()) return fmt::format("a body moves patch '{}'", patch.name);
  }
  return {};
}

// Removes the most expensive settings from the ladder (the settings to try) until the rest can be run in
// `seconds`.
void fit_into(std::vector<SettingResult>& ladder, double seconds, int rounds, AccuracyStudy& study) {
  const auto total = [&] {
    double sum = 0.0;
    for (const SettingResult& s : ladder) sum += rounds * s.predicted_s;
    return sum;
  };
  while (ladder.size() > 2 && total() > seconds) {
    const auto most = std::max_element(
        std::next(ladder.begin()), ladder.end(),
        [](const SettingResult& a, const SettingResult& b) { return a.predicted_s < b.predicted_s; });
    study.result.not_run.push_back(setting_name(most->setting, study.dt(most->setting.parts)));
    ladder.erase(most);
  }
}

}  // namespace

AccuracyBudget budget(const AccuracyOptions& options) {
  const double s = options.seconds > 0.0 ? options.seconds : options.quick ? 40.0 : 220.0;
  return {0.35 * s, 0.5 * s, 0.15 * s};
}

double AccuracyStudy::predict(const Setting& setting) const {
  const double steps = static_cast<double>(step_count(cut)) * result.scene_parts / setting.parts;
  const double n = setting.as_scene        ? scene_bristles()
                   : setting.is_infinite() ? bristles_a_piece * setting.resolution
                                           : setting.bristles;
  const double factor = setting.paper_loop                                 ? paper_loop_costs
                        : setting.precision == bristle::Precision::double_ ? double_costs
                                                                           : 1.0;
  // Adds the time for making the patches as the second term: about 60 ns for the snap length of each bristle.
  return steps * (cost.fixed_s + n * factor * cost.bristle_s) +
         60e-9 * n * static_cast<double>(cut.patch_count());
}

std::uint32_t AccuracyStudy::scene_bristles() const {
  std::uint32_t most = 1;
  for (const ScenePatch& patch : scene.patches) {
    const bristle::Material& m = scene.materials[patch.material].material;
    const double all = std::min(m.bristles_in_contact(patch.options.max_normal_load), 4096.0);
    if (patch.options.population == bristle::Population::infinite) {
      const double pieces = patch.options.resolution > 0.0 ? patch.options.resolution : 8.0;
      most = std::max(most, static_cast<std::uint32_t>(bristles_a_piece * pieces));
      continue;
    }
    most = std::max(most, patch.options.bristles ? patch.options.bristles : static_cast<std::uint32_t>(all));
  }
  return most;
}

void make_reference(AccuracyStudy& study, double seconds) {
  AccuracyResult& r = study.result;
  const double until = bristle::DeadlineMonitor::wall_now() + seconds;
  r.reference_double = BRISTLE_WITH_DOUBLE;
  Setting own;
  own.mean = r.own_mean;
  study.cost = step_cost(study, own, r.scene_parts);
  const StepCost fine_cost = step_cost(study, reference_setting(0), 1);
  const int threads = 0;  // 0 means one thread per core; the number of threads does not change the result
  const int runs = study.options.quick ? 4 : 6;
  const double copies = static_cast<double>(study.cut.patch_count());
  const double steps = static_cast<double>(step_count(study.cut)) * r.scene_parts;
  const double pair_share = 0.2;
  const double each = (until - bristle::DeadlineMonitor::wall_now()) * (1.0 - pair_share) / runs;
  const double affordable = (each / (1.0 + 1.0 / r.scene_parts) - steps * fine_cost.fixed_s) /
                            (steps * fine_cost.bristle_s + 60e-9 * copies);
  r.reference_bristles =
      rounded(std::clamp(affordable, 1000.0, static_cast<double>(most_reference_bristles)));
  for (int i = 0; i < runs; ++i) {
    // Stops the reference runs only after an even number, because their error is computed from two halves of
    // equal size.
    const double now = bristle::DeadlineMonitor::wall_now();
    if (i > 0 && i % 2 == 0 && now + 2.0 * each > until && now > until - pair_share * seconds) break;
    const Setting setting = reference_setting(r.reference_bristles);
    // Uses seeds for the reference that no setting uses: the settings count their rounds from 0.
    const auto round = static_cast<std::uint32_t>(1'000'000 + i);
    for (const std::uint32_t parts : {1u, r.scene_parts}) {
      const SettingRun run =
          run_setting(apply(study.cut, setting, study.dt(parts), round), threads, study.options.isa, true);
      (parts == 1 ? study.fine : study.same_steps).add(run.record);
      study.spend("reference");
    }
  }
  r.reference_runs = study.fine.runs();
  study.fine.finish();
  study.same_steps.finish();
  r.floor = study.fine.floor();
  study.closed_form.emplace(study.cut, r.reference_dt_s, 10 * r.scene_parts);
  if (study.closed_form->any()) r.reference_closed_form = study.closed_form->compare(study.fine.mean(), 1);

  r.pair_bristles = study.options.quick ? 3000 : 10'000;
  for (const std::uint32_t fewer : {3000u, 1000u, 300u}) {
    const double each_s = steps * (fine_cost.fixed_s + r.pair_bristles * fine_cost.bristle_s);
    if (each_s > 0.5 * pair_share * seconds && fewer < r.pair_bristles) r.pair_bristles = fewer;
  }
  for (const std::uint32_t round : {0u, 1u}) {
    const Scene scene = apply(study.cut, reference_setting(r.pair_bristles), r.reference_dt_s, round);
    SettingRun run = run_setting(scene, threads, study.options.isa, true);
    study.paired[round] = std::move(run.record);
    study.spend("reference");
  }
  Setting few;
  few.bristles = 300;
  few.mean = r.own_mean;
  measure_path(study, apply(study.cut, few, r.reference_dt_s, 0));
}

std::vector<SettingResult> make_ladder(AccuracyStudy& study, double seconds) {
  const AccuracyResult& r = study.result;
  const bool quick = study.options.quick;
  std::vector<SettingResult> ladder;
  const auto add = [&](Setting setting, bool paired = false) {
    SettingResult result;
    result.setting = setting;
    result.paired = paired;
    result.predicted_s = study.predict(setting);
    ladder.push_back(std::move(result));
  };
  Setting plain;
  plain.mean = r.own_mean;
  plain.parts = r.scene_parts;
  Setting as_scene = plain;
  as_scene.as_scene = true;
  add(as_scene);

  std::vector<std::uint32_t> counts = {30, 100, 300, 1000, 3000, 10'000, 30'000, 100'000};
  if (!quick) counts.insert(counts.end(), {300'000, 1'000'000});
  std::vector<std::uint32_t> parts;
  for (const double over : {0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0}) {
    const double p = over * r.scene_parts;
    if (p >= 1.0 && over <= 5.0) parts.push_back(static_cast<std::uint32_t>(std::lround(p)));
  }
  study.result.no_paper_loop = paper_loop_obstacle(study.scene);
  for (const std::uint32_t n : counts) {
    const bool paired = n == r.pair_bristles;
    for (const std::uint32_t p : parts) {
      if (quick && p != r.scene_parts && !paired && n != 300 && n != 1000) continue;
      Setting s = plain;
      s.bristles = n;
      s.parts = p;
      add(s, paired);
      if (study.result.no_paper_loop.empty() && (n == 300 || paired)) {
        s.paper_loop = true;
        add(s);
      }
    }
    Setting s = plain;
    s.bristles = n;
    if (study.scene.bodies.empty() && (!quick || n == 1000 || n == 10'000)) {
      s.mean = !plain.mean;
      add(s);
      s.mean = plain.mean;
    }
    if (BRISTLE_WITH_DOUBLE && (n == 1000 || n == 10'000 || n == 100'000 || paired)) {
      s.precision = bristle::Precision::double_;
      add(s, paired);
    }
  }
  study.result.no_infinite = infinite_obstacle(study.scene);
  for (const double resolution : resolutions) {
    if (!study.result.no_infinite.empty()) break;
    Setting s = plain;
    s.resolution = resolution;
    for (const std::uint32_t p : parts) {
      if (quick && p != r.scene_parts) continue;
      s.parts = p;
      add(s);
    }
  }
  // Plans at least three rounds of runs of each setting, so that medians of run times mean something.
  fit_into(ladder, seconds, 3, study);
  return ladder;
}

void measure(AccuracyStudy& study, SettingResult& to, std::uint32_t round, double most_s) {
  const Setting& s = to.setting;
  const AccuracyResult& r = study.result;
  SettingRun run = run_setting(apply(study.cut, s, study.dt(s.parts), round), 1, study.options.isa, true,
                               ~std::uint64_t{0}, s.paper_loop);
  to.errors.push_back(compare(run.record, study.fine.mean(), s.parts, s.mean));
  if (s.parts == r.scene_parts)
    to.same_steps.push_back(compare(run.record, study.same_steps.mean(), 1, s.mean));
  if (to.paired && round < 2) to.pairs.push_back(compare(run.record, study.paired[round], s.parts, s.mean));
  if (study.closed_form->any() && to.closed_form.empty())
    to.closed_form = study.closed_form->compare(run.record, s.parts);
  if (study.is_cut) {
    // Measures times on a part of the run with all copies of each patch, and errors on the whole run with few
    // copies, because all copies over the whole run would take too long.
    const double whole_s = to.predicted_s * study.full_over_cut;
    const Scene full = apply(study.scene, s, study.dt(s.parts), round);
    const auto steps = static_cast<double>(step_count(full));
    const auto some = static_cast<std::uint64_t>(std::clamp(steps * most_s / whole_s, 10.0, steps));
    run.time = run_setting(full, 1, study.options.isa, false, some, s.paper_loop).time;
  }
  to.times.push_back(run.time);
  study.spend("settings");
}

void run_ladder(AccuracyStudy& study, double seconds) {
  AccuracyResult& r = study.result;
  // Halves the time for settings if errors are measured on few copies of each patch. The other half is for
  // timing the scene with all copies.
  const double usable = study.is_cut ? 0.5 * seconds : seconds;
  r.settings = make_ladder(study, usable);
  // Runs cheap settings first, so that the expensive ones are dropped if the machine is slower than
  // predicted.
  std::stable_sort(
      std::next(r.settings.begin()), r.settings.end(),
      [](const SettingResult& a, const SettingResult& b) { return a.predicted_s < b.predicted_s; });
  const double share = usable / static_cast<double>(r.settings.size());
  const int rounds = study.options.quick ? 5 : 8;
  const double start = bristle::DeadlineMonitor::wall_now();
  for (int round = 0; round < rounds; ++round) {
    for (SettingResult& s : r.settings) {
      const double spent = bristle::DeadlineMonitor::wall_now() - start;
      if (round == 0 && spent > first_round_share * seconds && &s != r.settings.data()) {
        study.result.not_run.push_back(setting_name(s.setting, study.dt(s.setting.parts)));
        continue;
      }
      // Runs cheap settings in every round of seeds, but expensive ones only in the first three rounds.
      const bool dear = round >= 3 && s.predicted_s > share / rounds;
      if (round > 0 && (s.times.empty() || dear || spent > seconds)) continue;
      measure(study, s, static_cast<std::uint32_t>(round), 0.3 * share);
    }
  }
  std::erase_if(r.settings, [](const SettingResult& s) { return s.times.empty(); });
}

std::string setting_name(const Setting& s, double dt_s) {
  if (s.as_scene) return "the scene as it is";
  if (s.is_infinite())
    return fmt::format("infinite brush at resolution {}, {}, {}", s.resolution, time_text(dt_s),
                       s.mean ? "mean" : "end");
  if (s.paper_loop)
    return fmt::format("the paper's loop, {} bristles, {}", count_text(s.bristles), time_text(dt_s));
  return fmt::format("{} bristles, {}, {}, {}", count_text(s.bristles), time_text(dt_s),
                     s.precision == bristle::Precision::single ? "single" : "double",
                     s.mean ? "mean" : "end");
}

}  // namespace cli
