// Experiment on a geared joint that is held, driving, driven, and reversed. The friction of rival models does
// not depend on torque; the brush with the slide rule is a JointFriction.
#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/body.hpp"
#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/subject.hpp"
#include "tools/libraries/scene/waveform.hpp"

namespace cli {
namespace {

/// Returns the friction torque (N m) while lifting the rated weight. Rival models have this friction at any
/// weight.
double full_friction(const Settings& s) { return s.number("kinetic") * s.number("load"); }

bristle::JointMaterial gear_of(const Settings& s, bool drops) {
  const double full = full_friction(s), driving = (1.0 - s.number("unloaded")) * full / s.number("rated");
  bristle::JointMaterial gear;
  gear.stiffness = s.number("stiffness");
  gear.viscous = s.number("viscous");
  gear.kinetic.base = s.number("unloaded") * full;
  gear.kinetic.outside[bristle::joint_driving] = driving;
  gear.kinetic.outside[bristle::joint_driven] = driving * s.number("driven_over_driving");
  if (!drops) return gear;
  gear.static_part.base = std::max(s.number("static") * s.number("load") - full, 0.0);
  gear.stribeck_speed = s.number("stribeck_velocity");
  return gear;
}

Subject joint_of(const std::string& model, const Settings& s) {
  const bristle::JointMaterial gear = gear_of(s, model == "brush_slide_drop");
  Subject::Options options;
  if (model.starts_with("brush_slide")) options.joint = &gear;
  return Subject(model, s, options);
}

struct Strokes {
  double up = 0.0, down = 0.0;  ///< steady friction torque in lifting and lowering, N m
  double reversed = -1.0;       ///< angle from reversal to zero friction, in presliding lengths
};

/// Lifts a weight slowly by the joint and lowers it again. Measures steady friction upwards and downwards.
Strokes lift(ExperimentRun& run, double weight, bool draws) {
  const Settings& s = run.settings;
  const double length = s.number("presliding"), per_length = 50.0;
  const double step = length / per_length, dt = step / s.number("velocity"), full = full_friction(s);
  const long steps = std::lround(12.0 * per_length), last = steps / 4;
  Subject joint = joint_of(run.model, s);
  Strokes found;
  double friction = 0.0;
  for (const int direction : {1, -1}) {
    double& steady = direction > 0 ? found.up : found.down;
    for (long k = 1; k <= steps; ++k) {
      joint.set_torques(weight + friction, -weight);  // balances weight and friction by the motor's torque
      const double before = friction;
      const rivals::Force force = joint.step({direction * step, 0.0}, dt, s.number("load"));
      friction = -force.end.x;
      if (k > steps - last) steady -= force.mean.x / static_cast<double>(last) * direction;
      const double turned = static_cast<double>(k) / per_length;
      if (direction < 0 && found.reversed < 0.0 && friction <= 0.0)
        found.reversed = turned - friction / (friction - before) / per_length;
      if (draws && direction < 0 && turned <= 4.0) run.add("reverse", {turned, friction / full, 0.0});
    }
  }
  return found;
}

/// Holds the arm of a joint against the rated torque of its motor, while the net torque wavers below
/// friction. Returns the arm's creep per cycle, rad.
double hold_arm(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double dt = s.number("dt"), full = full_friction(s), rated = s.number("rated");
  const long steps = std::max(20L, std::lround(0.5 / dt));
  Subject joint = joint_of(run.model, s);
  SlidingBlock arm(0.01);             // arm of the joint as a body with this moment of inertia, kg m^2
  constexpr std::size_t cycles = 10;  // number of load cycles; in the first the torque rises from 0
  double mean[cycles] = {};
  for (long k = 0; k < static_cast<long>(cycles) * steps; ++k) {
    const double turns = (static_cast<double>(k) + 0.5) / static_cast<double>(steps);
    const double net = full * std::min(turns, 1.0) * (0.5 + 0.3 * sine_of_turns(turns));
    joint.set_torques(rated, net - rated);
    arm.advance(joint, {net}, dt, s.number("load"));
    mean[static_cast<std::size_t>(k / steps)] += arm.position() / static_cast<double>(steps);
    if (k % std::max(1L, steps / 50) == 0)
      run.add("hold", {turns, net / full, arm.position() / s.number("presliding")});
  }
  return mean[cycles - 1] - mean[cycles - 2];
}

void run_joint(ExperimentRun& run) {
  const Settings& s = run.settings;
  const std::vector<double>& weights = s.numbers("weights");
  const double full = full_friction(s);
  Strokes first, rated;
  for (const double share : weights) {
    rated = lift(run, share * s.number("rated"), share == weights.back());
    if (share == weights.front()) first = rated;
    run.add("drive", {share, rated.up / full, rated.down / full});
  }
  run.progress(0.5);
  run.add("joint_load", rated.up / first.up, rated.up > 1.05 * first.up);
  run.add("joint_direction", rated.down / rated.up, rated.down > 1.1 * rated.up);
  run.add("joint_reverse", rated.reversed, rated.reversed > 0.05 && rated.reversed < 3.0);
  const double creep = hold_arm(run);
  run.add("joint_hold", 1e6 * creep, std::fabs(creep) < 1e-3 * s.number("presliding"));
}

}  // namespace

Experiment joint_experiment() {
  return {
      "joint",
      "a geared joint (N m and rad: at a lever of 1 m): held, driving, driven, turned back",
      "Friction of the library's joints, shown for the sliding brushes, grows with the transmitted torque "
      "and with its direction",
      common_parameters({{"stiffness", 1e3},
                         {"presliding", 2e-3},
                         {"damping", 3.0},
                         {"viscous", 0.0},
                         {"stribeck_velocity", 2e-3},
                         {"creep_velocity", 1e-3},
                         {"state_length", 2e-3},
                         {"bristles", 3600}}) +
          std::vector<Parameter>{
              number_parameter("rated", 4.0, "N m", "torque of the greatest weight", 1e-6, 1e9),
              list_parameter("weights", {0.0, 0.25, 0.5, 0.75, 1.0}, "",
                             "lifted and let down, shares of it; the last over the first decides", 0.0, 1.0),
              number_parameter("unloaded", 0.2, "", "share of friction without a weight: the joint's", 0.0,
                               1.0),
              number_parameter("driven_over_driving", 1.75, "",
                               "losses driven over losses driving: the joint's", 0.0, 10.0),
              number_parameter("velocity", 0.01, "rad/s", "of lifting", 1e-9, 1e3)},
      {{"joint_load", "friction grows with the torque that a gear transmits",
        "measured on six servos (Duclusaud, Passault, Padois, Ly, ICRA 2025)",
        "friction of lifting the rated weight over that of lifting none", "", "above 1.05"},
       {"joint_direction", "and is larger when the weight drives the gear",
        "the same source: drive and backdrive differ", "friction of letting it down over that of lifting it",
        "", "above 1.1"},
       {"joint_reverse", "it reverses over an angle",
        "after a reversal friction changes its sign over the presliding length (Dahl 1968)",
        "angle to zero friction after the turn, in presliding lengths", "", "0.05 to 3"},
       {"joint_hold", "a held arm does not creep when it is shaken",
        "what wavers below break-away moves nothing for good (Dupont et al. 2002)",
        "path in a cycle of a net torque between 0.2 and 0.8 of friction", "urad",
        "below a thousandth of the presliding length"}},
      {"weight_or_lengths_or_cycles", "friction_or_torque_over_full", "driven_or_angle_over_presliding"},
      &run_joint};
}

}  // namespace cli
