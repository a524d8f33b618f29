// Runs the classic friction experiments, the brush beside other friction models: `bristle experiment`. Each
// experiment moves every model in the same way and decides by numbers whether the model shows what the
// literature reports.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/experiments/settings.hpp"

namespace cli {

/// Phenomenon of the literature, and the criterion by which a model shows it.
struct Phenomenon {
  std::string id;          ///< name of the phenomenon, such as "drift_per_cycle"
  std::string title;       ///< title such as "no drift under a wavering force"
  std::string literature;  ///< what the literature reports, and who
  std::string measured;    ///< meaning of the number that decides the verdict
  std::string unit;
  std::string passes;  ///< criterion by which the phenomenon counts as shown
};

/// Verdict on one phenomenon and one model: a cell of the table.
struct Finding {
  std::string phenomenon;
  std::string model;
  double value = 0.0;
  bool shown = false;
};

/// Point of a curve: its picture panel, its model, and its numbers.
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
  std::function<void(double)> progress = [](double) {};  ///< called with the share done, 0 to 1
};

struct Experiment {
  std::string name;
  std::string title;
  /// Parameters of all experiments, with this one's defaults, then those that only this one has.
  std::vector<Parameter> parameters;
  std::vector<Phenomenon> phenomena;
  std::vector<std::string> columns;  ///< names of SeriesRow::values, units in brackets

  /// Runs one model and adds its curves and findings. It may report progress of its own.
  void (*run)(const ExperimentInput&, const std::string& model, ExperimentResult&);
  /// Checks settings against each other. Throws UserError.
  void (*check)(const Settings&) = [](const Settings&) {};
  /// Names and titles of the models, if the experiment has its own; empty: model_names().
  std::vector<std::pair<std::string, std::string>> models = {};
};

/// Returns the experiments in the order of the table.
const std::vector<Experiment>& experiments();
/// Finds an experiment by name. Throws a UserError that lists all names, followed by `other_names`.
const Experiment& find_experiment(std::string_view name, std::initializer_list<const char*> other_names = {});

/// Returns the default models: seven other friction models, the two readings of the paper's brush, the
/// infinite brush (redraw), an infinite brush with residual and shared renewal ("rubbed"), and one that also
/// ages.
std::span<const std::string_view> model_names();
/// Returns the names of an experiment's models; nullptr: model_names().
std::vector<std::string> models_of(const Experiment* experiment);
/// Returns `wanted`, or all of models_of() if `wanted` is empty. Throws a UserError that begins with `where`
/// on unknown and repeated names.
std::vector<std::string> choose_models(const std::vector<std::string>& wanted, const std::string& where,
                                       const Experiment* experiment);
/// Returns a model's title as tables print it: "LuGre".
std::string model_title(std::string_view model);

/// Returns why a model shows a phenomenon or does not; empty if the outcome differs from that of the default
/// parameters.
std::string reason_of(std::string_view phenomenon, std::string_view model, bool shown);

/// Runs an experiment with progress on a terminal. Throws UserError (for a model that this build lacks, for
/// instance).
ExperimentResult run_experiment(const Experiment& experiment, const ExperimentInput& input);

Experiment drift_experiment();
Experiment stick_slip_experiment();
Experiment friction_lag_experiment();
Experiment stribeck_experiment();
Experiment presliding_experiment();
Experiment break_away_experiment();
Experiment load_step_experiment();
Experiment turn_experiment();
Experiment coulomb_experiment();
Experiment rubbing_experiment();
Experiment slide_hold_slide_experiment();
Experiment velocity_step_experiment();
Experiment critical_stiffness_experiment();
Experiment limit_surface_experiment();
Experiment pure_spin_experiment();
Experiment coin_experiment();
Experiment held_corner_experiment();
Experiment creep_curve_experiment();
Experiment rolling_ball_experiment();
Experiment oblique_impact_experiment();
Experiment soft_finger_experiment();
Experiment joint_experiment();
Experiment ratchet_experiment();

/// Time of a step of one model, ns, all models measured in one interleaved run.
struct CostRow {
  std::string model;
  std::string motion;
  double ns = 0.0;               ///< ns, median over the rounds of measurement
  double low = 0.0, high = 0.0;  ///< ns, lower and upper quartile over the rounds
};
std::vector<CostRow> measure_cost(const ExperimentInput& input);
/// Returns the settings that measure_cost needs.
std::vector<Parameter> cost_parameters();

}  // namespace cli
