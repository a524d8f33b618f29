// Experiment on presliding: the first pull, hysteresis loops with reversals inside reversals, and the
// deflection that remains after release.
#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/subject.hpp"

namespace cli {
namespace {

// Contact that is moved by displacement at constant speed; it records its position and friction.
class Path {
 public:
  Path(ExperimentRun& run, std::string panel)
      : run_(run),
        subject_(run.model, run.settings),
        panel_(std::move(panel)),
        load_(run.number("load")),
        speed_(run.number("velocity")),
        step_(run.number("presliding") / run.number("steps_per_length")) {}

  /// Moves to position x (m), or until `stop(friction)` is true. The last step is shortened to end at x.
  template <class Stop>
  void move_to(double x, const Stop& stop) {
    const auto steps = static_cast<long>(std::ceil(std::fabs(x - x_) / step_ - 1e-9));
    const double from = x_;
    for (long k = 1; k <= steps; ++k) {
      const double next = from + (x - from) * static_cast<double>(k) / static_cast<double>(steps);
      const double dt = std::fabs(next - x_) / speed_;
      friction_ = -subject_.step({next - x_, 0.0}, dt, load_).end.x;
      work_ += friction_ * (next - x_);
      x_ = next;
      const bool stops = stop(friction_);
      if (k % 10 == 0 || k == steps || stops) run_.add(panel_, {x_, friction_});
      if (stops) return;
    }
  }
  void move_to(double x) {
    move_to(x, [](double) { return false; });
  }
  double x() const noexcept { return x_; }
  double friction() const noexcept { return friction_; }
  double work() const noexcept { return work_; }

 private:
  ExperimentRun& run_;
  Subject subject_;
  std::string panel_;
  double load_, speed_, step_;
  double x_ = 0.0, friction_ = 0.0, work_ = 0.0;
};

// Pulls a contact that has never moved. Returns the highest friction (N).
double virgin(ExperimentRun& run) {
  const double dbar = run.number("presliding");
  const double kinetic = run.number("kinetic") * run.number("load");
  Path path(run, "virgin");
  double peak = 0.0, at_tenth = 0.0;
  path.move_to(0.1 * dbar);
  at_tenth = path.friction();
  path.move_to(8.0 * dbar, [&](double friction) {
    peak = std::max(peak, friction);
    return false;
  });
  const double share = at_tenth / kinetic;
  run.add("presliding", 100.0 * share, share > 0.02 && share < 0.6);
  return peak;
}

void loops(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double dbar = s.number("presliding");
  const double kinetic = s.number("kinetic") * s.number("load");
  // Runs hysteresis loops of growing width, and measures the energy lost in the second round of the widest.
  {
    Path path(run, "loops");
    for (const double width : {0.3, 0.5, 0.7}) {
      for (int round = 0; round < 2; ++round) {
        const double before = path.work();
        path.move_to(width * dbar);
        path.move_to(-width * dbar);
        if (width == 0.7 && round == 1) {
          path.move_to(width * dbar);
          path.move_to(-width * dbar);
          const double lost = (path.work() - before) / (2.0 * 4.0 * width * dbar * kinetic);
          run.add("hysteresis", 100.0 * lost, lost > 0.02);
        }
      }
    }
  }
  // Runs a loop inside a loop: to 0.6, 0.2, 0.4, 0.2, and back to 0.6 presliding lengths.
  Path path(run, "nested");
  path.move_to(0.6 * dbar);
  const double outer = path.friction();
  path.move_to(0.2 * dbar);
  const double inner = path.friction();
  path.move_to(0.4 * dbar);
  path.move_to(0.2 * dbar);
  double miss = std::fabs(path.friction() - inner);
  path.move_to(0.6 * dbar);
  miss = std::max(miss, std::fabs(path.friction() - outer));
  run.add("return_point", 100.0 * miss / kinetic, miss < 0.005 * kinetic);
}

void permanent_set(ExperimentRun& run, double peak) {
  const Settings& s = run.settings;
  const double dbar = s.number("presliding");
  const double target = s.number("set_share") * peak;
  Path path(run, "set");
  path.move_to(8.0 * dbar, [&](double friction) { return friction >= target; });
  const double furthest = path.x();
  path.move_to(furthest - 8.0 * dbar, [](double friction) { return friction <= 0.0; });
  const double left = path.x() / dbar;
  run.add("permanent_set", left, left > 0.02 && furthest - path.x() > 0.01 * dbar);
}

void run_presliding(ExperimentRun& run) {
  const double peak = virgin(run);
  loops(run);
  permanent_set(run, peak);
}

}  // namespace

Experiment presliding_experiment() {
  return {
      "presliding",
      "first pull, hysteresis loops with nested reversals, permanent set",
      "Brushes first pull like springs, lose energy in loops, and return from an inner loop to the outer one",
      common_parameters({{"damping", 0.0}, {"viscous", 0.0}, {"bristles", 3600}}) +
          std::vector<Parameter>{
              number_parameter("velocity", 1e-5, "m/s", "of the motion", 1e-9, 1.0),
              whole_parameter("steps_per_length", 1000, "steps in a mean snap length", 10, 1e5),
              number_parameter("set_share", 0.95, "", "of the model's own peak force, before letting go",
                               0.01, 0.999)},
      {{"presliding", "a spring before it slides",
        "tangential force grows gradually with micrometres of displacement (Courtney-Pratt and Eisner 1957)",
        "force after a tenth of the presliding length, over kinetic friction", "%", "between 2 and 60 %"},
       {"hysteresis", "loops lose energy",
        "force over displacement runs in loops (Courtney-Pratt and Eisner 1957)",
        "area of a loop of 0.7 presliding lengths to either side, over that of rigid Coulomb friction", "%",
        "above 2 %"},
       {"return_point", "inner loops close",
        "after an inner loop the outer one continues as if uninterrupted (Swevers et al. 2000)",
        "force missed at the two points of return, over kinetic friction", "%", "below 0.5 %"},
       {"permanent_set", "a permanent displacement after release",
        "released near break-away, the block springs back in part (Courtney-Pratt and Eisner 1957)",
        "displacement left, in presliding lengths", "", "above 0.02, and it springs back by 0.01"}},
      {"x[m]", "friction[N]"},
      &run_presliding};
}

}  // namespace cli
