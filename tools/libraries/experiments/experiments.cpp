#include <algorithm>

#include <fmt/format.h>

#include <bristle/error.hpp>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/files/nearest_name.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all = {drift_experiment(),         presliding_experiment(),
                                              break_away_experiment(),    stick_slip_experiment(),
                                              friction_lag_experiment(),  stribeck_experiment(),
                                              load_step_experiment(),     coulomb_experiment(),
                                              rubbing_experiment(),       slide_hold_slide_experiment(),
                                              velocity_step_experiment(), limit_surface_experiment(),
                                              creep_curve_experiment(),   rolling_ball_experiment(),
                                              soft_finger_experiment(),   joint_experiment()};
  return all;
}

const Experiment& find_experiment(std::string_view name, std::initializer_list<const char*> other_names) {
  NameList known;
  for (const Experiment& experiment : experiments()) {
    if (experiment.name == name) return experiment;
    known.push_back(experiment.name);
  }
  known.insert(known.end(), other_names.begin(), other_names.end());
  throw UserError(fmt::format("'{}' is not an experiment{}", name, allowed_text(name, known)));
}

std::vector<std::string> models_of(const Experiment* experiment) {
  if (experiment == nullptr || experiment->models.empty())
    return {model_names().begin(), model_names().end()};
  std::vector<std::string> names;
  for (const auto& [name, title] : experiment->models) names.push_back(name);
  return names;
}

std::vector<std::string> choose_models(const std::vector<std::string>& wanted, const std::string& where,
                                       const Experiment* experiment) {
  const NameList known = models_of(experiment);
  if (wanted.empty()) return known;
  for (const std::string& model : wanted) {
    if (std::find(known.begin(), known.end(), model) == known.end())
      throw UserError(fmt::format("{}: '{}' is not a model{}", where, model, allowed_text(model, known)));
    if (std::count(wanted.begin(), wanted.end(), model) > 1)
      throw UserError(fmt::format("{}: '{}' appears twice", where, model));
  }
  return wanted;
}

ExperimentResult run_experiment(const Experiment& experiment, const ExperimentInput& input) {
  ExperimentResult result;
  const double models = static_cast<double>(input.models.size());
  double done = 0.0;
  try {
    experiment.check(input.settings);
    for (const std::string& model : input.models) {
      ExperimentRun run{input.settings, model, result,
                        [&](double share) { input.progress((done + share) / models); }};
      experiment.run(run);
      input.progress(++done / models);
    }
    return result;
  } catch (const bristle::Error& error) {
    throw UserError(fmt::format("experiment {}: {}", experiment.name, error.what()));
  }
}

}  // namespace cli
