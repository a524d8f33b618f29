// Experiment: a square plate rubbing on a floor is turned about one corner, then holds a wavering moment.
#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/spin_subject.hpp"

namespace cli {
namespace {

/// Mean distance of a unit square's points from a corner: torque over friction when it turns about it.
const double mean_arm = (std::sqrt(2.0) + std::asinh(1.0)) / 3.0;

/// Square plate that can only turn about one of its corners.
class HeldPlate {
 public:
  HeldPlate(const std::string& model, const Settings& s)
      : subject_(model, s, {ContactArea::Shape::square, 0.5 * s.number("side")}),
        half_(0.5 * s.number("side")),
        load_(s.number("load")) {}

  struct Moment {
    double end = 0.0, mean = 0.0;  ///< friction torque on the plate about the corner, N m
  };
  Moment turn(double angle, double dt_s) {
    const rivals::Turn centre(turned_, angle);
    const rivals::SpinForce f = subject_.step(centre.way(half_, half_), angle, dt_s, load_);
    turned_ += angle;
    return {f.end.torque + rivals::cross(centre.end_arm(half_, half_), f.end.force),
            f.mean.torque + rivals::cross(centre.mean_arm(half_, half_), f.mean.force)};
  }

  double turned() const noexcept { return turned_; }

 private:
  SpinSubject subject_;
  double half_, load_;
  double turned_ = 0.0;
};

/// Returns the friction force (N) on the plate in steady sliding without turning.
double sliding_friction(const std::string& model, const Settings& s) {
  SpinSubject subject(model, s, {ContactArea::Shape::square, 0.5 * s.number("side")});
  const double step = 0.37 * s.number("presliding"), dt = step / s.number("velocity");
  const auto settle = std::lround(s.number("settling") / 0.37), measure = std::lround(s.number("way") / 0.37);
  double sum = 0.0;
  for (long k = -settle; k < measure; ++k) {
    const double friction = -subject.step({step, 0.0}, 0.0, dt, s.number("load")).mean.force.x;
    if (k >= 0) sum += friction;
  }
  return sum / static_cast<double>(measure);
}

void turn_steadily(ExperimentRun& run) {
  const double side = run.number("side");
  const double step = 0.37 * run.number("presliding"), dt = step / run.number("velocity");
  const double angle = step / (std::sqrt(2.0) * side);
  const auto settle = std::lround(run.number("settling") / 0.37),
             measure = std::lround(run.number("way") / 0.37);
  HeldPlate plate(run.model, run.settings);
  double sum = 0.0;
  for (long k = -settle; k < measure; ++k) {
    const double moment = -plate.turn(angle, dt).mean;
    if (k >= 0) sum += moment;
  }
  const double share =
      sum / static_cast<double>(measure) / (sliding_friction(run.model, run.settings) * side * mean_arm);
  run.add("corner_moment", share, std::fabs(share - 1.0) < 0.01);
}

void hold(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double side = s.number("side"), dt = s.number("dt"), load = s.number("load");
  const double inertia = 2.0 / 3.0 * load / 9.81 * side * side;
  const double full = s.number("kinetic") * load * side * mean_arm;
  const auto per_cycle = std::lround(1.0 / (s.number("frequency") * dt));
  const auto cycles = std::lround(s.number("cycles")), settling = std::lround(s.number("first_cycles"));
  HeldPlate plate(run.model, s);
  double spin = 0.0, begin = 0.0;
  for (long k = 0; k < (settling + cycles) * per_cycle; ++k) {
    if (k == settling * per_cycle) begin = plate.turned();
    const double phase = 2.0 * M_PI * static_cast<double>(k % per_cycle) / static_cast<double>(per_cycle);
    const double applied = full * (s.number("held") - s.number("wavers") * std::cos(phase));
    spin += dt * (applied + plate.turn(dt * spin, dt).end) / inertia;
    if (k % std::max(1L, per_cycle / 20) == 0)
      run.add("hold", {static_cast<double>(k) * dt, applied / full, 1e6 * side * plate.turned()});
  }
  const double drift = (plate.turned() - begin) * side / static_cast<double>(cycles);
  run.add("corner_holds", 1e6 * drift, std::fabs(drift) < 1e-3 * s.number("presliding"));
}

void run_held_corner(ExperimentRun& run) {
  turn_steadily(run);
  run.progress(0.5);
  hold(run);
}

}  // namespace

Experiment held_corner_experiment() {
  return {
      "held-corner",
      "a square plate held at one corner, turned about it and left to hold",
      common_parameters({{"dt", 1e-4}, {"viscous", 0.0}, {"bristles", 14400}}) + spin_parameters(11, 3) +
          std::vector<Parameter>{
              number_parameter("side", 0.05, "m", "of the plate, whose mass the load is", 1e-6, 10.0),
              number_parameter("velocity", 0.1, "m/s", "of the far corner", 1e-9, 1e3),
              number_parameter("settling", 40.0, "",
                               "way of the far corner before measuring, mean snap lengths", 1.0, 1e6),
              number_parameter("way", 25.0, "", "way of the far corner measured, mean snap lengths", 1.0,
                               1e7),
              number_parameter("held", 0.5, "", "moment, over that of sliding", 0.0, 1.0),
              number_parameter("wavers", 0.3, "", "by how much it wavers, over that of sliding", 0.0, 1.0),
              number_parameter("frequency", 10.0, "1/s", "of the moment", 1e-3, 1e3),
              whole_parameter("first_cycles", 10, "cycles before measuring", 0, 1e4),
              whole_parameter("cycles", 10, "cycles measured", 1, 1e5)},
      {{"corner_moment", "it resists with its mean distance from the corner",
        "by Coulomb's law mu N times the mean distance, 0.7652 of the side of a square",
        "steady moment about the corner, over friction times that distance", "", "within 1 % of 1"},
       {"corner_holds", "it does not turn under a wavering moment",
        "a force that wavers below break-away moves nothing permanently (Dupont et al. 2002)",
        "path of the plate's edge per cycle, moment between 0.2 and 0.8 of that of sliding", "um",
        "below a thousandth of the presliding length"}},
      {"t[s]", "moment_over_sliding", "way_of_edge[um]"},
      &run_held_corner};
}

}  // namespace cli
