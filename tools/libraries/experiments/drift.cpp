// Experiment on drift: a block under a wavering force that stays below break-away (the paper's Fig. 2; Dupont
// et al. 2002), and a block on a slope. Neither should move on.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/libraries/experiments/body.hpp"
#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/subject.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/scene/waveform.hpp"

namespace cli {
namespace {

// Force on a block over time: a ramp up to the middle force, a hold, sine cycles, and unloading.
struct Profile {
  double low, high, ramp, hold, frequency, cycles, unload;

  explicit Profile(const Settings& s)
      : low(s.number("force_low")),
        high(s.number("force_high")),
        ramp(s.number("ramp_time")),
        hold(s.number("hold_time")),
        frequency(s.number("frequency")),
        cycles(s.number("cycles")),
        unload(s.number("ramp_time")) {}

  double middle() const { return 0.5 * (low + high); }
  double wavering_from() const { return ramp + hold; }
  double wavering_until() const { return wavering_from() + cycles / frequency; }
  double end() const { return wavering_until() + unload; }
  double force(double t) const {
    if (t < ramp) return middle() * t / ramp;
    if (t < wavering_from()) return middle();
    if (t < wavering_until())
      return middle() + 0.5 * (high - low) * sine_of_turns(frequency * (t - wavering_from()));
    return middle() * std::max(0.0, 1.0 - (t - wavering_until()) / unload);
  }
};

// Averages of a block's position over successive windows of time. Averaging keeps the ringing of undamped
// springs from counting as drift.
class WindowMeans {
 public:
  WindowMeans(double from, double window) : from_(from), window_(window) {}
  void add(double t, double x) {
    if (t < from_) return;
    const auto w = static_cast<std::size_t>((t - from_) / window_);
    if (w >= sums_.size()) sums_.resize(w + 1);
    sums_[w].x += x;
    sums_[w].count += 1.0;
  }
  double mean(std::size_t w) const { return sums_.at(w).x / sums_.at(w).count; }

