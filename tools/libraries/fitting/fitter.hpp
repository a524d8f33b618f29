// Fits one kind of brush to one record of measured friction: searches the best parameters, adds terms that
// the data show, and holds parameters that the data do not determine. Used only within this folder.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "tools/libraries/fitting/fit.hpp"
#include "tools/libraries/fitting/model.hpp"
#include "tools/libraries/fitting/solve.hpp"

namespace cli {

// Ratio of fast to slow speed below which a record counts as having a single speed, and shows no dependence
// on speed.
inline constexpr double one_speed = 1.3;
inline constexpr double bristles_per_newton = 900.0;

inline bool contains(const FitParameterSet& set, FitParameter p) {
  return std::count(set.begin(), set.end(), p) > 0;
}

inline void take_out(FitParameterSet& set, FitParameter p) {
  set.erase(std::remove(set.begin(), set.end(), p), set.end());
}

inline bool better(const FitPoint& a, const FitPoint& b) { return a.sum_of_squares < b.sum_of_squares; }

/// Returns the Stribeck velocities that a fit tries, in a geometric series around the record's speeds.
inline std::vector<double> trial_stribeck_velocities(const FitData& data) {
  std::vector<double> all;
  for (double speed = data.slow / 4.0; speed < 4.0 * data.fast; speed *= 1.8) all.push_back(speed);
  return all;
}

/// Result of a search: the best point, and for each parameter that is not fitted the reason.
struct Found {
  FitPoint point;
  std::array<std::string, fit_parameters> why;
  std::vector<std::string> notes;
  std::vector<FitPoint> as_good;  ///< points that fit as well, with other values of what is not determined
};

/// Fits one kind of brush to one record of measured friction.
class Fitter {
 public:
  Fitter(const FitData& data, const FitOptions& options, Detail detail)
      : data_(data), options_(options), model_(data, options, detail) {}

  /// Searches the best brush without rubbing; residual and shared renewal are 0, or as the options fix them.
  Found search_plain();
  /// Adds rubbing (residual and shared renewal) to a brush if the information criterion says that the better
  /// fit justifies the two parameters.
  Found add_rubbing(const Found& plain);
  /// Adds a lubricant, a damper or both, even if the information criterion does not justify them; held-out
  /// blocks then decide.
  Found with_speed_terms(const Found& plain);
  /// Adds a stage that bends under the force, a sensor that lags, or both, if the information criterion
  /// justifies their parameters.
  Found add_stage(const Found& plain);
  /// Fits a brush with the rule slide and a free law of snap lengths. Sets `quantiles` to those of the law
  /// found.
  Found with_free_law(const Found& found, std::vector<double>& quantiles);
  /// Fits to this record from a point that was found on another record or with another detail.
  Found fit_again(const Found& found);
  /// Fits to this record from a point, and holds the parameters that the record does not determine. Throws
  /// UserError if there is no friction.
  Found hold_undetermined(const Found& found);
  /// Fits to this record those parameters of a point that were not held.
  Found refine(const Found& held);
  FitResult finish(const Found& refined);

