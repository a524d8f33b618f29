// Draws conclusions from the measured settings of a scene: how error falls with bristles and step, the Pareto
// front, and the cheapest setting for a wanted error.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/accuracy/accuracy.hpp"
#include "tools/libraries/reports/quantile.hpp"
#include "tools/libraries/run/run.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"

namespace cli {
namespace {

// Relative force errors wanted by default, tried in this order; the first that a setting can meet is used.
constexpr double default_errors[] = {0.01, 0.02, 0.05, 0.1};
// Least relative gain in error for which a slower setting joins the Pareto front. A smaller gain is noise of
// the seeds.
constexpr double front_gain = 0.02;
// Factor by which the error of a point must exceed the error of the reference itself for the point to be used
// in fits.
constexpr double above_floor = 3.0;
constexpr double single_rounding = 1e-6;  // relative error of forces in single precision
// Step, in mean snap lengths, up to which the error of the paper's loop is a power of the step. Longer steps
// are left out of the fit of that power.
constexpr double paper_limit = 0.7;

// Numbers of the first rounds of seeds for the search and for the errors that it reports; earlier runs count
// from 0. Different rounds keep the reported errors independent of the choice.
constexpr std::uint32_t search_rounds = 100'000, report_rounds = 200'000;

// Returns the order at which theory lets the error fall with the number of bristles. Stratified snap lengths
// raise the order until the bristles have redrawn their lengths.
std::string count_theory(const bristle::Material& m, double snaps_slid) {
  if (m.snap_rule == bristle::SnapRule::slide) return "-2: strata, each with the mean length of its part";
  if (m.snap_rule == bristle::SnapRule::redraw)
    return snaps_slid > 1.0 ? "-1/2: redrawn at random once they have snapped" : "-1: nearly nothing snaps";
  return fmt::format("near -1 from {:.0f} bristles on (as many as mean snap lengths moved), less below",
                     std::max(1.0, snaps_slid));
}

struct Points {
  std::vector<double> x, y;
  void add(double px, double py, double least) {
    if (!(py > least)) return;
    x.push_back(px);
    y.push_back(py);
  }
};

void add_slope(AccuracyStudy& study, std::size_t p, std::string sweep, const Points& points,
               std::string theory) {
  study.result.slopes.push_back(
      {study.scene.patches[p].name, std::move(sweep), fit_power(points.x, points.y), std::move(theory)});
}

void find_count_slopes(AccuracyStudy& study, std::size_t p) {
  const AccuracyResult& r = study.result;
  const bristle::Material& m = study.scene.materials[study.scene.patches[p].material].material;
  const double floor = std::max(above_floor * study.same_steps.floor()[p], single_rounding);
  const double snaps_slid = r.path[p] / m.snap_length.mean();
  Points points;
  for (const SettingResult& s : r.settings) {
    const Setting& set = s.setting;
    if (set.as_scene || set.is_infinite() || set.parts != r.scene_parts || set.paper_loop ||
        set.precision != bristle::Precision::single || set.mean != r.own_mean)
      continue;
    points.add(set.bristles, SettingResult::over_runs(s.same_steps, p).rms, floor);
  }
  add_slope(study, p, "bristles", points, count_theory(m, snaps_slid));
  Points pieces;
  for (const SettingResult& s : r.settings) {
    if (s.setting.is_infinite() && s.setting.parts == r.scene_parts)
      pieces.add(s.setting.resolution, SettingResult::over_runs(s.same_steps, p).rms, floor);
  }
  if (r.no_infinite.empty())
    add_slope(study, p, "resolution, infinite brush", pieces,
              "-2: what snaps within a piece of path is placed to second order");
}

void find_step_slopes(AccuracyStudy& study, std::size_t p) {
  const AccuracyResult& r = study.result;
  double rounding = 0.0;
  for (const SettingResult& s : r.settings) {
    if (s.paired && s.setting.parts == 1)
      rounding = std::max(rounding, above_floor * SettingResult::over_runs(s.pairs, p).rms);
  }
  Points exact, paper;
  for (const SettingResult& s : r.settings) {
    const Setting& set = s.setting;
    const double reach = r.step_over_snap[p] * set.parts / r.scene_parts;
    if (set.paper_loop && set.bristles == r.pair_bristles && reach < paper_limit) {
      // Fits the error of the friction work for the paper's loop, because that loop loses the path behind a
      // snap, and so friction. Errors of forces would add the scatter between different bristles.
      paper.add(study.dt(set.parts), SettingResult::over_runs(s.errors, p).energy, 0.0);
    }
    // Leaves out the finest time step. It is compared with a run of the same step, so its error is only
    // rounding.
    if (s.paired && set.precision == bristle::Precision::single && set.parts > 1)
      exact.add(study.dt(set.parts), SettingResult::over_runs(s.pairs, p).rms, rounding);
  }
  const bool carried = !study.scene.patches[p].motion.has_value();
  const bool redraw =
      study.scene.materials[study.scene.patches[p].material].material.snap_rule == bristle::SnapRule::redraw;
  add_slope(study, p, "step length", exact,
            std::string(carried ? "2 in smooth motion (midpoint rule), 1 through break-away and stops"
                                : "none while straight under constant load within a step; else 2 (mean, "
                                  "smooth) or 1 (turning back, load)") +
                (redraw ? "; the scatter of other random lengths hides it" : ""));
  if (r.no_paper_loop.empty())
    add_slope(study, p, "step length, the paper's loop (work)", paper,
              fmt::format("1: loses about v dt / (2 delta); fitted below {} mean snap lengths a step",
                          paper_limit));
}

SettingResult try_setting(AccuracyStudy& study, const Setting& setting, std::uint32_t first_round,
                          double seconds) {
  SettingResult result;
  result.setting = setting;
  result.predicted_s = study.predict(setting);
  const int rounds = static_cast<int>(std::clamp(seconds / result.predicted_s, 3.0, 5.0));
  const double until = bristle::DeadlineMonitor::wall_now() + seconds;
  for (int i = 0; i < rounds; ++i) {
    if (i >= 2 && bristle::DeadlineMonitor::wall_now() > until) break;
    measure(study, result, first_round + static_cast<std::uint32_t>(i), seconds / rounds);
  }
  return result;
}

// Searches for a smaller number of bristles that still meets the wanted error, between the one found and the
// next lower number tried. Guesses that the error falls as n^-1/2, and measures every guess.
Setting refine(AccuracyStudy& study, const SettingResult& found, double wanted, double seconds) {
  // Factor on the wanted error at which the search aims. It is below 1, so that other seeds meet the wanted
  // error too.
  constexpr double aim = 0.93;
  Setting best = found.setting;
  if (best.as_scene || best.is_infinite()) return best;
  double low = 0.0, low_error = 0.0;
  for (const SettingResult& s : study.result.settings) {
    const Setting& like = s.setting;
    const bool alike = !like.as_scene && !like.is_infinite() && like.parts == best.parts &&
                       !like.paper_loop && like.precision == best.precision && like.mean == best.mean;
    if (!alike || like.bristles >= best.bristles || like.bristles < low || s.worst().rms <= wanted) continue;
    low = like.bristles;
    low_error = s.worst().rms;
  }
  for (std::uint32_t i = 1; i <= 3 && low > 0.0; ++i) {
    const double n = low * std::pow(low_error / (aim * wanted), 2.0);
    const double unit = std::pow(10.0, std::floor(std::log10(n)) - 1.0);
    Setting middle = best;
    middle.bristles = static_cast<std::uint32_t>(std::ceil(n / unit) * unit);
    if (!(middle.bristles > 1.05 * low && middle.bristles < 0.9 * best.bristles)) break;
    const double error = try_setting(study, middle, search_rounds + 100 * i, 0.15 * seconds).worst().rms;
    if (error <= 0.97 * wanted) return middle;
    low = middle.bristles;
    low_error = error;
  }
  return best;
}

// Measures wall times of single steps with the recommended setting and the scene's own number of threads, as
// the user will run it.
void run_as_scene(AccuracyStudy& study, Recommendation& to, double seconds) {
  const Scene scene = apply(study.scene, to.setting, study.dt(to.setting.parts), 0);
  RunOptions options;
  options.isa = study.options.isa;
  const double whole_s = study.predict(to.setting) * study.full_over_cut;
  const auto steps = static_cast<double>(step_count(scene));
  options.steps = static_cast<std::uint64_t>(std::clamp(steps * seconds / whole_s, 10.0, steps));
  Scene timed = scene;
  timed.deadline = study.scene.deadline * to.setting.parts / study.result.scene_parts;
  const RunResult run = run_scene(timed, options);
  to.p99_s = run.monitor.p99();
  to.max_s = run.monitor.max();
  to.misses = run.monitor.misses();
  to.misses_ours = run.monitor.misses_ours();
  to.steps = run.steps;
}

// Accepts a setting if it meets the wanted error with seeds that the search did not use, since the search
// favours settings that were lucky. The reported error comes from yet other seeds, since acceptance favours
// luck too; it may exceed the wanted one.
bool accept(AccuracyStudy& study, const Setting& setting, double seconds) {
  Recommendation& to = study.result.recommendation;
  const SettingResult promised = try_setting(study, setting, search_rounds, 0.25 * seconds);
  if (promised.worst().rms > to.wanted) return false;
  const SettingResult confirmed = try_setting(study, setting, report_rounds, 0.25 * seconds);
  to.setting = setting;
  to.promised = promised.worst();
  to.promised_step_s = promised.step_s();
  to.confirmed = confirmed.worst();
  to.confirmed_step_s = confirmed.step_s();
  to.found = true;
  run_as_scene(study, to, 0.2 * seconds);
  return true;
}

}  // namespace

bool is_usable(const AccuracyResult& r, const Setting& s) {
  return s.parts <= r.scene_parts && r.scene_parts % s.parts == 0 && s.mean == r.own_mean && !s.paper_loop;
}

double scene_step_s(const AccuracyResult& r, const SettingResult& s) {
  return s.step_s() * r.scene_parts / s.setting.parts;
}

PatchError SettingResult::over_runs(const std::vector<std::vector<PatchError>>& runs, std::size_t p) {
  PatchError e;
  for (const auto& run : runs) {
    e.rms += run[p].rms * run[p].rms / static_cast<double>(runs.size());
    e.max = std::max(e.max, run[p].max);
    e.energy += run[p].energy / static_cast<double>(runs.size());
    e.path = std::max(e.path, run[p].path);
  }
  e.rms = std::sqrt(e.rms);
  return e;
}

PatchError SettingResult::worst() const {
  PatchError worst;
  for (std::size_t p = 0; !errors.empty() && p < errors.front().size(); ++p) {
    const PatchError e = over_runs(errors, p);
    worst.rms = std::max(worst.rms, e.rms);
    worst.max = std::max(worst.max, e.max);
    worst.energy = std::max(worst.energy, e.energy);
    worst.path = std::max(worst.path, e.path);
  }
  return worst;
}

double SettingResult::rms_spread() const {
  if (errors.size() < 2) return 0.0;
  std::vector<double> values;
  for (const auto& run : errors) {
    double most = 0.0;
    for (const PatchError& e : run) most = std::max(most, e.rms);
    values.push_back(most);
  }
  // Returns a spread of exactly 0 if all runs gave one value, as without random seeds; rounding would give a
  // little more.
  if (std::equal(std::next(values.begin()), values.end(), values.begin())) return 0.0;
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0.0;
  for (const double v : values) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / (n - 1.0) / n);
}

