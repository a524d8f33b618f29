// `bristle accuracy`: error against run time, and the cheapest setting for a wanted error.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/accuracy/error.hpp"
#include "tools/accuracy/run.hpp"

namespace cli {

struct AccuracyOptions {
  std::string scene;
  bool quick = false;
  double seconds = 0.0;  ///< to spend, about; 0: 40 with `quick`, else 220
  std::optional<double>
      error;  ///< wanted: root mean square, relative; none: the first of 1, 2, 5, 10 % that can be had
  std::string write;      ///< scene file with the recommended setting; empty: none
  std::string json, csv;  ///< empty: none, "-": stdout
  std::string isa;        ///< empty: the library's choice
};

/// Copies of a patch whose forces are compared.
constexpr std::uint32_t compared_copies = 64;

/// One setting, measured.
struct SettingResult {
  Setting setting;
  bool paired = false;         ///< also compared with the same bristles, exact, double, at the finest step
  double predicted_s = 0.0;    ///< of one run
  std::vector<RunTime> times;  ///< one per round, of the whole scene with all its copies
  std::vector<std::vector<PatchError>> errors;  ///< [run][patch], against the reference
  std::vector<std::vector<PatchError>>
      same_steps;                                  ///< against the one of the scene's dt (for bristle counts)
  std::vector<std::vector<PatchError>> pairs;      ///< against the same bristles
  std::vector<std::optional<double>> closed_form;  ///< [patch], of the first run
  bool on_front = false;

  /// Over runs, of one patch: root of the mean square, highest, mean.
  static PatchError over_runs(const std::vector<std::vector<PatchError>>& runs, std::size_t patch);
  /// Of the patch with the highest rms.
  PatchError worst() const;
  /// Standard error of worst().rms; 0 for a single run.
  double rms_spread() const;
  /// Median and quartiles over rounds, CPU seconds of a step of its own.
  double step_s(double share = 0.5) const;
};

struct SlopeResult {
  std::string patch, sweep;
  Slope fit;
  std::string theory;
};

/// A feature, with and without.
struct FeatureResult {
  std::string feature;
  std::string state;  ///< "used", "left out already", "needed"
  bool measured = false;
  double saves = 0.0, saves_low = 0.0, saves_high = 0.0;  ///< share of the time with it; median and quartiles
  double error_with = 0.0, error_without = 0.0;           ///< rms against the reference, worst patch
  std::string advice;
};

struct Recommendation {
  bool found = false;
  Setting setting;
  double wanted = 0.0;
  PatchError promised;  ///< the one that met what was wanted
  double promised_step_s = 0.0;
  PatchError confirmed;  ///< from held-out seeds: may lie above `wanted`
  double confirmed_step_s = 0.0;
  double p99_s = 0.0, max_s = 0.0;  ///< of single steps, wall time, with the scene's threads and seeds
  std::uint64_t misses = 0, misses_ours = 0, steps = 0;
  double least_error = 0.0;  ///< of all settings tried, where none was found
};

/// The cheapest setting of the ladder that meets the error of the recommendation, with one population.
struct CheapestOf {
  bool infinite = false;
  bool found = false;
  Setting setting;
  double error = 0.0;         ///< rms, worst patch
  double scene_step_s = 0.0;  ///< CPU seconds
};

struct AccuracyResult {
  std::string isa;
  double reference_dt_s = 0.0;
  std::uint32_t scene_parts = 1;  ///< the scene's dt in steps of the reference
  std::uint32_t reference_bristles = 0;
  int reference_runs = 0;
  bool reference_double = true;
  std::vector<double> floor;                                 ///< [patch], of the reference
  std::vector<std::optional<double>> reference_closed_form;  ///< [patch]
  std::uint32_t pair_bristles = 0;
  bool own_mean = false;    ///< the force the scene uses is the mean
  std::vector<double> way;  ///< [patch], m, longest of its copies
  std::vector<double>
      step_over_snap;  ///< [patch], typical step of the scene's dt while moving, mean snap lengths
  std::uint64_t copies_compared = 0, copies = 0;
  std::vector<SettingResult> settings;
  std::vector<std::string> not_run;  ///< settings too slow for the time given
  std::vector<SlopeResult> slopes;
  Recommendation recommendation;
  std::string no_literal;            ///< why the literal rule is not among the settings; empty: it is
  std::string no_infinite;           ///< why the infinite brush is not among the settings; empty: it is
  std::vector<CheapestOf> cheapest;  ///< representatives, infinite
  std::vector<FeatureResult> features;
  double seconds = 0.0;  ///< wall time of it all
};

/// Seconds of a step: fixed, and for each bristle of every patch.
struct StepCost {
  double fixed_s = 0.0, bristle_s = 0.0;
};

/// Data that the parts of a study share.
struct AccuracyStudy {
  AccuracyStudy(const AccuracyOptions& its_options, const Scene& its_scene)
      : options(its_options), scene(its_scene), cut(cut_copies(its_scene, compared_copies)) {}