 private:
  FitParameterSet bending() const {
    FitParameterSet set{fit_length};
    if (has_spread(options_.law)) set.push_back(fit_spread);
    return set;
  }
  Found found(const FitPoint& point) const { return {point, why_, notes_, as_good_}; }
  /// Goes on from what was found before: its reasons, remarks and points that fit as well.
  void go_on(const Found& before) {
    why_ = before.why;
    notes_ = before.notes;
    as_good_ = before.as_good;
  }
  FitPoint linear_start(const FitValues& bent, const FitParameterSet& linear);
  FitPoint search_grid();
  FitPoint try_starts(FitPoint best);
  FitPoint try_later_starts(FitPoint point);
  bool promises(const FitPoint& point, const FitPoint& core);
  std::vector<FitPoint> speed_candidates(const FitPoint& core);
  FitPoint add_speed_terms(const FitPoint& core);
  /// Returns whether several samples lie within the presliding of a point, so that the record shows the
  /// course of presliding.
  bool resolves(const FitPoint& point) const { return point.values[fit_length] >= data_.finest_move; }
  bool several_speeds() const { return data_.ratio_of_speeds >= one_speed; }
  /// Returns whether the motion passes, at its reversals, through speeds well below the fastest. That
  /// suffices to fit a damper, which vanishes at high speed, but not a lubricant, for which the speed of
  /// sliding has to vary.
  bool slow_reversals() const { return data_.fast >= one_speed * data_.slow; }
  FitPoint keep_determined(FitPoint point);
  FitPoint keep_predicting(FitPoint point);
  double held_out(const FitPoint& point);
  double forecast(const FitPoint& point);
  bool at_an_edge(const FitPoint& point, FitParameter& edge, std::string& why) const;
  bool is_determined(const FitPoint& point, const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& cov,
                     Eigen::Index i) const;
  bool undetermined(const FitPoint& point, FitParameter& open, std::string& why);
  std::string lacking(FitParameter p) const;
  FitPoint without(const FitPoint& point, FitParameter p, const std::string& why, bool must_go = false);
  std::vector<FitPoint> as_good(const FitPoint& point, FitParameter open);
  FitPoint take_middle(FitPoint point, FitParameter open);
  /// Returns the mean square by which a function of the parameters varies over those points that fit as well
  /// as the best; it widens intervals where data leave a parameter open.
  template <typename Function>
  double open_variance(const Function& function) const {
    double sum = 0.0;
    const double middle = as_good_.empty() ? 0.0 : function(as_good_[as_good_.size() / 2].values);
    for (const FitPoint& point : as_good_)
      sum += std::pow(function(point.values) - middle, 2) / static_cast<double>(as_good_.size());
    return sum;
  }
  void refuse_without_friction(const FitPoint& point);
  std::string why_no_peak(const FitPoint& point, const FitResult& result);
  double bristles_shown(const FitPoint& point, const Eigen::VectorXd& residuals);
  Eigen::MatrixXd covariance_with_chance(const FitPoint& point, const Eigen::MatrixXd& jacobian,
                                         const Eigen::VectorXd& residuals, double correlated);
  FitResult report(const FitPoint& point);
  void note(FitResult& result) const;
  void derive(const FitPoint& point, const Eigen::MatrixXd& cov, double quantile, FitResult& result);

  Eigen::VectorXd residuals(const FitPoint& point) {
    assume(model_, point);
    return model_.force(point.values) - measured_force(data_);
  }
  Eigen::Index samples() const { return static_cast<Eigen::Index>(data_.force.size()); }
  double samples_that_count(const FitPoint& point) {
    return static_cast<double>(samples()) / correlated_samples(residuals(point));
  }
  /// Returns Bayes' information criterion of a fit for the effective number of samples `count`; lower is
  /// better. Parameters weigh twice as much as usual, so that the chance properties of few bristles do not
  /// pass for a damper.
  double criterion(const FitPoint& point, double count) const {
    return count * std::log(std::max(point.sum_of_squares, 1e-300)) +
           2.0 * static_cast<double>(point.free.size()) * std::log(count);
  }
  /// Returns whether the information criterion of a fit is lower than that of another one, with the number of
  /// samples that count for the first.
  bool justified(const FitPoint& point, const FitPoint& other) {
    const double count = samples_that_count(point);
    return criterion(point, count) < criterion(other, count);
  }
  /// Lists the parameters in which the force is linear: the kinetic coefficient and, if the motion goes both
  /// ways, the sensor's offset and drift. Least squares solve for these without a search.
  FitParameterSet linear_set() const;
  /// Returns whether the motion goes forward and backward far enough to tell an offset of the sensor from
  /// friction. A few samples backwards do not suffice.
  bool both_directions() const;

  const FitData& data_;
  const FitOptions& options_;
  FitModel model_;
  std::array<std::string, fit_parameters> why_;
  std::vector<std::string> notes_;
  std::vector<FitPoint> as_good_;  // points that fit as well as the best, with other spreads
};

}  // namespace cli
