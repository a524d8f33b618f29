// Experiment: the critical stiffness of stick-slip, which is the spring stiffness below which a slider pulled
// slowly does not slide steadily. Found twice: by bisection on a simulated slider, and by linear theory
// from the force after a small step in speed (Rice and Ruina 1983; Heslot et al. 1994).
//
// A slider of mass m on a spring k, pulled at v, whose friction answers a small change of speed dv(t) by
// dF(s) = Z(s) dv(s): m s^2 + k + s Z(s) = 0. On the imaginary axis Re Z(i w) = 0 and k = m w^2 + w Im Z(i
// w); the largest such k is critical. Z follows from the force R(t) after a step of one unit of speed, taken
// at prescribed motion: Z(i w) = integral of exp(-i w t) dR(t).
#include <algorithm>
#include <cmath>
#include <complex>

#include "tools/libraries/experiments/body.hpp"
#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/sliding.hpp"

namespace cli {
namespace {

struct Response {
  std::vector<double> t, force;  // times (s) after a step of speed, and changes of the friction force over
                                 // the step (N s/m)
  double at_once() const { return force.front(); }
  double limit() const { return force.back(); }
};

// Measures the force after a step in speed, as half the difference of a step up and a step down over the same
// path: nonlinear terms cancel, and so does the motion without a step. The step is large against the ripples
// of a finite brush, and is taken per e-fold of speed, so that friction logarithmic in the speed gives a
// linear response.
Response measure_response(const std::string& model, const Settings& s, double speed) {
  const double dbar = s.number("presliding"), load = s.number("load"), step = s.number("response_step");
  const double each = dbar / s.number("steps_per_length");
  Subject up(model, s), down(model, s);
  for (Subject* subject : {&up, &down}) slide(*subject, s.number("settling") * dbar, speed, each, load);
  Response r;
  const auto steps = static_cast<long>(std::lround(s.number("response_way") * s.number("steps_per_length")));
  double x = 0.0;
  for (long k = 0; k <= steps; ++k) {
    const double way = k == 0 ? 1e-5 * each : each;  // a tiny first step: it measures the immediate response
    const double fast = up.step({way, 0.0}, way / (speed * (1.0 + step)), load).end.x;
    const double slow = down.step({way, 0.0}, way / (speed * (1.0 - step)), load).end.x;
    x += way;
    r.t.push_back(x / speed);
    r.force.push_back(-0.5 * (fast - slow) / (std::atanh(step) * speed));
  }
  return r;
}

// Returns Z(i w), the force per unit of speed that swings at frequency w, for a response that is linear
// between its samples. A Gaussian-like window over about six swings removes the ripples of a finite brush; a
// smooth response has decayed by then. The window averages Z over frequencies within a sixth. Its flat top
// changes a Z that is a power of w by at most 0.2 %.
std::complex<double> impedance(const Response& r, double w) {
  constexpr double width = 0.15;
  std::complex<double> z = r.at_once();
  for (std::size_t i = 1; i < r.t.size(); ++i) {
    const double middle = 0.5 * w * (r.t[i - 1] + r.t[i]), half = 0.5 * w * (r.t[i] - r.t[i - 1]);
    const double q = 0.5 * width * width * middle * middle;
    if (q > 40.0) break;
    const double window = std::exp(-q) * (1.0 + q) * std::sin(half) / half;
    z += (r.force[i] - r.force[i - 1]) * std::polar(window, -middle);
  }
  return z;
}

// Range of spring stiffness (N/m) that is tried, up to 4 mu N over the presliding length, twice the contact's
// own stiffness.
struct Range {
  explicit Range(const Settings& s)
      : stiffest(4.0 * s.number("kinetic") * s.number("load") / s.number("presliding")),
        softest(stiffest / 65536.0) {}
  double stiffest, softest;
};

// Returns the critical stiffness by linear theory: 0 if every spring slides steadily, the stiffest if none.
double critical_by_theory(const Response& r, double mass, double least_slope, const Range& range) {
  // Returns 0, as sliding is steady on every spring if friction does not fall with speed.
  if (r.limit() > -least_slope) return 0.0;
  const auto damping = [&](double w) { return impedance(r, w).real(); };
  const auto held_by = [&](double w) { return mass * w * w + w * impedance(r, w).imag(); };
  const double first = 0.2 / r.t.back(), last = 0.25 * M_PI / (r.t[2] - r.t[1]);
  const int points = 400;
  double critical = 0.0, before = first;
  bool negative = true;  // whether the real part of the impedance Z was negative at the last
                         // frequency
  for (int i = 1; i <= points; ++i) {
    const double w = first * std::pow(last / first, static_cast<double>(i) / points);
    if (negative != (damping(w) < 0.0)) {
      double low = before, high = w;
      for (int k = 0; k < 40; ++k) {
        const double middle = 0.5 * (low + high);
        ((damping(middle) < 0.0) == negative ? low : high) = middle;
      }
      critical = std::max(critical, held_by(low));
      negative = !negative;
    }
    before = w;
  }
  if (!negative) return std::min(critical, range.stiffest);
  // Returns the stiffest spring if friction has no immediate damping: at high frequency the part that falls
  // with speed fades as w^-2, so nothing makes sliding steady.
  if (!(r.at_once() > 0.0)) return range.stiffest;
  const double faster2 = 1.0 - damping(last) / r.at_once();
  return std::min(held_by(last) + mass * last * last * (faster2 - 1.0), range.stiffest);
}

struct Trial {
  const std::string& model;
  const Settings& s;
  double speed, stiffness;
};

// Slider in steady sliding on a spring. To disturb it, the spring's pulled end moves faster or slower by a
// small share over the first five presliding lengths, then at the steady speed.
class Pulled {
 public:
  Pulled(const Trial& trial, double faster)
      : trial_(trial),
        subject_(trial.model, trial.s),
        block_(trial.s.number("mass"), trial.speed),
        ahead_m_(faster * trial.s.number("presliding")) {
    const Settings& s = trial.s;
    const double dbar = s.number("presliding"), load = s.number("load");
    const double each = dbar / s.number("steps_per_length");
    friction_ = slide(subject_, s.number("settling") * dbar, trial.speed, each, load);
    stretched_ = friction_ / trial.stiffness;
  }
  // Advances the slider to time t (s). Returns the spring's force less steady friction, N.
  double advance(double t, double dt) {
    const double k = trial_.stiffness;
    const double middle = 0.5 * (end_at(t - dt) + end_at(t));
    block_.advance(subject_, {k * (middle - block_.position()), 0.5 * k}, dt, trial_.s.number("load"));
    return k * (end_at(t) - block_.position()) - friction_;
  }

