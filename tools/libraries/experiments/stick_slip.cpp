// Experiment on stick-slip: a mass on a spring whose other end is pulled at constant speed (Canudas de Wit et
// al. 1995, Fig. 5).
#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/body.hpp"
#include "tools/libraries/experiments/experiment.hpp"

namespace cli {
namespace {

void pull(ExperimentRun& run, const Settings& s, const std::string& panel, const std::string& phenomenon) {
  const double dt = s.number("dt"), load = s.number("load");
  const double spring = s.number("spring"), speed = s.number("pull_velocity");
  const double duration = s.number("duration");
  Subject subject(run.model, s);
  SlidingBlock block(s.number("mass"));
  const auto steps = static_cast<long>(std::lround(duration / dt));
  const long every = std::max(1L, steps / 4000);
  double low = INFINITY, high = -INFINITY;
  double stuck = 0.0, watched = 0.0;
  for (long k = 1; k <= steps; ++k) {
    const double t = static_cast<double>(k) * dt;
    const double middle = speed * (t - 0.5 * dt);
    block.advance(subject, {spring * (middle - block.position()), 0.5 * spring}, dt, load);
    const double force = spring * (speed * t - block.position());
    if (t > s.number("settling_share") * duration) {
      low = std::min(low, force);
      high = std::max(high, force);
      stuck += std::fabs(block.velocity()) < 0.02 * speed ? 1.0 : 0.0;
      watched += 1.0;
    }
    if (k % every == 0) run.add(panel, {t, force, block.position(), block.velocity()});
  }
  const double swing = (high - low) / (s.number("kinetic") * load);
  run.add(phenomenon, 100.0 * swing, swing > 0.1 && stuck > 0.1 * watched);
}

void run_stick_slip(ExperimentRun& run) {
  Settings dry = run.settings;
  dry.set("viscous=0");
  pull(run, run.settings, "pull", "stick_slip");
  pull(run, dry, "dry", "stick_slip_dry");
}

}  // namespace

Experiment stick_slip_experiment() {
  return {"stick-slip",
          "a mass on a spring pulled at constant speed",
          "Without lubricant every brush keeps sticking and slipping, with it only the one that ages",
          common_parameters({{"dt", 2e-3}}) +
              std::vector<Parameter>{
                  number_parameter("mass", 1.0, "kg", "of the block", 1e-6, 1e6),
                  number_parameter("spring", 2.0, "N/m", "stiffness of the spring", 1e-6, 1e9),
                  number_parameter("pull_velocity", 0.1, "m/s", "of the spring's other end", 1e-9, 1e3),
                  number_parameter("duration", 30.0, "s", "of the pull", 1e-2, 1e5),
                  number_parameter("settling_share", 0.6, "", "of the duration, before the swing is measured",
                                   0.0, 0.99)},
          {{"stick_slip", "keeps sticking and slipping, lubricated",
            "a mass pulled slowly by a soft spring keeps sticking and slipping (Rabinowicz 1958; Canudas "
            "de Wit et al. 1995)",
            "swing of the spring force after settling, over kinetic friction", "%",
            "above 10 %, and it is slower than a fiftieth of the pull for a tenth of the time"},
           {"stick_slip_dry", "keeps sticking and slipping, without lubricant",
            "a mass pulled slowly by a soft spring keeps sticking and slipping (Rabinowicz 1958; Canudas "
            "de Wit et al. 1995)",
            "swing of the spring force after settling, over kinetic friction", "%",
            "above 10 %, and it is slower than a fiftieth of the pull for a tenth of the time"}},
          {"t[s]", "spring[N]", "x[m]", "v[m/s]"},
          &run_stick_slip};
}

}  // namespace cli
