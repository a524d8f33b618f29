// Measures how the error of forces depends on run time, and finds the cheapest setting for a wanted error:
// the command `bristle accuracy`.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/libraries/accuracy/error.hpp"
#include "tools/libraries/accuracy/run.hpp"
#include "tools/libraries/reports/line_fit.hpp"

namespace cli {

struct AccuracyOptions {
  std::string scene;
  bool quick = false;
  double seconds = 0.0;  ///< wall time that a study may take, s; 0: 40 s with `quick`, else 220 s
  /// Wanted rms error of the forces, relative to the forces. Not given: the smallest of 1, 2, 5, 10 % that a
  /// setting meets.
  std::optional<double> error;
  std::string json, csv;  ///< names of report files; empty: no report, "-": stdout
  std::string isa;        ///< instruction set, such as "avx2"; empty: the library's choice
};

/// Number of copies of a patch whose forces are compared with the reference. Further copies are only timed,
/// because comparing more would hardly change the error.
constexpr std::uint32_t compared_copies = 64;

/// Setting of the patches (number of bristles, time step, ...), with its errors and run times.
struct SettingResult {
  Setting setting;
  /// Whether this setting was compared, besides with the reference, with a run of the same bristles in double
  /// precision at the finest step, in which no snap is missed. The difference shows the error of step and
  /// precision alone.
  bool paired = false;
  double predicted_s = 0.0;                     ///< predicted time of one run with this setting, s
  std::vector<RunTime> times;                   ///< run times with all copies of patches, one per round
  std::vector<std::vector<PatchError>> errors;  ///< [run][patch], force error against the reference run
  /// Error of the forces against a reference with the scene's own time step, as [run][patch]: what is not due
  /// to the length of the step.
  std::vector<std::vector<PatchError>> same_steps;
  /// Error of the forces against a run of the same bristles with the finest time step, as [run][patch]: what
  /// is due to step and precision alone.
  std::vector<std::vector<PatchError>> pairs;
  /// Error of the forces of the first run against a closed form, by patch; unset where no closed form exists.
  std::vector<std::optional<double>> closed_form;
  bool on_front = false;

  /// Returns a patch's error over all runs: the root mean square of the rms errors, the mean of the energy
  /// errors, and the highest of the other errors.
  static PatchError over_runs(const std::vector<std::vector<PatchError>>& runs, std::size_t patch);
  /// Returns, for each measure of error separately, the highest value of any patch.
  PatchError worst() const;
  /// Returns the standard error, over seeds, of the rms force error of the worst patch; 0 for a single run.
  double rms_spread() const;
  /// Returns a quantile, over repeated runs, of the CPU time (s) of one step with this setting; `share` is
  /// the level of the quantile, 0.5 for the median.
  double step_s(double share = 0.5) const;
};

struct SlopeResult {
  std::string patch, sweep;
  Line fit;  ///< line on log-log axes, whose slope is the order of the error
  std::string theory;
};

struct Recommendation {
  bool found = false;
  Setting setting;
  double wanted = 0.0;
  PatchError promised;  ///< error of the chosen setting as first measured, when it was chosen
  double promised_step_s = 0.0;
  /// Error of the chosen setting with seeds that the search did not use. The search prefers lucky seeds, so
  /// this error may exceed the wanted one.
  PatchError confirmed;
  double confirmed_step_s = 0.0;
  double p99_s = 0.0, max_s = 0.0;  ///< wall time of single steps, s: 99th percentile and maximum
  std::uint64_t misses = 0, misses_ours = 0, steps = 0;
  double least_error = 0.0;  ///< least error of all settings tried, where none met the wanted error
};

/// Cheapest setting of one population (representatives, or the infinite brush) in all patches that has at
/// most the error that the user wants.
struct CheapestOf {
  bool infinite = false;
  bool found = false;
  Setting setting;
  double error = 0.0;         ///< rms force error of the scene's worst patch
  double scene_step_s = 0.0;  ///< CPU time per step of the scene, s
};

struct AccuracyResult {
  std::string isa;
  double reference_dt_s = 0.0;
  std::uint32_t scene_parts = 1;  ///< number of the reference run's steps in one step of the scene
  std::uint32_t reference_bristles = 0;
  int reference_runs = 0;
  bool reference_double = true;
  std::vector<double> floor;  ///< [patch], standard error of the reference's force

