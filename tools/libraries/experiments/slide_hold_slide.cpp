// Experiment slide-hold-slide: a contact slides, is held, and slides again. Measures the peak after holds of
// different duration, and the force during the hold (Dieterich 1972; Marone 1998).
#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/sliding.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/line_fit.hpp"

namespace cli {
namespace {

struct Hold {
  double held = 0.0;     // friction when the hold begins, without dampers
  double relaxed = 0.0;  // friction when the hold ends
  double peak = 0.0;     // highest friction in sliding after the hold
  double path = 0.0;     // distance slid from the hold's end to the peak
};

Hold hold(ExperimentRun& run, double duration) {
  Subject subject(run.model, run.settings);
  const double dbar = run.number("presliding"), load = run.number("load"), speed = run.number("speed");
  const double kinetic = run.number("kinetic") * load;
  const double step = dbar / run.number("steps_per_length");
  const auto row = [&](double t, double x, double friction) {
    run.add("trace", {duration, t, x / dbar, friction / kinetic});
  };
  Hold found;
  row(0.0, 0.0, slide(subject, run.number("settling") * dbar, speed, step, load));
  // Makes the steps of the hold grow with time. They resolve a force that relaxes logarithmically.
  const int steps = 40;
  double t = 0.0;
  for (int k = 1; k <= steps; ++k) {
    const double next = duration * std::pow(10.0, -4.0 * (1.0 - static_cast<double>(k) / steps));
    found.relaxed = -subject.step({}, next - t, load).end.x;
    if (k == 1) found.held = found.relaxed;
    t = next;
    row(t, 0.0, found.relaxed);
  }
  slide(subject, run.number("path") * dbar, speed, step, load, [&](double x, double friction) {
    row(duration + x / speed, x, friction);
    if (friction > found.peak) {
      found.peak = friction;
      found.path = x;
    }
  });
  return found;
}

void run_slide_hold_slide(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double kinetic = s.number("kinetic") * s.number("load");
  std::vector<double> logarithms, peaks;
  Hold last;
  for (const double duration : s.numbers("holds")) {
    last = hold(run, duration);
    const double dbar = s.number("presliding");
    run.add("peak", {duration, last.path / s.number("speed"), last.path / dbar, last.peak / kinetic});
    logarithms.push_back(std::log(duration));
    peaks.push_back(last.peak / kinetic);
    run.progress(static_cast<double>(peaks.size()) / static_cast<double>(s.numbers("holds").size()));
  }
  const Line line = fit_line(logarithms, peaks);
  const double rise = line.slope * (logarithms.back() - logarithms.front());
  run.add("healing", 100.0 * line.slope, line.slope > 0.005 && line.worst < 0.2 * rise);
  const double relaxed = (last.held - last.relaxed) / kinetic;
  run.add("hold_relaxation", 100.0 * relaxed, relaxed > 0.01);
}

void check_slide_hold_slide(const Settings& settings) {
  const std::vector<double>& holds = settings.numbers("holds");
  if (holds.size() < 2 || !std::is_sorted(holds.begin(), holds.end(), std::less_equal<>()))
    throw UserError("experiment slide-hold-slide: holds must be two or more, ascending");
}

}  // namespace

Experiment slide_hold_slide_experiment() {
  return {
      "slide-hold-slide",
      "steady sliding, a hold, and sliding on: the peak over the duration of the hold",
      "Rate and state and the brush that ages grow stronger while they rest, and no other model does",
      common_parameters({{"bristles", 3600}}) +
          std::vector<Parameter>{
              number_parameter("speed", 1e-4, "m/s", "before and after the hold", 1e-9, 1e3),
              list_parameter("holds", {1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0}, "s",
                             "durations, ascending", 1e-6, 1e8),
              number_parameter("settling", 20.0, "", "path before the hold, presliding lengths", 1.0, 1e6),
              number_parameter("path", 4.0, "", "path after the hold, presliding lengths", 0.1, 1e4),
              number_parameter("steps_per_length", 100.0, "", "steps in a presliding length", 4.0, 1e5)},
      {{"healing", "the peak after a hold grows with its logarithm",
        "the peak after a hold grows in proportion to the logarithm of its duration (Dieterich 1972; Marone "
        "1998)",
        "slope of the peak over the logarithm of the hold, per e-fold, over kinetic friction", "%",
        "above 0.5 %, and no peak farther from the line than a fifth of the whole rise"},
       {"hold_relaxation", "the force relaxes while it is held",
        "held at rest, the force falls with the logarithm of time: contacts creep (Dieterich 1972; "
        "Marone 1998)",
        "friction a ten-thousandth into the hold less that at its end, longest hold, over kinetic friction",
        "%", "above 1 %"}},
      {"hold[s]", "t[s]", "x_over_presliding", "friction_over_kinetic"},
      &run_slide_hold_slide,
      {},
      &check_slide_hold_slide};
}

}  // namespace cli
