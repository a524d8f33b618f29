// Experiment on friction lag: in one-way sliding whose speed swings, friction follows the speed with a delay
// (Hess and Soom 1990; Canudas de Wit et al. 1995, Fig. 4).
#include <algorithm>
#include <cmath>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/subject.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/scene/waveform.hpp"

namespace cli {
namespace {

// Moves a contact one way at a speed that swings about a mean. Compares friction at the mean speed between
// growing and falling speed, each averaged over the cycles.
void swing(ExperimentRun& run, double omega, bool decides) {
  const Settings& s = run.settings;
  const double load = s.number("load");
  const double mean = s.number("velocity_mean"), amplitude = s.number("velocity_amplitude");
  const auto cycles = static_cast<long>(s.number("cycles"));
  const double period = 2.0 * M_PI / omega;
  // Divides a quarter period into whole steps, so that the speed at the end of one of them is the mean speed.
  const long quarter = std::max(25L, static_cast<long>(std::ceil(0.25 * period / s.number("dt"))));
  const long steps = 4 * quarter;
  const double dt = period / static_cast<double>(steps);
  const auto at = [&](long k) {  // position at the end of step k, m: integral of the swinging speed
    const double turns = static_cast<double>(k) / static_cast<double>(steps);
    return mean * period * turns - amplitude / omega * (cosine_of_turns(turns) - 1.0);
  };
  Subject subject(run.model, s);
  std::vector<double> force(static_cast<std::size_t>(steps), 0.0);
  // Slides ten presliding lengths before it measures, because a brush has then forgotten its start.
  const auto settling =
      static_cast<long>(std::max(2.0, std::ceil(10.0 * s.number("presliding") / (mean * period))));
  for (long cycle = -settling; cycle < cycles; ++cycle) {
    for (long k = 1; k <= steps; ++k) {
      // Records the step's mean friction, which to second order in dt is the friction at the speed halfway
      // through the step.
      const double friction = -subject.step({at(k) - at(k - 1), 0.0}, dt, load).mean.x;
      if (cycle >= 0) force[static_cast<std::size_t>(k - 1)] += friction / static_cast<double>(cycles);
    }
  }
  const long every = std::max(1L, steps / 400);
  for (long k = 0; k < steps; k += every) {
    const double turns = (static_cast<double>(k) + 0.5) / static_cast<double>(steps);
    run.add("lag", {omega, mean + amplitude * sine_of_turns(turns), force[static_cast<std::size_t>(k)]});
  }
  const auto around = [&](long k) {
    const auto n = static_cast<std::size_t>(steps);
    const auto i = static_cast<std::size_t>(k % steps);
    return 0.5 * (force[(i + n - 1) % n] + force[i]);
  };
  const double up = around(0), down = around(2 * quarter);
  run.add("width", {omega, up, down});
  if (decides) {
    const double width = (up - down) / (s.number("kinetic") * load);
    run.add("lag", 100.0 * width, width > 0.01);
  }
}

void check_friction_lag(const Settings& settings) {
  if (settings.number("velocity_amplitude") >= settings.number("velocity_mean"))
    throw UserError(
        "experiment friction-lag: velocity_amplitude must be below velocity_mean: sliding is one-way");
}

void run_friction_lag(ExperimentRun& run) {
  const std::vector<double>& omegas = run.settings.numbers("omegas");
  const double fastest = *std::max_element(omegas.begin(), omegas.end());
  double done = 0.0;
  for (const double omega : omegas) {
    swing(run, omega, omega == fastest);
    run.progress(++done / static_cast<double>(omegas.size()));
  }
}

}  // namespace

Experiment friction_lag_experiment() {
  return {"friction-lag",
          "one-way sliding whose speed swings",
          "Friction lags in models that follow a Stribeck curve over a path or a time, and in the brush that "
          "ages",
          common_parameters({{"bristles", 3600}, {"dt", 5e-3}}) +
              std::vector<Parameter>{
                  number_parameter("velocity_mean", 1.5e-3, "m/s", "mean speed", 1e-9, 1e3),
                  number_parameter("velocity_amplitude", 1e-3, "m/s", "of the swing", 1e-9, 1e3),
                  list_parameter("omegas", {1.0, 10.0, 25.0, 100.0}, "rad/s",
                                 "of the swing; the fastest decides", 1e-3, 1e5),
                  whole_parameter("cycles", 20, "to average over", 1, 1e6)},
          {{"lag", "friction lags behind the speed",
            "friction is higher while the speed grows than while it falls (Hess and Soom 1990)",
            "friction at the mean speed, growing less falling, over kinetic friction, fastest swing", "%",
            "above 1 %"}},
          {"omega[rad/s]", "v[m/s]", "friction[N]"},
          &run_friction_lag,
          {},
          &check_friction_lag};
}

}  // namespace cli