  /// Error of the reference run against a closed form, by patch; unset for a patch that has no closed form.
  std::vector<std::optional<double>> reference_closed_form;
  std::uint32_t pair_bristles = 0;
  bool own_mean = false;               ///< whether the scene uses the force averaged over a step
  std::vector<double> path;            ///< [patch], longest path that a copy of the patch travels, m
  std::vector<double> step_over_snap;  ///< [patch], mean path of a step, in mean snap lengths, while moving
  std::uint64_t copies_compared = 0, copies = 0;
  std::vector<SettingResult> settings;
  std::vector<std::string> not_run;  ///< names of settings left out as too slow for the given time
  std::vector<SlopeResult> slopes;
  Recommendation recommendation;
  /// Reason why the paper's loop is not among the settings tried; empty if it is. (In that loop a snapped
  /// bristle loses the path left in the step.)
  std::string no_paper_loop;
  /// Reason why the infinite brush is not among the settings; empty if it is.
  std::string no_infinite;
  std::vector<CheapestOf> cheapest;  ///< cheapest representatives and cheapest infinite brush
  double seconds = 0.0;              ///< wall time that the study took, s
};

/// Wall time of a step of the scene with few copies, s, as a fixed part plus a part times the number of
/// bristles of a patch. It predicts the times of settings that have not been run.
struct StepCost {
  double fixed_s = 0.0, bristle_s = 0.0;
};

/// Scene, reference run and results of a study of accuracy, passed between the functions that make it up.
struct AccuracyStudy {
  AccuracyStudy(const AccuracyOptions& its_options, const Scene& its_scene)
      : options(its_options), scene(its_scene), cut(cut_copies(its_scene, compared_copies)) {}

  const AccuracyOptions& options;
  const Scene& scene;  ///< the whole scene, as read from its file
  Scene cut;           ///< scene with few copies of each patch, to measure errors
  bool is_cut = false;
  Reference fine, same_steps;
  ForceRecord paired[2];  ///< runs at the finest time step, for the first two rounds of seeds
  std::optional<ClosedForm> closed_form;
  StepCost cost;                           ///< time of a step of `cut`, in single precision
  double full_over_cut = 1.0;              ///< number of patches of the scene over those of `cut`
  std::function<void(const char*)> spend;  ///< shows the user the name of what is measured
  AccuracyResult result;

  double dt(std::uint32_t parts) const { return result.reference_dt_s * parts; }
  /// Returns the predicted time, s, of one run of the scene with a setting, in which patches have few copies.
  double predict(const Setting& setting) const;
  std::uint32_t scene_bristles() const;  ///< returns the number of bristles of the scene's largest patch
};

/// Wall time, s, that each part of a study of accuracy may take.
struct AccuracyBudget {
  double reference, ladder, confirm;
};
AccuracyBudget budget(const AccuracyOptions& options);

void make_reference(AccuracyStudy& study, double seconds);
std::vector<SettingResult> make_ladder(AccuracyStudy& study, double seconds);
void run_ladder(AccuracyStudy& study, double seconds);
/// Runs a setting once more with the seeds of this round, and adds the run's error and time to `result`.
void measure(AccuracyStudy& study, SettingResult& result, std::uint32_t round, double most_s);
void find_slopes(AccuracyStudy& study);
void mark_front(AccuracyStudy& study);
/// Returns the Pareto front of time and error, ordered by time: the points of which no other is better in
/// both. A slower point belongs to it only if its error is less by the share `gain`.
std::vector<std::size_t> pareto_front(const std::vector<double>& time, const std::vector<double>& error,
                                      double gain = 0.0);
void recommend(AccuracyStudy& study, double seconds);
/// Finds the cheapest setting of each population that meets the error which recommend() has found.
void compare_populations(AccuracyResult& result);

/// Runs the whole study of error against run time for one scene. Throws UserError.
AccuracyResult study_accuracy(const Scene& scene, const AccuracyOptions& options);

/// Returns the CPU seconds that a setting takes for one step of the scene.
double scene_step_s(const AccuracyResult& result, const SettingResult& setting);
/// Returns whether the scene could use this setting: the setting's time step divides the scene's, its run
/// recorded the force that the scene uses (mean over a step, or at its end), and the library steps the
/// patches.
bool is_usable(const AccuracyResult& result, const Setting& setting);
/// Returns the number of representatives in all patches under a setting; an infinite patch has none.
std::uint64_t total_bristles(const Scene& scene, const Setting& setting);

std::string setting_name(const Setting& setting, double dt_s);
/// Returns the lines of TOML that put the recommended setting into the scene file.
std::string scene_fragment(const Scene& scene, const AccuracyResult& result);

std::string accuracy_table(const Scene& scene, const AccuracyOptions& options, const AccuracyResult& result);
std::string accuracy_json(const Scene& scene, const AccuracyOptions& options, const AccuracyResult& result);
std::string accuracy_csv(const Scene& scene, const AccuracyResult& result);

/// Runs the command `bristle accuracy`: reads the scene, measures, writes the reports.
void accuracy_command(const AccuracyOptions& options);

}  // namespace cli
