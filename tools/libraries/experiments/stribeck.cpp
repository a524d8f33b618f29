// Experiment on the Stribeck effect: steady friction against speed, lubricated and dry.
#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/subject.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

struct Curve {
  std::vector<double> speed, force;

  double lowest() const { return *std::min_element(force.begin(), force.end()); }
};

// Returns the mean friction (N) of steady sliding over a path `path`, measured after a path `settling` over
// which a brush forgets its start.
double steady_force(const std::string& model, const Settings& s, double speed) {
  Subject subject(model, s);
  const double dbar = s.number("presliding"), load = s.number("load");
  // Steps by an odd fraction of the presliding length, which keeps snaps from coinciding with steps, or by
  // less if dt requires it.
  const double step = std::min(0.37 * dbar, speed * s.number("dt"));
  const double dt = step / speed;
  const auto settle = static_cast<long>(std::ceil(s.number("settling") * dbar / step));
  const auto measure = static_cast<long>(std::ceil(s.number("path") * dbar / step));
  const long longest = 1'000'000;
  double sum = 0.0;
  for (long k = -std::min(settle, longest); k < std::min(measure, longest); ++k) {
    const double friction = -subject.step({step, 0.0}, dt, load).mean.x;
    if (k >= 0) sum += friction;
  }
  return sum / static_cast<double>(std::min(measure, longest));
}

Curve measure(ExperimentRun& run, const std::string& panel, const Settings& s) {
  Curve curve;
  for (const double v : run.settings.numbers("speeds")) {
    curve.speed.push_back(v);
    curve.force.push_back(steady_force(run.model, s, v));
    run.add(panel, {v, curve.force.back()});
  }
  return curve;
}

void judge(ExperimentRun& run, const Curve& lubricated, const Curve& dry) {
  const double kinetic = run.number("kinetic") * run.number("load");
  const double vs = run.number("stribeck_velocity");
  // Highest friction at the speeds up to the one with the lowest friction, from which the fall is measured.
  const auto lowest = std::min_element(lubricated.force.begin(), lubricated.force.end());
  const double before = *std::max_element(lubricated.force.begin(), lowest + 1);
  const double fall = (before - *lowest) / kinetic;
  run.add("stribeck_fall", 100.0 * fall, fall > 0.02);
  double near_vs = 0.0, distance = INFINITY;
  for (std::size_t i = 0; i < lubricated.speed.size(); ++i) {
    const double away = std::fabs(std::log(lubricated.speed[i] / vs));
    if (away < distance) near_vs = lubricated.force[i];
    distance = std::min(distance, away);
  }
  const double early = (lubricated.force.front() - near_vs) / kinetic;
  run.add("stribeck_early", 100.0 * early, early > 0.02);
  const double rise = (lubricated.force.back() - *lowest) / kinetic;
  run.add("viscous_rise", 100.0 * rise, rise > 0.02);
  double low = INFINITY, high = -INFINITY;
  int away_from_rest = 0;
  for (std::size_t i = 0; i < dry.speed.size(); ++i) {
    if (dry.speed[i] < 10.0 * vs) continue;
    low = std::min(low, dry.force[i]);
    high = std::max(high, dry.force[i]);
    ++away_from_rest;
  }
  if (away_from_rest < 2) return;  // fewer than two speeds leave nothing to compare
  const double spread = (high - low) / kinetic;
  run.add("dry_constant", 100.0 * spread, spread < 0.02);
}

void check_stribeck(const Settings& settings) {
  const std::vector<double>& speeds = settings.numbers("speeds");
  if (!std::is_sorted(speeds.begin(), speeds.end(), std::less_equal<>()))
    throw UserError("experiment stribeck: speeds must ascend");
}

void run_stribeck(ExperimentRun& run) {
  Settings dry = run.settings;
  dry.set("viscous=0");
  dry.set("damping=0");
  const Curve lubricated = measure(run, "lubricated", run.settings);
  judge(run, lubricated, measure(run, "dry", dry));
}

}  // namespace

Experiment stribeck_experiment() {
  return {
      "stribeck",
      "steady friction against speed, lubricated and dry (without damper and viscous terms)",
      "The brush's damper raises friction up to the Stribeck velocity and fades beyond it, where the "
      "lubricant takes over",
      common_parameters({{"bristles", 3600}, {"dt", 1e-2}}) +
          std::vector<Parameter>{
              list_parameter("speeds",
                             {5e-5, 1e-4, 2e-4, 5e-4, 7.07106781187e-4, 1e-3, 1.5e-3, 2e-3, 3e-3, 4e-3, 5e-3,
                              6e-3, 8e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2, 0.5},
                             "m/s", "speeds, ascending", 1e-7, 1e3),
              number_parameter("settling", 10.0, "", "path before measuring, mean snap lengths", 0.0, 1e6),
              number_parameter("path", 200.0, "", "path measured, mean snap lengths", 1.0, 1e7)},
      {{"stribeck_fall", "friction falls with speed, lubricated",
        "between boundary and full lubrication friction falls with speed (Stribeck 1902)",
        "highest less lowest steady force beyond it, over kinetic friction", "%", "above 2 %"},
       {"stribeck_early", "and falls from the slowest speed on",
        "the static force is the highest: friction falls from speed 0 on (Armstrong-Helouvry et al. 1994)",
        "force at the slowest speed less that at the Stribeck velocity, over kinetic friction", "%",
        "above 2 %"},
       {"viscous_rise", "friction rises at high speed, lubricated",
        "viscous friction grows with speed (Reynolds 1866 on)",
        "force at the highest speed less the lowest one, over kinetic friction", "%", "above 2 %"},
       {"dry_constant", "dry sliding does not depend on speed", "Coulomb's third law, away from rest",
        "spread of the force from ten Stribeck velocities on, over kinetic friction", "%", "below 2 %"}},
      {"v[m/s]", "friction[N]"},
      &run_stribeck,
      {},
      &check_stribeck};
}

}  // namespace cli
