#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bristle/error.hpp>

#include "tools/experiments/experiment.hpp"
#include "tools/files/user_error.hpp"

namespace cli {

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all = {drift_experiment(),
                                              presliding_experiment(),
                                              break_away_experiment(),
                                              stick_slip_experiment(),
                                              friction_lag_experiment(),
                                              stribeck_experiment(),
                                              load_step_experiment(),
                                              turn_experiment(),
                                              coulomb_experiment(),
                                              rubbing_experiment(),
                                              slide_hold_slide_experiment(),
                                              velocity_step_experiment(),
                                              critical_stiffness_experiment(),
                                              limit_surface_experiment(),
                                              pure_spin_experiment(),
                                              coin_experiment(),
                                              held_corner_experiment()};
  return all;
}

const Experiment& find_experiment(std::string_view name, std::string_view other_names) {
  std::string known;
  for (const Experiment& experiment : experiments()) {
    if (experiment.name == name) return experiment;
    known += (known.empty() ? "" : ", ") + experiment.name;
  }
  throw UserError(fmt::format("'{}' is not an experiment; allowed: {}{}", name, known, other_names));
}

std::vector<std::string> choose_models(const std::vector<std::string>& wanted, const std::string& where) {
  const std::span<const std::string_view> known = model_names();
  if (wanted.empty()) return {known.begin(), known.end()};
  for (const std::string& model : wanted) {
    if (std::find(known.begin(), known.end(), model) == known.end()) {
      throw UserError(
          fmt::format("{}: '{}' is not a model; allowed: {}", where, model, fmt::join(known, ", ")));
    }
    if (std::count(wanted.begin(), wanted.end(), model) > 1) {
      throw UserError(fmt::format("{}: '{}' appears twice", where, model));
    }
  }
  return wanted;
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
