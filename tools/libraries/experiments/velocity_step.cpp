// Experiment on steps in speed, the test of rate-and-state friction: friction changes at once, then
// approaches its level at the new speed over a characteristic distance (Dieterich 1979; Ruina 1983).
#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/sliding.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

// Friction before and after a step of speed, over kinetic friction, averaged over repeats.
struct Step {
  double before = 0.0, after = 0.0;
  std::vector<double> friction;  // friction over kinetic friction, after each step of the path
};

// Friction in a step up in speed, and in the step back down.
struct Steps {
  Step up, down;
};

Steps steps_at(const std::string& model, const Settings& s, double speed) {
  Subject subject(model, s);
  const double dbar = s.number("presliding"), load = s.number("load");
  const double step = dbar / s.number("steps_per_length");
  const double share = 1.0 / (s.number("kinetic") * load * s.number("repeats"));
  Steps found;
  slide(subject, s.number("settling") * dbar, speed, step, load);
  double level = slide(subject, s.number("path") * dbar, speed, step, load);
  const auto jump = [&](Step& to, double new_speed) {
    to.before += share * level;
    std::size_t k = 0;
    level = slide(subject, s.number("path") * dbar, new_speed, step, load, [&](double, double friction) {
      if (to.friction.size() <= k) to.friction.push_back(0.0);
      to.friction[k++] += share * friction;
    });
    to.after += share * level;
  };
  for (double n = 0.0; n < s.number("repeats"); ++n) {
    jump(found.up, speed * s.number("factor"));
    jump(found.down, speed);
  }
  return found;
}

// Returns the number of steps after the peak within which friction has fallen by all but 1/e of its fall; 0
// if it does not fall so far.
double evolution_path(const Step& up) {
  const auto peak = std::max_element(up.friction.begin(), up.friction.end());
  const double highest = std::max(*peak, up.before);
  const auto from = *peak > up.before ? peak : up.friction.begin();
  const double level = up.after + (highest - up.after) * std::exp(-1.0);
  const auto there = std::find_if(from, up.friction.end(), [&](double f) { return f <= level; });
  return there == up.friction.end() ? 0.0 : static_cast<double>(there - from);
}

void run_velocity_step(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double e_folds = std::log(s.number("factor")), each = 1.0 / s.number("steps_per_length");
  // Least and greatest immediate change of friction (direct effect) over all steps of speed.
  double least = INFINITY, most = -INFINITY;
  double smallest_fall = INFINITY;  // least fall of friction by a step up in speed, per e-fold
  // Shortest and longest path over which friction settles after its peak.
  double shortest = INFINITY, longest = 0.0;
  const std::vector<double>& speeds = s.numbers("speeds");
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    const Steps found = steps_at(run.model, s, speeds[i]);
    for (const bool up : {true, false}) {
      const Step& step = up ? found.up : found.down;
      for (std::size_t k = 0; k < step.friction.size(); ++k)
        run.add(up ? "up" : "down",
                {speeds[i], each * static_cast<double>(k + 1), step.friction[k], step.before});
    }
    const double highest = *std::max_element(found.up.friction.begin(), found.up.friction.end());
    const double direct = (highest - found.up.before) / e_folds;
    const double fall = (found.up.before - found.up.after) / e_folds;
    const double path = each * evolution_path(found.up);
    run.add("step", {speeds[i], path, direct, fall});
    least = std::min(least, direct);
    most = std::max(most, direct);
    smallest_fall = std::min(smallest_fall, fall);
    shortest = std::min(shortest, path);
    longest = std::max(longest, path);
    run.progress(static_cast<double>(i + 1) / static_cast<double>(speeds.size()));
  }
  run.add("direct_effect", 100.0 * least, least > 0.005 && most < 2.0 * least);
  run.add("speed_fall", 100.0 * smallest_fall, smallest_fall > 0.005);
  const bool falls = smallest_fall > 0.005;
  run.add("evolution_path", falls ? shortest : 0.0,
          falls && shortest > 0.05 && longest < 5.0 && longest < 1.5 * shortest);
}

void check_velocity_step(const Settings& settings) {
  if (settings.numbers("speeds").size() < 2)
    throw UserError("experiment velocity-step: speeds must be two or more: a path must be told from a time");
}

}  // namespace

Experiment velocity_step_experiment() {
  return {
      "velocity-step",
      "steady sliding, and a step in its speed",
      "Rate and state first jumps up and then falls over a path, and the brush that ages falls alike",
      common_parameters({{"bristles", 14400}, {"resolution", 32.0}}) +
          std::vector<Parameter>{
              list_parameter("speeds", {1e-5, 1e-4}, "m/s", "before the step up, two or more", 1e-9, 1e3),
              number_parameter("factor", 3.0, "", "speed after the step over that before", 1.0001, 1e6),
              number_parameter("settling", 20.0, "", "path before the steps, presliding lengths", 1.0, 1e6),
              number_parameter("path", 10.0, "", "path after a step, presliding lengths", 1.0, 1e5),
              whole_parameter("repeats", 10, "steps up and down, averaged", 1, 1e5),
              number_parameter("steps_per_length", 50.0, "", "steps in a presliding length", 4.0, 1e5)},
      {{"direct_effect", "a step up in speed first raises friction",
        "friction grows at once with the logarithm of the speed (Dieterich 1979; Ruina 1983)",
        "highest friction after the step less that before it, per e-fold of speed, over kinetic friction, "
        "the least of all speeds",
        "%", "above 0.5 %, and at no speed twice as much"},
       {"speed_fall", "and then lowers it, from slow speeds on",
        "friction of rock, paper, polymers and metals falls with the logarithm of speed "
        "(Dieterich 1979; Heslot et al. 1994)",
        "friction before the step less that long after, per e-fold of speed, over kinetic friction, least of "
        "the speeds",
        "%", "above 0.5 %"},
       {"evolution_path", "over a path, whatever the speed",
        "friction reaches its new level over a path that does not depend on the speed (Rabinowicz 1951; "
        "Dieterich 1979)",
        "path from the highest friction after the step until 1/e of the fall is left, shortest of the speeds",
        "", "0.05 to 5, and at no speed 1.5 times as long"}},
      {"speed[m/s]", "x_over_presliding", "friction_over_kinetic", "before_over_kinetic"},
      &run_velocity_step,
      {},
      &check_velocity_step};
}

}  // namespace cli
