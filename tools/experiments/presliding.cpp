// Experiment on presliding: the first pull, hysteresis loops with reversals inside reversals, and the
// deflection that remains after release.
#include <algorithm>
#include <cmath>

#include "tools/experiments/experiment.hpp"
#include "tools/experiments/subject.hpp"

namespace cli {
namespace {

// Contact that is moved by displacement at constant speed; it records its position and friction.
class Path {
 public:
  Path(const ExperimentInput& input, const std::string& model, std::string panel, ExperimentResult& result)
      : subject_(model, input.settings),
        panel_(std::move(panel)),
        load_(input.settings.number("load")),
        speed_(input.settings.number("velocity")),
        step_(input.settings.number("presliding") / input.settings.number("steps_per_length")),
        result_(result) {}

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
      if (k % 10 == 0 || k == steps || stops) result_.add(panel_, subject_.name(), {x_, friction_});
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
  Subject subject_;
  std::string panel_;
  double load_, speed_, step_;
  ExperimentResult& result_;
  double x_ = 0.0, friction_ = 0.0, work_ = 0.0;
};

// Pulls a contact that has never moved. Returns the highest friction (N).
double virgin(const ExperimentInput& input, const std::string& model, ExperimentResult& result) {
  const double dbar = input.settings.number("presliding");
  const double kinetic = input.settings.number("kinetic") * input.settings.number("load");
  Path path(input, model, "virgin", result);
  double peak = 0.0, at_tenth = 0.0;
  path.move_to(0.1 * dbar);
  at_tenth = path.friction();
  path.move_to(8.0 * dbar, [&](double friction) {
    peak = std::max(peak, friction);
    return false;
  });
  const double share = at_tenth / kinetic;
  result.add("presliding", model, 100.0 * share, share > 0.02 && share < 0.6);
  return peak;
}

void loops(const ExperimentInput& input, const std::string& model, ExperimentResult& result) {
  const Settings& s = input.settings;
  const double dbar = s.number("presliding");
  const double kinetic = s.number("kinetic") * s.number("load");
  // Runs hysteresis loops of growing width. Measures the energy lost in the second round of the widest.
  {
    Path path(input, model, "loops", result);
    for (const double width : {0.3, 0.5, 0.7}) {
      for (int round = 0; round < 2; ++round) {
        const double before = path.work();
        path.move_to(width * dbar);
        path.move_to(-width * dbar);
        if (width == 0.7 && round == 1) {
          path.move_to(width * dbar);
          path.move_to(-width * dbar);
          const double lost = (path.work() - before) / (2.0 * 4.0 * width * dbar * kinetic);
          result.add("hysteresis", model, 100.0 * lost, lost > 0.02);
        }
      }
    }
  }
  // Runs a loop inside a loop: to 0.6, 0.2, 0.4, 0.2, and back to 0.6 presliding lengths.
  Path path(input, model, "nested", result);
  path.move_to(0.6 * dbar);
  const double outer = path.friction();
  path.move_to(0.2 * dbar);
  const double inner = path.friction();
  path.move_to(0.4 * dbar);
  path.move_to(0.2 * dbar);
  double miss = std::fabs(path.friction() - inner);
  path.move_to(0.6 * dbar);
  miss = std::max(miss, std::fabs(path.friction() - outer));
  result.add("return_point", model, 100.0 * miss / kinetic, miss < 0.005 * kinetic);
}

void permanent_set(const ExperimentInput& input, const std::string& model, double peak,
                   ExperimentResult& result) {
  const Settings& s = input.settings;
  const double dbar = s.number("presliding");
  const double target = s.number("set_share") * peak;
  Path path(input, model, "set", result);
  path.move_to(8.0 * dbar, [&](double friction) { return friction >= target; });
  const double furthest = path.x();
  path.move_to(furthest - 8.0 * dbar, [](double friction) { return friction <= 0.0; });
  const double left = path.x() / dbar;
  result.add("permanent_set", model, left, left > 0.02 && furthest - path.x() > 0.01 * dbar);
}

void run_presliding(const ExperimentInput& input, const std::string& model, ExperimentResult& result) {
  const double peak = virgin(input, model, result);
  loops(input, model, result);
  permanent_set(input, model, peak, result);
}

}  // namespace

Experiment presliding_experiment() {
  return {
      "presliding",
      "first pull, hysteresis loops with nested reversals, permanent set",
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
