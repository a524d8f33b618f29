// Experiment on Coulomb's laws: how friction depends on the load, on the number of bristles, and on the
// apparent area.
#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/subject.hpp"

namespace cli {
namespace {

double steady_friction(const std::string& model, const Settings& s, double load, double highest_load) {
  Subject::Options options;
  options.highest_load_over_load = highest_load / s.number("load");
  Subject subject(model, s, options);
  // Length of a step, m. The odd factor keeps the snaps of the bristles from coinciding with the steps.
  const double step = 0.37 * s.number("presliding");
  const double dt = step / s.number("velocity");
  const auto settle = std::lround(s.number("settling") / 0.37),
             measure = std::lround(s.number("path") / 0.37);
  double sum = 0.0;
  for (long k = -settle; k < measure; ++k) {
    const double friction = -subject.step({step, 0.0}, dt, load).mean.x;
    if (k >= 0) sum += friction;
  }
  return sum / static_cast<double>(std::max(measure, 1L));
}

// Returns how many asperities touch (the paper's eq. 8) if the apparent area is `area_factor` times the
// default. Heights are quantiles of an exponential law (eq. 6). The surfaces come together until the springs
// carry the load (eq. 7 without its integral).
double asperities_touching(const Settings& s, double area_factor) {
  const double sigma = 1e-6;  // mean asperity height, m; does not affect the result
  const double normal_stiffness = 1.0 / (s.number("bristles_per_newton") * sigma);
  const double in_contact = s.number("bristles_per_newton") * s.number("load");
  const auto count =
      static_cast<std::size_t>(std::ceil(s.number("asperities_per_contact") * in_contact * area_factor));
  const auto height = [&](std::size_t i) {  // height of asperity number i from the top, m
    return -sigma * std::log((static_cast<double>(i) + 0.5) / static_cast<double>(count));
  };
  // Adds asperities in contact from the highest down, until the next one would touch only at a load above the
  // given one.
  double sum = 0.0;
  for (std::size_t n = 1; n < count; ++n) {
    sum += height(n - 1);
    const double carried = normal_stiffness * (sum - static_cast<double>(n) * height(n));
    if (carried >= s.number("load")) return static_cast<double>(n);
  }
  return static_cast<double>(count);
}

void slide_over_loads(ExperimentRun& run) {
  const Settings& s = run.settings;
  const std::vector<double>& loads = s.numbers("loads");
  const double highest = std::max(s.number("load"), *std::max_element(loads.begin(), loads.end()));
  // Compares with the coefficient at this speed, not with the kinetic one, because some models depend on
  // speed.
  const double coefficient = steady_friction(run.model, s, s.number("load"), highest) / s.number("load");
  double worst = 0.0;
  for (const double load : loads) {
    const double friction = steady_friction(run.model, s, load, highest);
    worst = std::max(worst, std::fabs(friction / load / coefficient - 1.0));
    run.add("load", {load, friction, friction / load});
  }
  run.add("proportional_to_load", 100.0 * worst, worst < 0.02);
}

void over_bristles(ExperimentRun& run) {
  Settings s = run.settings;
  const double load = s.number("load");
  double low = INFINITY, high = -INFINITY;
  for (const double n : run.settings.numbers("bristle_counts")) {
    s.set("bristles=" + std::to_string(static_cast<long>(n)));
    const double friction = steady_friction(run.model, s, load, load);
    low = std::min(low, friction);
    high = std::max(high, friction);
    run.add("bristles", {n, friction, friction / load});
  }
  const double spread = (high - low) / (s.number("kinetic") * load);
  run.add("representatives", 100.0 * spread, spread < 0.02);
}

void over_areas(ExperimentRun& run) {
  Settings s = run.settings;
  const double load = s.number("load");
  const double bristles_per_newton = s.number("bristles_per_newton");
  double low = INFINITY, high = -INFINITY;
  for (const double area : run.settings.numbers("areas")) {
    // Scales a brush's friction by the number of asperities that touch. Rival models do not know such a
    // number, so their friction stays.
    const double touching = asperities_touching(s, area) / (bristles_per_newton * load);
    const double friction =
        steady_friction(run.model, s, load, load) * (is_brush(run.model) ? touching : 1.0);
    low = std::min(low, friction);
    high = std::max(high, friction);
    run.add("area", {area, friction, friction / load});
  }
  const double spread = (high - low) / (s.number("kinetic") * load);
  run.add("area", 100.0 * spread, spread < 0.02);
}

void run_coulomb(ExperimentRun& run) {
  slide_over_loads(run);
  over_bristles(run);
  over_areas(run);
}

}  // namespace

Experiment coulomb_experiment() {
  return {
      "coulomb",
      "friction against load, number of bristles and apparent area",
      "Friction is proportional to the load, whatever the number of bristles and the apparent area",
      common_parameters({{"damping", 0.0}, {"viscous", 0.0}, {"bristles", 3600}}) +
          std::vector<Parameter>{
              list_parameter("loads", {0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0}, "N", "loads", 1e-6, 1e6),
              list_parameter("bristle_counts", {100, 300, 900, 3600, 14400}, "", "representatives", 1, 4e6),
              list_parameter("areas", {1.0, 3.0, 10.0, 30.0, 100.0}, "", "apparent areas, relative", 1e-2,
                             1e4),
              number_parameter("asperities_per_contact", 4.0, "",
                               "asperities of area 1 over bristles in contact", 2.0, 1e3),
              number_parameter("velocity", 1e-2, "m/s", "of the sliding", 1e-9, 1e3),
              number_parameter("settling", 20.0, "", "path before measuring, mean snap lengths", 1.0, 1e6),
              number_parameter("path", 300.0, "", "path measured, mean snap lengths", 1.0, 1e7)},
      {{"proportional_to_load", "friction is proportional to load", "Amontons 1699, Coulomb 1785",
        "largest deviation of friction over load from that at the common load", "%", "below 2 %"},
       {"representatives", "the number of simulated bristles does not matter",
        "none: a requirement of the brush's user",
        "highest less lowest friction at these numbers, over kinetic friction", "%", "below 2 %"},
       {"area", "the apparent area does not matter", "Amontons 1699; the paper, eqs. 6 to 9",
        "highest less lowest friction at areas of 1 to 100, over kinetic friction", "%", "below 2 %"}},
      {"value", "friction[N]", "friction_over_load"},
      &run_coulomb};
}

}  // namespace cli
