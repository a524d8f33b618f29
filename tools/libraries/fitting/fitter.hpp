// Fits a brush to one record of measured friction: searches the best point, adds terms that the data show,
// and removes parameters that they do not determine. Used within this folder only.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "tools/libraries/fitting/fit.hpp"
#include "tools/libraries/fitting/model.hpp"
#include "tools/libraries/fitting/solve.hpp"
#include "tools/libraries/reports/progress.hpp"

namespace cli {

// Ratio of fast to slow speed below which a record counts as having a single speed.
inline constexpr double one_speed = 1.3;
// Ratio of highest to lowest load above which a record counts as having several loads.
inline constexpr double several = 1.3;
inline constexpr double bristles_per_newton = 900.0;

inline bool contains(const FitParameterSet& set, FitParameter p) {
  return std::count(set.begin(), set.end(), p) > 0;
}

inline void take_out(FitParameterSet& set, FitParameter p) {
  set.erase(std::remove(set.begin(), set.end(), p), set.end());
}

inline bool better(const FitPoint& a, const FitPoint& b) { return a.sum_of_squares < b.sum_of_squares; }

/// Returns the Stribeck velocities that a fit tries, in geometric progression around the record's speeds.
inline std::vector<double> trial_stribeck_velocities(const FitData& data) {
  std::vector<double> all;
  for (double speed = data.slow / 4.0; speed < 4.0 * data.fast; speed *= 1.8) all.push_back(speed);
  return all;
}

/// Result of a search: the fitted point, and for each parameter not fitted the reason.
struct Found {
  FitPoint point;
  std::array<std::string, fit_parameters> why;
  std::string stage_note;
  int evaluations = 0;    ///< number of times the force was computed along the path
  double held_out = 0.0;  ///< rms error on parts of the record that were not fitted, N
};

/// Fitter of one record of friction: finds the best point, and removes from it the parameters that the record
/// does not determine.
class Fitter {
 public:
  Fitter(const FitData& data, const FitOptions& options, Detail detail, Progress& progress)
      : data_(data), options_(options), model_(data, options, detail), progress_(progress) {}

  Found search() {
    const FitPoint point = choose();
    return {point, why_, stage_note_, model_.evaluations(),
            std::sqrt(held_out(point) / static_cast<double>(samples()))};
  }
  /// Fits the slide rule with a free law of snap lengths. Sets `quantiles` to those of that law.
  Found with_free_law(const Found& found, std::vector<double>& quantiles) {
    FreeLaw free = find_free_law(model_, options_, minimise_all(found.point));
    quantiles = std::move(free.quantiles);
    return {std::move(free.point), found.why, found.stage_note, found.evaluations, found.held_out};
  }
  FitResult finish(const Found& found) {
    why_ = found.why;
    stage_note_ = found.stage_note;
    FitPoint point = minimise_all(found.point);
    if (options_.rule == bristle::SnapRule::keep) point = polish(point);
    refuse_without_friction(point);
    return report(keep_determined(point));
  }

