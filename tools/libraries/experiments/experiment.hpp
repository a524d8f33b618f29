// Runs the classic friction experiments on the brush and on other friction models, for the command `bristle
// experiment`. Each experiment moves every model in the same way, and decides by numbers whether the model
// shows what the literature reports.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/libraries/experiments/settings.hpp"

namespace cli {

/// Phenomenon of friction known from the literature, and the criterion by which a model shows it.
struct Phenomenon {
  std::string id;          ///< name of the phenomenon, such as "drift_per_cycle"
  std::string title;       ///< title such as "no drift under a wavering force"
  std::string literature;  ///< text on what the literature reports, with its authors
  std::string measured;    ///< meaning of the measured number that decides
  std::string unit;
  std::string passes;  ///< which measured numbers count as a pass
};

/// Verdict on whether a model shows a phenomenon, with the measured value that decides it.
struct Finding {
  std::string phenomenon;
  std::string model;
  double value = 0.0;
  bool shown = false;
};

/// Point of a measured curve: the part of the picture that shows it, the model, and the point's numbers.
struct SeriesRow {
  std::string panel;
  std::string model;
  std::vector<double> values;
};

struct ExperimentResult {
  std::vector<SeriesRow> series;
  std::vector<Finding> findings;
};

struct ExperimentInput {
  Settings settings;
  std::vector<std::string> models;
  std::function<void(double)> progress = [](double) {};  ///< called with the share that is done, 0 to 1
};

/// Run of an experiment on one model, to which the experiment adds its curves and verdicts.
struct ExperimentRun {
  const Settings& settings;
  const std::string& model;
  ExperimentResult& result;
  std::function<void(double)> progress = [](double) {};  ///< called with the share that is done, 0 to 1

  double number(std::string_view name) const { return settings.number(name); }
  void add(std::string panel, std::vector<double> values) {
    result.series.push_back({std::move(panel), model, std::move(values)});
  }
  void add(std::string phenomenon, double value, bool shown) {
    result.findings.push_back({std::move(phenomenon), model, value, shown});
  }
};

/// Steps one contact and returns its response. Without `keeps` only tries the step, and leaves the contact's
/// state.
template <class Batch, class Motion, class... Time>
auto take(Batch& batch, const Motion& motion, bool keeps, Time... dt) {
  decltype(batch.find_force(dt..., motion)) response;
  if (!keeps) return batch.find_force(dt..., motion);
  batch.step(dt..., {&motion, 1}, {&response, 1});
  return response;
}

struct Experiment {
  std::string name;
  std::string title;
  std::string result;  ///< sentence on what its picture shows
  /// Parameters of the experiment: those that all experiments have, with this one's defaults, then its own.
  std::vector<Parameter> parameters;
  std::vector<Phenomenon> phenomena;
  std::vector<std::string> columns;  ///< names of a point's numbers, units in brackets

  void (*run)(ExperimentRun&);  ///< function that runs the experiment on one model
  /// Names and titles of the models, if the experiment has its own; empty: those of model_names().
  std::vector<std::pair<std::string, std::string>> models = {};
  /// Checks settings that depend on each other, such as a step that must be shorter than an event. Throws
  /// UserError.
  void (*check)(const Settings&) = [](const Settings&) {};
  /// Returns a sentence that the page of results prints below the experiment's table; empty: none.
  std::string (*note)(const Settings&, const std::vector<std::string>& models) =
      [](const Settings&, const std::vector<std::string>&) { return std::string(); };
};

/// Returns all experiments, in the order in which the table of results has them.
const std::vector<Experiment>& experiments();
/// Finds an experiment. Throws a UserError that lists all names, followed by `other_names`.
const Experiment& find_experiment(std::string_view name, std::initializer_list<const char*> other_names = {});

/// Returns the names of the default models: seven other friction models, the two readings of the paper's
/// brush, the infinite brush (redraw), an infinite brush with residual and shared renewal ("rubbed"), and one
/// that also ages.
std::span<const std::string_view> model_names();
/// Returns the names of the models that an experiment runs; for nullptr those of model_names().
std::vector<std::string> models_of(const Experiment* experiment);
/// Returns the models `wanted` by the user, or all that the experiment runs if none are named. Throws a
/// UserError that begins with `where` on unknown and repeated names.
std::vector<std::string> choose_models(const std::vector<std::string>& wanted, const std::string& where,
                                       const Experiment* experiment);
/// Returns the title of a model in tables, such as "LuGre".
std::string model_title(std::string_view model);

/// Returns the reason why a model shows (or does not show) a phenomenon. Reasons were written for the default
/// parameters; if `shown` is not the outcome with those, returns an empty text.
std::string reason_of(std::string_view phenomenon, std::string_view model, bool shown);

/// Runs an experiment on all its models, with progress on a terminal. Throws UserError, for instance for a
/// model that this build lacks.
ExperimentResult run_experiment(const Experiment& experiment, const ExperimentInput& input);

Experiment drift_experiment();
Experiment stick_slip_experiment();
Experiment friction_lag_experiment();
Experiment stribeck_experiment();
Experiment presliding_experiment();
Experiment break_away_experiment();
Experiment load_step_experiment();
Experiment coulomb_experiment();
Experiment rubbing_experiment();
Experiment slide_hold_slide_experiment();
Experiment velocity_step_experiment();
Experiment limit_surface_experiment();
Experiment creep_curve_experiment();
Experiment rolling_ball_experiment();
Experiment soft_finger_experiment();
Experiment joint_experiment();

}  // namespace cli