 private:
  double end_at(double t) const {
    const double lengths = trial_.speed * t / trial_.s.number("presliding");
    return stretched_ + trial_.speed * t + ahead_m_ * std::min(lengths, 5.0);
  }

  const Trial& trial_;
  Subject subject_;
  SlidingBlock block_;
  double ahead_m_, stretched_, friction_;
};

// Pair of sliders disturbed in opposite directions. Half the difference of their forces is the effect of the
// disturbance, without the fluctuations of a finite brush.
class Twins {
 public:
  explicit Twins(const Trial& trial)
      : ahead_(trial, trial.s.number("step")),
        back_(trial, -trial.s.number("step")),
        dt_(trial.s.number("presliding") / trial.s.number("steps_per_length") / trial.speed) {}
  void advance() {
    ++steps_;
    const double t = static_cast<double>(steps_) * dt_;
    const double a = ahead_.advance(t, dt_), b = back_.advance(t, dt_);
    mean_ = 0.5 * (a + b);
    difference_ = 0.5 * (a - b);
  }
  double mean() const { return mean_; }  // mean deviation of both springs' forces from steady friction, N
  double difference() const { return difference_; }

 private:
  Pulled ahead_, back_;
  double dt_;
  long steps_ = 0;
  double mean_ = 0.0, difference_ = 0.0;
};

// Returns whether the difference of the two sliders grows: its swing widens in each of eight stretches of
// path (from the third on), reaches eight times that of the first, or exceeds 3 % of kinetic friction. Also
// true if both sliders leave steady sliding by 3 %, as on soft springs, where every disturbance grows.
bool grows(const Trial& trial) {
  const Settings& s = trial.s;
  const double large = 0.03 * s.number("kinetic") * s.number("load");
  const auto stretch = std::max(2L, std::lround(s.number("trial_way") * s.number("steps_per_length") / 8.0));
  Twins twins(trial);
  double before = 0.0, first = INFINITY;
  for (int i = 0; i < 8; ++i) {
    double low = INFINITY, high = -INFINITY;
    for (long n = 1; n <= stretch; ++n) {
      twins.advance();
      low = std::min(low, twins.difference());
      high = std::max(high, twins.difference());
      if (high - low > std::min(large, 8.0 * first) || std::fabs(twins.mean()) > large) return true;
    }
    if (i == 0) first = high - low;
    // Ends the trial as stable if the swing's width stays constant up to rounding and to bristles that snap a
    // step earlier or later: such a swing neither gains nor loses energy.
    if (high - low < 1.5e-4 * large || (i >= 2 && !(high - low > 1.01 * before))) return false;
    before = high - low;
  }
  return true;
}

// Returns the critical stiffness by bisection over simulated sliders: 0 if every spring tried slides
// steadily, the stiffest if none.
double critical_by_bisection(const std::string& model, const Settings& s, double speed, const Range& range) {
  if (grows({model, s, speed, range.stiffest})) return range.stiffest;
  double stable = range.stiffest, unstable = 0.0;
  for (double k = 0.25 * stable; unstable == 0.0; k *= 0.25) {
    if (k < range.softest) return 0.0;
    (grows({model, s, speed, k}) ? unstable : stable) = k;
  }
  while (stable > 1.02 * unstable) {
    const double middle = std::sqrt(stable * unstable);
    (grows({model, s, speed, middle}) ? unstable : stable) = middle;
  }
  return std::sqrt(stable * unstable);
}

// Records how disturbed sliders diverge on springs a little softer and a little stiffer than critical.
void trace(ExperimentRun& run, double speed, double critical) {
  const double kinetic = run.number("kinetic") * run.number("load"),
               each = 1.0 / run.number("steps_per_length");
  for (const bool soft : {true, false}) {
    const Trial trial{run.model, run.settings, speed, critical * (soft ? 0.9 : 1.1)};
    Twins twins(trial);
    const auto steps = static_cast<long>(run.number("trial_way") / each);
    for (long n = 1; n <= steps; ++n) {
      twins.advance();
      if (n % 5 != 0) continue;
      run.add(soft ? "soft" : "stiff",
              {speed, trial.stiffness, each * static_cast<double>(n), twins.difference() / kinetic});
    }
  }
}

void run_critical_stiffness(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double kinetic = s.number("kinetic") * s.number("load"), dbar = s.number("presliding");
  const std::vector<double>& speeds = s.numbers("speeds");
  const Range range(s);
  double least = INFINITY, worst = 0.0;
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    const Response r = measure_response(run.model, s, speeds[i]);
    for (std::size_t k = 0; k < r.t.size(); ++k)
      run.add("response", {speeds[i], 0.0, r.t[k] * speeds[i] / dbar, r.force[k] * speeds[i] / kinetic});
    const double theory = critical_by_theory(r, s.number("mass"), 1e-5 * kinetic / speeds[i], range);
    const double found = critical_by_bisection(run.model, s, speeds[i], range);
    run.add("theory", {speeds[i], theory, 0.0, 0.0});
    run.add("bisection", {speeds[i], found, 0.0, 0.0});
    least = std::min(least, found);
    const double apart = found == theory ? 0.0 : theory == 0.0 ? 1.0 : std::fabs(found / theory - 1.0);
    worst = std::max(worst, apart);
    if (i == speeds.size() / 2 && found > 0.0 && found < range.stiffest) trace(run, speeds[i], found);
    run.progress(static_cast<double>(i + 1) / static_cast<double>(speeds.size()));
  }
  run.add("critical_stiffness", least, least > 0.0);
  run.add("linear_theory", 100.0 * worst, worst < 0.1);
}

}  // namespace

