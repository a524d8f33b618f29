// Experiment on how friction follows a jump of the normal load, in sliding and at rest.
#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/subject.hpp"

namespace cli {
namespace {

class Contact {
 public:
  Contact(const ExperimentRun& run, double highest_over_load)
      : settings_(run.settings),
        subject_(run.model, settings_, {1, highest_over_load}),
        dbar_(settings_.number("presliding")) {}

  /// Slides `path` mean snap lengths under a load (N). Returns the friction at the end of the last step, N.
  double move(double path, double load) {
    const double largest = 1.0 / settings_.number("steps_per_length");
    const auto steps = std::max(1L, static_cast<long>(std::ceil(path / largest - 1e-9)));
    const double step = path * dbar_ / static_cast<double>(steps);
    for (long k = 0; k < steps; ++k)
      friction_ = -subject_.step({step, 0.0}, step / settings_.number("velocity"), load).end.x;
    return friction_;
  }
  double rest(double load) { return friction_ = -subject_.step({}, settings_.number("dt"), load).end.x; }
  /// Slides `path` mean snap lengths and returns the friction, N, averaged over the slide.
  double mean(double path, double load) {
    const auto steps = static_cast<long>(std::ceil(path * settings_.number("steps_per_length")));
    double sum = 0.0;
    for (long k = 0; k < steps; ++k) sum += move(path / static_cast<double>(steps), load);
    return sum / static_cast<double>(steps);
  }

 private:
  const Settings& settings_;
  Subject subject_;
  double dbar_, friction_ = 0.0;
};

void sliding(ExperimentRun& run, const std::string& panel, double factor) {
  const Settings& s = run.settings;
  const double load = s.number("load");
  Contact contact(run, std::max(1.0, factor));
  contact.move(s.number("settling"), load);
  const double before = contact.mean(1.0, load);
  const double per_length = s.number("steps_per_length");
  const double kinetic = s.number("kinetic") * load;
  double at_once = 0.0;
  run.add(panel, {0.0, contact.rest(load)});
  for (long k = 1; k <= std::lround(3.0 * per_length); ++k) {
    const double friction = contact.move(1.0 / per_length, factor * load);
    const double x = static_cast<double>(k) / per_length;
    if (k == 1) at_once = (friction - before) / ((factor - 1.0) * kinetic);
    run.add(panel, {x, friction});
  }
  if (factor > 1.0) run.add("load_up_sliding", 100.0 * at_once, at_once < 0.1);
}

void resting(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double load = s.number("load"), up = s.number("factor_up"), down = s.number("factor_rest_down");
  const auto bent = [&](double later, const char* panel) {
    Contact contact(run, std::max(1.0, later));
    const double before = contact.move(s.number("bend"), load);
    const double held = contact.rest(load);
    const double after = contact.rest(later * load);
    run.add(panel, {0.0, before});
    run.add(panel, {0.0, held});
    run.add(panel, {0.0, after});
    return std::pair(held, after);
  };
  const auto [held, raised] = bent(up, "rest_up");
  const double change = (raised - held) / (s.number("kinetic") * load);
  run.add("load_up_rest", 100.0 * change, std::fabs(change) < 0.01);
  const double left = bent(down, "rest_down").second / (down * load);
  const double most = std::max(s.number("static"), s.number("kinetic"));
  run.add("load_down_rest", left / most, left <= most * 1.001);
}

void run_load_step(ExperimentRun& run) {
  sliding(run, "up", run.number("factor_up"));
  sliding(run, "down", run.number("factor_down"));
  resting(run);
}

}  // namespace

Experiment load_step_experiment() {
  return {"load-step",
          "friction when the normal load jumps, in sliding and at rest",
          "Brushes follow a jump of the load over the presliding length, and keep the held force when the "
          "load rises",
          common_parameters({{"damping", 0.0}, {"viscous", 0.0}, {"bristles", 14400}}) +
              std::vector<Parameter>{
                  number_parameter("velocity", 1e-4, "m/s", "of the sliding", 1e-9, 1e3),
                  number_parameter("factor_up", 2.0, "", "load after a rise over load before", 1.01, 100.0),
                  number_parameter("factor_down", 0.5, "", "load after a fall in sliding", 0.01, 0.99),
                  number_parameter("factor_rest_down", 0.1, "", "load after a fall at rest", 0.01, 0.99),
                  number_parameter("bend", 0.25, "", "displacement before the rest, mean snap lengths", 0.01,
                                   100.0),
                  number_parameter("settling", 60.0, "", "path before the jump, mean snap lengths", 1.0, 1e6),
                  whole_parameter("steps_per_length", 100, "steps in a mean snap length", 10, 1e5)},
          {{"load_up_sliding", "friction follows a load jump over a path",
            "sliding friction follows a load jump over micrometres (Prakash 1998; Dieterich and Linker 1992, "
            "in part)",
            "share of the new friction after a hundredth of a presliding length", "%", "below 10 %"},
           {"load_up_rest", "more load at rest leaves the force as it is",
            "a load that rises at rest leaves the held force as it is (equilibrium)",
            "change of the held force, over kinetic friction", "%", "below 1 %"},
           {"load_down_rest", "less load holds less",
            "a contact holds no more than its static friction (Coulomb's law)",
            "held force after the load fell to a tenth, over static friction there", "", "at most 1"}},
          {"x_over_presliding", "friction[N]"},
          &run_load_step};
}

}  // namespace cli
