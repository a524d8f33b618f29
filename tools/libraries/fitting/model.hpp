// Computes friction along a measured path, and its derivatives, as a function of a fit's parameters.
#pragma once

#include <Eigen/Core>

#include "tools/libraries/fitting/fit.hpp"

namespace cli {

class FitModel {
 public:
  FitModel(const FitData& data, const FitOptions& options, Detail detail);

  void set_past(Past past) {
    if (past != past_) known_values_ = settled_ = {};
    past_ = past;
  }
  /// Sets the force by which the stage bends to the brush's own under these values. Between settlings the
  /// stage's force stays as it is, whatever values are tried.
  void settle(const FitValues& values);
  /// Bends the stage by the force that bends it in another model of the record.
  void bend_as(const FitModel& other) {
    stage_force_ = other.stage_force_;
    known_values_ = {};
  }
  const Past& past() const { return past_; }
  Detail detail() const { return detail_; }

  /// Returns the force by the body at the samples (N), as the sensor measures it.
  Eigen::VectorXd force(const FitValues& values);
  /// Returns the derivative of the force by a parameter, times scale() of that parameter. Parameters that
  /// shape the brush need differences: central ones, or one-sided ones at half the cost.
  Eigen::VectorXd derivative(const FitValues& values, FitParameter parameter, bool central = true);
  /// Returns the unit in which a parameter is varied: its own value if it is positive by nature (then its
  /// logarithm is fitted), else a unit that suits the data.
  double scale(const FitValues& values, FitParameter parameter) const;
  static bool is_logarithmic(FitParameter p) {
    return p == fit_kinetic || p == fit_length || p == fit_spread || p == fit_stribeck || p == fit_delay;
  }
  /// Returns whether a parameter shapes the elastic force, so that the brush must be stepped again.
  static bool bends(FitParameter p) { return p >= fit_length && p <= fit_softening; }
  struct Range {
    double low, high;
  };
  /// Returns the range in which a parameter is searched.
  Range range(FitParameter parameter) const;
  double lowest(FitParameter parameter) const { return range(parameter).low; }
  double highest(FitParameter parameter) const { return range(parameter).high; }

  /// Returns the elastic friction at the samples (N) for an elastic friction coefficient of 1.
  const Eigen::VectorXd& elastic(const FitValues& values);
  /// Returns the mean deflection in steady sliding (m): kinetic coefficient over stiffness per newton.
  double kinetic_deflection(const FitValues& values) const {
    return unit_material(values).kinetic_coefficient();
  }
  /// Returns a material with one bristle per newton whose kinetic coefficient is 1 per metre of deflection.
  bristle::Material unit_material(const FitValues& values) const;
  int evaluations() const { return evaluations_; }
  const FitData& data() const { return data_; }
  const FitOptions& options() const { return options_; }

 private:
  double decay(double u) const;
  /// Returns the sum of share x lever^2 x function(lever) over the rings of a turning disc; function(1) for a
  /// contact that slides as a whole.
  template <class Function>
  double over_rings(Function&& function) const {
    double sum = 0.0;
    for (const Ring& ring : rings_) sum += ring.share * ring.lever * ring.lever * function(ring.lever);
    return sum;
  }
  double damper(double speed, double stribeck) const;
  /// Returns the friction (N) at every point of the path, without what the sensor adds.
  std::vector<double> force_on_stage(const FitValues& values);
  /// Applies the sensor's first-order low-pass to a force that is linear between samples.
  Eigen::VectorXd low_passed(Eigen::VectorXd force, double time) const;
  BrushShape shape(const FitValues& values) const;
  /// Bends the path of the contact by the stage.
  void bend_path(const FitValues& values);
  /// Returns the friction at the samples (N), without what the sensor adds.
  Eigen::VectorXd friction(const FitValues& values);
  Eigen::VectorXd derivative_before_sensor(const FitValues& values, FitParameter parameter, bool central);
  Eigen::VectorXd elastic_at(const FitValues& values);
  Eigen::VectorXd bent_derivative(const FitValues& values, FitParameter parameter, bool central);

  const FitData& data_;
  const FitOptions& options_;
  Detail detail_;
  std::vector<double> stage_force_;   // force by which the stage bends, N, at the points of the path
  std::vector<PathPoint> bent_path_;  // path of the contact, along which brush_ steps
  PathForce brush_;
  std::vector<Ring> rings_;
  double square_lever_ = 1.0;  // mean of the rings' squared levers, weighted by load
  Past past_;
  std::vector<double> speed_;  // speed of the contact at the samples, m/s
  FitValues known_values_{}, settled_{};
  Eigen::VectorXd known_;
  int evaluations_ = 0;
};

}  // namespace cli