double SettingResult::step_s(double share) const {
  std::vector<double> values;
  for (const RunTime& t : times) values.push_back(t.cpu_s / static_cast<double>(t.steps));
  return quantile(std::move(values), share);
}

void find_slopes(AccuracyStudy& study) {
  for (std::size_t p = 0; p < study.scene.patches.size(); ++p) {
    find_count_slopes(study, p);
    find_step_slopes(study, p);
  }
}

std::vector<std::size_t> pareto_front(const std::vector<double>& time, const std::vector<double>& error,
                                      double gain) {
  std::vector<std::size_t> order(time.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return time[a] != time[b] ? time[a] < time[b] : error[a] < error[b];
  });
  std::vector<std::size_t> front;
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    if (!(error[i] < least * (1.0 - gain))) continue;
    least = error[i];
    front.push_back(i);
  }
  return front;
}

void mark_front(AccuracyStudy& study) {
  AccuracyResult& r = study.result;
  std::vector<double> time, error;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < r.settings.size(); ++i) {
    if (!is_usable(r, r.settings[i].setting)) continue;
    index.push_back(i);
    time.push_back(scene_step_s(r, r.settings[i]));
    error.push_back(r.settings[i].worst().rms);
  }
  for (const std::size_t i : pareto_front(time, error, front_gain)) r.settings[index[i]].on_front = true;
}