  const AccuracyOptions& options;
  const Scene& scene;  ///< as read
  Scene cut;           ///< with few copies: what errors are measured on
  bool is_cut = false;
  Reference fine, same_steps;
  ForceRecord paired[2];  ///< the same bristles at the finest step, for rounds 0 and 1
  std::optional<ClosedForm> closed_form;
  StepCost cost;                           ///< of the cut scene in single precision
  double full_over_cut = 1.0;              ///< patches of the scene over those of the cut one
  std::function<void(const char*)> spend;  ///< shows what is being measured
  AccuracyResult result;

  double dt(std::uint32_t parts) const { return result.reference_dt_s * parts; }
  double predict(const Setting& setting) const;  ///< s, of one run of the cut scene
  std::uint32_t scene_bristles() const;          ///< of its patch with most
};

/// Seconds given to the parts of a study.
struct AccuracyBudget {
  double reference, ladder, confirm, features;
};
AccuracyBudget budget(const AccuracyOptions& options);

void make_reference(AccuracyStudy& study, double seconds);
std::vector<SettingResult> make_ladder(AccuracyStudy& study, double seconds);
void run_ladder(AccuracyStudy& study, double seconds);
/// One more run of a setting with the seeds of `round`: error and time are added to `result`.
void measure(AccuracyStudy& study, SettingResult& result, std::uint32_t round, double most_s);
void find_slopes(AccuracyStudy& study);
void mark_front(AccuracyStudy& study);
/// Points on the front of least time and least error, by time: none of them is beaten in both by another
/// point. A slower one must be better by the share `gain` to count.
std::vector<std::size_t> pareto_front(const std::vector<double>& time, const std::vector<double>& error,
                                      double gain = 0.0);
void recommend(AccuracyStudy& study, double seconds);
/// After `recommend`.
void compare_populations(AccuracyResult& result);
void try_features(AccuracyStudy& study, double seconds);

/// Throws UserError.
AccuracyResult study_accuracy(const Scene& scene, const AccuracyOptions& options);

/// CPU seconds for what the scene does in one step of its own.
double scene_step_s(const AccuracyResult& result, const SettingResult& setting);
/// Whether a setting gives the force that the scene uses, at every one of its steps.
bool is_usable(const AccuracyResult& result, const Setting& setting);
/// Representatives of all patches under a setting; none of an infinite patch.
std::uint64_t total_bristles(const Scene& scene, const Setting& setting);

std::string setting_name(const Setting& setting, double dt_s);
/// Lines to put into the scene file.
std::string scene_fragment(const Scene& scene, const AccuracyResult& result);
/// The whole scene file with that in it, comments and all. `to` is where it will lie.
std::string tuned_scene(const Scene& scene, const AccuracyResult& result, const std::string& to);

std::string accuracy_table(const Scene& scene, const AccuracyOptions& options, const AccuracyResult& result);
std::string accuracy_json(const Scene& scene, const AccuracyOptions& options, const AccuracyResult& result);
std::string accuracy_csv(const Scene& scene, const AccuracyResult& result);

/// The subcommand: reads, measures, reports.
void accuracy_command(const AccuracyOptions& options);

}  // namespace cli
