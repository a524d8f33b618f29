#include <array>

#include <fmt/format.h>

#include <bristle/error.hpp>

#include "tools/experiments/experiment.hpp"
#include "tools/files/user_error.hpp"

namespace cli {

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all = {
      drift_experiment(),      presliding_experiment(),   break_away_experiment(),
      stick_slip_experiment(), friction_lag_experiment(), stribeck_experiment(),
      load_step_experiment(),  turn_experiment(),         coulomb_experiment()};
  return all;
}

const Experiment& find_experiment(std::string_view name) {
  std::string known;
  for (const Experiment& experiment : experiments()) {
    if (experiment.name == name) return experiment;
    known += experiment.name + ", ";
  }
  throw UserError(fmt::format("'{}' is not an experiment; allowed: {}all, list", name, known));
}

ExperimentResult run_experiment(const Experiment& experiment, const ExperimentInput& input) {
  ExperimentResult result;
  const double models = static_cast<double>(input.models.size());
  double done = 0.0;
  try {
    experiment.check(input.settings);
    ExperimentInput one = input;
    one.progress = [&](double share) { input.progress((done + share) / models); };
    for (const std::string& model : input.models) {
      experiment.run(one, model, result);
      input.progress(++done / models);
    }
    return result;
  } catch (const bristle::Error& error) {
    throw UserError(fmt::format("experiment {}: {}", experiment.name, error.what()));
  }
}

}  // namespace cli