 private:
  struct Sum {
    double x = 0.0, count = 0.0;
  };
  double from_, window_;
  std::vector<Sum> sums_;
};

void fig2(ExperimentRun& run) {
  const Settings& s = run.settings;
  const Profile profile(s);
  const double dt = s.number("dt"), load = s.number("load");
  Subject subject(run.model, s);
  SlidingBlock block(s.number("mass"));
  // Averages the position over quarters of the hold and over cycles of the force. The ends of these windows
  // are offset by half a step, so that they lie between steps.
  WindowMeans hold(profile.ramp + 0.5 * dt, 0.25 * profile.hold);
  WindowMeans cycle(profile.wavering_from() + 0.5 * dt, 1.0 / profile.frequency);
  const auto steps = static_cast<long>(std::lround(profile.end() / dt));
  const long every = std::max(1L, steps / 4000);
  for (long k = 1; k <= steps; ++k) {
    const double before = static_cast<double>(k - 1) * dt, t = static_cast<double>(k) * dt;
    const double friction = block.advance(subject, {profile.force(before + 0.5 * dt)}, dt, load);
    hold.add(t, block.position());
    cycle.add(t, block.position());
    if (k % every == 0) run.add("fig2", {t, profile.force(t), -friction, block.position()});
  }
  const double creep = (hold.mean(3) - hold.mean(1)) / (0.5 * profile.hold);
  run.add("hold", 1e6 * creep, std::fabs(creep) < 1e-3 * s.number("presliding"));
  const auto last = static_cast<std::size_t>(profile.cycles) - 1;
  const double drift = cycle.mean(last) - cycle.mean(last - 1);
  run.add("drift_per_cycle", 1e6 * drift, std::fabs(drift) < 1e-3 * s.number("presliding"));
}

void slope(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double dt = s.number("dt"), load = s.number("load");
  const double pull = load * s.number("slope"), shake = load * s.number("disturbance");
  const double frequency = s.number("slope_frequency");
  const double periods = std::max(4.0, std::round(s.number("slope_duration") * frequency));
  Subject subject(run.model, s);
  SlidingBlock block(load * std::hypot(1.0, s.number("slope")) / 9.80665);
  const double tilting = s.number("ramp_time");  // time in which the slope is tilted before it is shaken, s
  WindowMeans period(tilting + 0.5 * dt, 1.0 / frequency);
  const auto steps = static_cast<long>(std::lround((tilting + periods / frequency) / dt));
  const long every = std::max(1L, steps / 2000);
  for (long k = 1; k <= steps; ++k) {
    const double t = static_cast<double>(k) * dt;
    const double middle = t - 0.5 * dt;
    const double force = pull * std::min(1.0, middle / tilting) +
                         (middle > tilting ? shake * sine_of_turns(frequency * (middle - tilting)) : 0.0);
    const double friction = block.advance(subject, {force}, dt, load);
    period.add(t, block.position());
    if (k % every == 0) run.add("slope", {t, force, -friction, block.position()});
  }
  const auto last = static_cast<std::size_t>(periods) - 1, middle = last / 2;
  const double speed =
      (period.mean(last) - period.mean(middle)) * frequency / static_cast<double>(last - middle);
  run.add("slope", 1e6 * speed, std::fabs(speed) < 1e-3 * s.number("presliding"));
}

// Limits the time step to a 20th of the shortest event (hold, ramp, cycle). Otherwise the measured means and
// swings would be those of the step, not of the friction model.
void check_step(const Settings& s) {
  const double longest = 0.05 * std::min({1.0 / s.number("frequency"), 1.0 / s.number("slope_frequency"),
                                          s.number("hold_time"), s.number("ramp_time")});
  if (s.number("dt") > longest)
    throw UserError(
        fmt::format("experiment drift: dt is {:g} s; at these times and frequencies at most {:g} s",
                    s.number("dt"), longest));
  if (s.number("force_low") > s.number("force_high"))
    throw UserError("experiment drift: force_low is above force_high");
}

void run_drift(ExperimentRun& run) {
  fig2(run);
  slope(run);
}

}  // namespace

Experiment drift_experiment() {
  const std::map<std::string, double> defaults = {
      {"load", 0.6},         {"stiffness", 16000.0},          {"damping", 20.0},
      {"presliding", 30e-6}, {"bristles_per_newton", 1500.0}, {"cv", 0.5}};
  return {
      "drift",
      "a block under a wavering force below break-away, and on a slope",
      "Under the paper's wavering force (Fig. 2) Dahl and LuGre creep on with every cycle, and brushes stay "
      "where they are",
      common_parameters(defaults) +
          std::vector<Parameter>{
              number_parameter("mass", 0.1, "kg", "of the block", 1e-6, 1e6),
              number_parameter("force_low", 0.12, "N", "least applied force while it wavers", -1e6, 1e6),
              number_parameter("force_high", 0.22, "N", "highest applied force", -1e6, 1e6),
              number_parameter("ramp_time", 1.0, "s",
                               "to the middle force, and back to nothing; to tilt the slope", 1e-3, 1e4),
              number_parameter("hold_time", 0.5, "s", "at the middle force", 1e-3, 1e4),
              number_parameter("frequency", 5.0, "Hz", "of the wavering", 1e-3, 1e3),
              whole_parameter("cycles", 5, "of the wavering", 2, 1e6),
              number_parameter("slope", 0.25, "", "tangent of the slope's angle", 0.0, 10.0),
              number_parameter("disturbance", 0.05, "", "shaking force along the slope over load", 0.0, 10.0),
              number_parameter("slope_frequency", 20.0, "Hz", "of the shaking", 0.1, 1e3),
              number_parameter("slope_duration", 2.0, "s", "of the shaking", 0.1, 1e4)},
      {{"hold", "holds under a constant force",
        "below break-away a contact stays where it is (Courtney-Pratt and Eisner 1957)",
        "speed from the second to the last quarter of the hold", "um/s",
        "below a thousandth of the presliding length a second"},
       {"drift_per_cycle", "no drift under a wavering force",
        "a force that wavers below break-away moves nothing permanently (Dupont et al. 2002; the paper, Fig. "
        "2)",
        "mean position in the last cycle less that in the one before", "um",
        "below a thousandth of the presliding length"},
       {"slope", "stays on a slope when shaken",
        "a block on a slope stays where it is under a small disturbance (Dupont et al. 2002; the paper, "
        "section 3)",
        "speed down the slope in the second half", "um/s",
        "below a thousandth of the presliding length a second"}},
      {"t[s]", "applied[N]", "friction[N]", "x[m]"},
      &run_drift,
      {},
      &check_step};
}

}  // namespace cli