void recommend(AccuracyStudy& study, double seconds) {
  AccuracyResult& r = study.result;
  Recommendation& to = r.recommendation;
  std::vector<const SettingResult*> front;
  for (const SettingResult& s : r.settings) {
    if (s.on_front) front.push_back(&s);
  }
  std::sort(front.begin(), front.end(), [&](const SettingResult* a, const SettingResult* b) {
    return scene_step_s(r, *a) < scene_step_s(r, *b);
  });
  to.least_error = std::numeric_limits<double>::infinity();
  for (const SettingResult* s : front) to.least_error = std::min(to.least_error, s->worst().rms);
  std::vector<double> wanted(std::begin(default_errors), std::end(default_errors));
  if (study.options.error) wanted = {*study.options.error};
  for (const double error : wanted) {
    to.wanted = error;
    for (const SettingResult* s : front) {
      if (s->worst().rms <= error && accept(study, refine(study, *s, error, seconds), seconds)) return;
    }
  }
  to.wanted = wanted.front();
}

void compare_populations(AccuracyResult& r) {
  r.cheapest = {CheapestOf{}, CheapestOf{}};
  r.cheapest[1].infinite = true;
  for (const SettingResult& s : r.settings) {
    const double error = s.worst().rms;
    if (s.setting.as_scene || !is_usable(r, s.setting) || error > r.recommendation.wanted) continue;
    CheapestOf& to = r.cheapest[s.setting.is_infinite() ? 1 : 0];
    const double time_s = scene_step_s(r, s);
    if (to.found && to.scene_step_s <= time_s) continue;
    to = {s.setting.is_infinite(), true, s.setting, error, time_s};
  }
}

}  // namespace cli
