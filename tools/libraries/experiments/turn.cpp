// Experiment on steady sliding that continues in a new direction in the plane.
#include <cmath>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/subject.hpp"

namespace cli {
namespace {

using rivals::Pair;

void turn(ExperimentRun& run, double degrees) {
  const Settings& s = run.settings;
  const double load = s.number("load"), dbar = s.number("presliding"), speed = s.number("velocity");
  const double per_length = s.number("steps_per_length");
  const double step = dbar / per_length, dt = step / speed;
  const double kinetic = s.number("kinetic") * load;
  const double a = degrees * M_PI / 180.0;
  // Unit vectors of the motion before and after it turns by `degrees`.
  const Pair old_way{1.0, 0.0}, new_way{std::cos(a), std::sin(a)};
  Subject subject(run.model, s, {2, 1.0});
  for (long k = 0; k < std::lround(s.number("settling") * per_length); ++k)
    subject.step(step * old_way, dt, load);
  const double old_share = dot(old_way, new_way);
  double half = -1.0, reversed = -1.0;
  Pair force = -subject.find_force(step * old_way, dt, load).end;
  const Pair sideways_axis{-new_way.y, new_way.x};
  const double sideways_0 = dot(force, sideways_axis);
  for (long k = 0; k <= std::lround(s.number("way") * per_length); ++k) {
    if (k > 0) force = -subject.step(step * new_way, dt, load).end;
    const double y = static_cast<double>(k) / per_length;
    const double along = dot(force, new_way), aside = dot(force, sideways_axis);
    run.add("turn", {degrees, y, along / kinetic, aside / kinetic});
    if (half < 0.0 && std::fabs(aside) <= 0.5 * std::fabs(sideways_0)) half = y;
    if (reversed < 0.0 && along >= 0.0) reversed = y;
  }
  if (degrees == 90.0) {
    run.add("turn", half, half > 0.05 && half < 3.0);
  } else if (degrees == 180.0 && old_share < 0.0) {
    run.add("reversal", reversed, reversed > 0.05 && reversed < 3.0);
  }
}

void run_turn(ExperimentRun& run) {
  for (const double degrees : run.settings.numbers("turns")) turn(run, degrees);
}

}  // namespace

Experiment turn_experiment() {
  return {"turn",
          "steady sliding, then a new direction in the plane",
          common_parameters({{"damping", 0.0}, {"viscous", 0.0}, {"bristles", 14400}}) +
              std::vector<Parameter>{
                  number_parameter("velocity", 1e-4, "m/s", "of the sliding", 1e-9, 1e3),
                  list_parameter("turns", {90.0, 180.0}, "deg", "new directions; 90 and 180 are judged", 1.0,
                                 180.0),
                  number_parameter("settling", 60.0, "", "way before the turn, mean snap lengths", 1.0, 1e6),
                  number_parameter("way", 4.0, "", "way after it, mean snap lengths", 0.1, 1e4),
                  whole_parameter("steps_per_length", 50, "steps in a mean snap length", 10, 1e5)},
          {{"turn", "friction turns over a path",
            "after a turn the friction vector turns over the presliding length (Xia 2003)",
            "path over which the sideways force halves after a turn of 90 degrees, in presliding lengths", "",
            "0.05 to 3"},
           {"reversal", "friction reverses over a path",
            "after a reversal friction changes its sign over the presliding length (Dahl 1968)",
            "path to zero force after a turn of 180 degrees, in presliding lengths", "", "0.05 to 3"}},
          {"turn[deg]", "y_over_presliding", "along_over_kinetic", "aside_over_kinetic"},
          &run_turn};
}

}  // namespace cli
