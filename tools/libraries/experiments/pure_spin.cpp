// Experiment: a disc turned from rest, with its torsional stiffness, peak, and friction against a pull.
#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/spin_subject.hpp"

namespace cli {
namespace {

/// Friction of a disc first pulled or turned from rest: a force, or torque over radius, N; > 0: resists.
struct FirstMotion {
  double slope = 0.0;  ///< stiffness over the first thousandth of a presliding length, N/m
  double peak = 0.0, steady = 0.0;
};

/// Pulls or turns a resting disc until its fastest point has moved `way` presliding lengths.
FirstMotion from_rest(ExperimentRun& run, bool turns) {
  const Settings& s = run.settings;
  const double radius = s.number("radius"), load = s.number("load"), dbar = s.number("presliding");
  const double full = s.number("kinetic") * load;
  const double first = 1e-3 * dbar, step = dbar / s.number("steps_per_length");
  SpinSubject subject(run.model, s, {ContactArea::Shape::disc, radius});
  const auto move = [&](double way) {
    const rivals::SpinForce f =
        subject.step({turns ? 0.0 : way, 0.0}, turns ? way / radius : 0.0, way / s.number("velocity"), load);
    return turns ? -f.end.torque / radius : -f.end.force.x;
  };
  FirstMotion found;
  found.slope = move(first) / first;
  const long steps = std::lround(s.number("way") * s.number("steps_per_length")), last = steps / 4;
  for (long k = 1; k <= steps; ++k) {
    const double friction = move(step);
    found.peak = std::max(found.peak, friction);
    if (k > steps - last) found.steady += friction / static_cast<double>(last);
    run.add(turns ? "turn" : "pull", {(first + static_cast<double>(k) * step) / dbar, friction / full});
  }
  return found;
}

/// Returns the highest friction of a slow pull on a spinning disc, over the steady friction of that pull.
double peak_while_spinning(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double radius = s.number("radius"), load = s.number("load"), dbar = s.number("presliding");
  const double full = s.number("kinetic") * load, per_length = s.number("steps_per_length");
  const double step = dbar / per_length, dt = step / s.number("velocity"), ratio = s.number("pull_ratio");
  SpinSubject subject(run.model, s, {ContactArea::Shape::disc, radius});
  for (long k = 0; k < std::lround(s.number("settling") * per_length); ++k)
    subject.step({}, step / radius, dt, load);
  // Uses as many steps as a pull without spin; each lasts longer, as the pull is slower than the spin.
  const long steps = std::lround(s.number("way") * per_length), last = steps / 4;
  double peak = 0.0, steady = 0.0;
  for (long k = 1; k <= steps; ++k) {
    // Uses the mean force of a step, so that the noise of a finite brush does not count as a peak.
    const double force = -subject.step({step, 0.0}, step / (ratio * radius), dt / ratio, load).mean.force.x;
    peak = std::max(peak, force);
    if (k > steps - last) steady += force / static_cast<double>(last);
    run.add("spinning", {static_cast<double>(k) / per_length, force / full});
  }
  return (peak - steady) / full;
}

void run_pure_spin(ExperimentRun& run) {
  const FirstMotion pull = from_rest(run, false);
  run.progress(0.2);
  const FirstMotion turn = from_rest(run, true);
  run.progress(0.4);
  const double spring = turn.slope / (0.5 * pull.slope);
  const double bends = pull.slope * run.number("presliding") / pull.steady;
  run.add("torsion_spring", spring, std::fabs(spring - 1.0) < 0.03 && bends < 10.0);
  const double peak = turn.peak / turn.steady;
  run.add("spin_peak", peak, peak > 1.02);
  const double share = peak / (pull.peak / pull.steady);
  run.add("spin_peak_share", share, share < 0.98);
  const double left =
      peak_while_spinning(run) * run.number("kinetic") * run.number("load") / (pull.peak - pull.steady);
  const bool has_peak = pull.peak > 1.02 * pull.steady;
  run.add("peak_lost", has_peak ? left : 0.0, has_peak && left < 0.5);
}

}  // namespace

Experiment pure_spin_experiment() {
  return {
      "pure-spin",
      "a disc turned from rest, and pulled while it spins",
      common_parameters({{"damping", 0.0}, {"viscous", 0.0}, {"bristles", 14400}}) + spin_parameters(11, 6) +
          std::vector<Parameter>{
              number_parameter("radius", 0.02, "m", "of the disc", 1e-6, 10.0),
              number_parameter("velocity", 1e-4, "m/s", "of the disc's fastest point", 1e-9, 1e3),
              number_parameter("way", 8.0, "", "way turned and pulled, mean snap lengths", 1.0, 1e4),
              whole_parameter("steps_per_length", 50, "steps in a mean snap length", 10, 1e4),
              number_parameter("settling", 20.0, "", "way spun before the pull, mean snap lengths", 1.0, 1e6),
              number_parameter("pull_ratio", 0.1, "", "velocity of the pull over that of the rim", 1e-3,
                               10.0)},
      {{"torsion_spring", "a torsion spring before it turns",
        "a sticking area of stiffness K resists a turn with K R^2 / 2",
        "first stiffness against a turn over K R^2 / 2", "", "within 3 % of 1, of a contact that bends"},
       {"spin_peak", "a peak of torque at the first turn",
        "it takes more to start than to go on, in a turn too (Farkas, Dahmen, Wolf, JSTAT 2005)",
        "highest torque of a first turn over the steady one", "", "above 1.02"},
       {"spin_peak_share", "and less of one than at the first pull",
        "the rim snaps before the middle: with one snap length 1.5, where a pull gives 2 (Farkas, Dahmen, "
        "Wolf, JSTAT 2005)",
        "peak over steady torque, over the ratio of the force of a first pull", "", "below 0.98"},
       {"peak_lost", "no static peak of the force while it spins",
        "a contact that slips has nothing left to break away (Farkas et al., PRL 90, 2003)",
        "rise of the force of a slow pull on the spinning disc above its steady value, over that from rest",
        "", "below 0.5, where there is a peak from rest"}},
      {"way_over_presliding", "friction_over_kinetic"},
      &run_pure_spin};
}

}  // namespace cli