Experiment critical_stiffness_experiment() {
  return {
      "critical-stiffness",
      "a light slider on a spring that is pulled slowly: which spring makes it stick and slip",
      common_parameters({{"bristles", 14400}, {"viscous", 10.0}, {"resolution", 64.0}}) +
          std::vector<Parameter>{
              number_parameter("mass", 1e-3, "kg", "of the slider: light, for a slow pull", 1e-9, 1e6),
              list_parameter("speeds", {3e-5, 6e-5, 1.2e-4}, "m/s", "of the pull", 1e-9, 1e3),
              number_parameter("step", 0.01, "", "relative step in speed of the pull, at first", 1e-6, 0.5),
              number_parameter("response_step", 0.1, "", "relative step in speed of the response", 1e-6, 0.5),
              number_parameter("settling", 20.0, "", "way before, presliding lengths", 1.0, 1e6),
              number_parameter("response_way", 20.0, "", "way after the step, presliding lengths", 1.0, 1e5),
              number_parameter("trial_way", 60.0, "", "way of a trial, presliding lengths", 1.0, 1e6),
              number_parameter("steps_per_length", 100.0, "", "steps in a presliding length", 4.0, 1e5)},
      {{"critical_stiffness", "soft springs make it stick and slip, stiff ones do not",
        "a slow pull is steady on a spring stiffer than a critical one (Rabinowicz 1958; Rice and Ruina "
        "1983; Heslot et al. 1994)",
        "critical stiffness by bisection, least of the speeds; 0: steady on every spring of the range tried",
        "N/m", "above 0"},
       {"linear_theory", "as linear theory says",
        "the critical stiffness follows from the response to a small step in speed (Rice and Ruina 1983)",
        "error of the stiffness by bisection against linear theory, worst of the speeds", "%", "below 10 %"}},
      {"speed[m/s]", "stiffness[N/m]", "x_over_presliding", "friction_over_kinetic"},
      &run_critical_stiffness};
}

}  // namespace cli