 private:
  FitPoint minimise_all(const FitPoint& found) {
    const FitPoint point = found.free.empty() ? found : minimise(model_, found);
    return bends_stage(point.values) ? minimise_bent(point) : point;
  }
  FitPoint search_plain();
  FitPoint search_whole_memory(const FitPoint& about);
  FitPoint search_rubbed();
  bool promises(const FitPoint& core, const std::vector<FitValues>& with);
  bool promises_rubbing(const FitPoint& core);
  FitPoint made_to_rub(const FitPoint& plain);
  FitPoint polish(const FitPoint& point);
  FitPoint choose();
  FitParameterSet bending() const {
    FitParameterSet set{fit_length};
    if (has_spread(options_.law)) set.push_back(fit_spread);
    return set;
  }
  FitPoint linear_start(const FitValues& bent, const FitParameterSet& linear);
  FitPoint search_with(const std::vector<FitValues>& shapes, const FitParameterSet& bending, double progress);
  std::vector<FitValues> rubbed_shapes() const;
  FitPoint try_starts(FitPoint best);
  FitPoint try_later_starts(FitPoint point);
  std::vector<FitPoint> speed_candidates(const FitPoint& core);
  FitPoint add_speed_terms(const FitPoint& core);
  FitFrame time_frame(const FitPoint& core) const;
  FitPoint add_time_terms(const FitPoint& core, const FitPoint& base);
  std::vector<FitPoint> time_starts(const FitPoint& core, const FitPoint& base);
  FitPoint try_rests(FitPoint point);
  FitPoint try_saturating(FitPoint point);
  FitPoint add_asymmetry(const FitPoint& point);
  FitPoint add_stage_terms(const FitPoint& core);
  FitPoint minimise_bent(FitPoint point);
  std::string alike(const FitPoint& taken, const FitPoint& other) const;
  void hold_stage(FitValues& values) const {
    values[fit_compliance] = options_.compliance.value_or(0.0);
    values[fit_delay] = options_.delay.value_or(0.0);
  }
  bool several_speeds() const { return data_.ratio_of_speeds >= one_speed; }
  /// Returns whether turns of the motion pass through speeds well below the fastest. That suffices to fit a
  /// damper, which vanishes at high speed, but not a lubricant, for which the sliding speed must vary.
  bool slow_turns() const { return data_.fast >= one_speed * data_.slow; }
  bool several_loads() const { return data_.most_load >= several * data_.least_load; }
  FitPoint keep_determined(FitPoint point);
  FitPoint keep_predicting(FitPoint point);
  double held_out(const FitPoint& point);
  double forecast(const FitPoint& point);
  bool drop_one(FitPoint& point, bool with_bristles = false);
  PopulationError bristle_error(const FitPoint& point, const Eigen::MatrixXd& j, const Eigen::VectorXd& r) {
    return population_error(model_, point, j, r, bristles_per_newton * data_.mean_load);
  }
  bool is_determined(const FitPoint& point, const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& cov,
                     Eigen::Index i) const;
  bool at_an_edge(FitPoint& point);
  std::string lacking(FitParameter p) const;
  void leave(FitPoint& point, FitParameter p, const std::string& why);
  std::vector<FitPoint> as_good(const FitPoint& point, FitParameter open);
  FitPoint take_middle(FitPoint point, FitParameter open);
  /// Returns the mean square by which a function of the parameters varies over the points that fit as well as
  /// the best, for parameters that the data leave open.
  template <typename Function>
  double open_variance(const Function& function) const {
    double sum = 0.0;
    for (const Row& row : rows_) {
      const double middle = function(row.middle.values);
      for (const FitPoint& point : row.points)
        sum += std::pow(function(point.values) - middle, 2) / static_cast<double>(row.points.size());
    }
    return sum;
  }
  double widened_by_rival(const FitPoint& point, const Eigen::MatrixXd& j, FitParameter p);
  void refuse_without_friction(const FitPoint& point);
  std::string why_no_peak(const FitPoint& point, const FitResult& result);
  FitResult report(const FitPoint& point);
  void note(const FitPoint& point, FitResult& result) const;
  void derive(const FitPoint& point, const Eigen::MatrixXd& cov, double quantile, FitResult& result);

  Eigen::VectorXd residuals(const FitPoint& point) {
    assume(model_, point);
    return model_.force(point.values) - Eigen::Map<const Eigen::VectorXd>(data_.force.data(), samples());
  }
  Eigen::Index samples() const { return static_cast<Eigen::Index>(data_.force.size()); }
  double samples_that_count(const FitPoint& point) {
    if (options_.for_prediction) return static_cast<double>(samples());
    return static_cast<double>(samples()) / correlated_samples(residuals(point));
  }
  /// Returns Bayes' information criterion of a fit for the effective number of samples `count`. The weight of
  /// parameters is doubled, so that the chance properties of few bristles do not pass for a damper.
  double criterion(const FitPoint& point, double count) const {
    return count * std::log(std::max(point.sum_of_squares, 1e-300)) + price(point.free.size(), count);
  }
  /// Whether a fit has the lower criterion, at its own number of samples that count, than another one.
  bool justified(const FitPoint& point, const FitPoint& other) {
    const double count = samples_that_count(point);
    return criterion(point, count) < criterion(other, count);
  }
  /// Returns the penalty that the information criterion adds for a number of parameters.
  static double price(std::size_t parameters, double count) {
    return 2.0 * static_cast<double>(parameters) * std::log(count);
  }
  /// Lists the parameters in which the force is linear: the kinetic coefficient and, if the motion goes both
  /// ways, offset and drift of the sensor.
  FitParameterSet linear_set() const;
  /// Returns whether the motion goes both ways far enough to tell an offset of the sensor from friction; a
  /// few samples backwards are not.
  bool two_ways() const;

  const FitData& data_;
  const FitOptions& options_;
  FitModel model_;
  std::array<std::string, fit_parameters> why_;
  std::string stage_note_;  // sentence, if the record cannot tell a delay of the sensor from a compliance of
                            // the stage
  struct Row {
    FitPoint middle;
    std::vector<FitPoint> points;
  };
  std::vector<Row> rows_;  // for each undetermined parameter, points that fit as well as the best
  Progress& progress_;
};

}  // namespace cli
