// Computes the friction along a measured path, and its derivatives, as a function of the parameters of a fit.
#pragma once

#include <Eigen/Core>

#include "tools/libraries/fitting/fit.hpp"

namespace cli {

/// Returns the measured force of a record, N, in the form of a vector for least squares.
inline Eigen::Map<const Eigen::VectorXd> measured_force(const FitData& data) {
  return {data.force.data(), static_cast<Eigen::Index>(data.force.size())};
}

/// Returns the measured force (N, by the body) less the fitted offset and drift of the sensor, which are no
/// friction.
Eigen::VectorXd friction_measured(const FitData& data, const FitValues& values);

class FitModel {
 public:
  FitModel(const FitData& data, const FitOptions& options, Detail detail);

  void set_past(Past past) {
    if (past != past_) known_values_ = settled_ = {};
    past_ = past;
  }
  /// Sets the force that bends the stage to the brush's own force at these values. Until the next call the
  /// stage's force stays, whatever values are tried, so that the minimised function does not change
  /// meanwhile.
  void settle(const FitValues& values);
  /// Bends the stage by the force that bends it in another model of the same record.
  void bend_as(const FitModel& other) {
    stage_force_ = other.stage_force_;
    known_values_ = {};
  }
  const Past& past() const { return past_; }
  Detail detail() const { return detail_; }

  /// Returns the force by the body at the samples (N), as the sensor measures it: with offset, drift and
  /// delay.
  Eigen::VectorXd force(const FitValues& values);
  /// Returns the derivative of the force by a parameter, times scale() of that parameter. For parameters that
  /// shape the brush takes central differences or, at half the cost, one-sided ones.
  Eigen::VectorXd derivative(const FitValues& values, FitParameter parameter, bool central = true);
  /// Returns the unit in which a parameter is varied. A parameter that is positive by nature has its own
  /// value as unit, so its logarithm is fitted; others have a unit that suits the data.
  double scale(const FitValues& values, FitParameter parameter) const;
  static bool is_logarithmic(FitParameter p) {
    return p == fit_kinetic || p == fit_length || p == fit_spread || p == fit_stribeck || p == fit_delay;
  }
  /// Returns whether a parameter shapes the elastic force, so that the brush has to be stepped again for each
  /// value.
  static bool bends(FitParameter p) { return p >= fit_length && p <= fit_softening; }
  struct Range {
    double low, high;
  };
  /// Returns the range in which a parameter is searched.
  Range range(FitParameter parameter) const;
  double lowest(FitParameter parameter) const { return range(parameter).low; }
  double highest(FitParameter parameter) const { return range(parameter).high; }

  /// Returns the elastic friction at the samples (N), for an elastic friction coefficient of 1.
  const Eigen::VectorXd& elastic(const FitValues& values);
  /// Returns the mean deflection in steady sliding (m), which is the kinetic coefficient over the stiffness
  /// per newton of load.
  double kinetic_deflection(const FitValues& values) const {
    return unit_material(values).kinetic_coefficient();
  }
  /// Returns a material with one bristle per newton and a kinetic coefficient of 1 per metre of mean
  /// deflection.
  bristle::Material unit_material(const FitValues& values) const;
  const FitData& data() const { return data_; }
  const FitOptions& options() const { return options_; }

 private:
  double decay(double u) const;
  /// Returns a sum over the rings of a turning disc: share of the load x lever^2 x function(lever). For a
  /// contact that slides as a whole this is function(1).
  template <class Function>
  double over_rings(Function&& function) const {
    double sum = 0.0;
    for (const Ring& ring : rings_) sum += ring.share * ring.lever * ring.lever * function(ring.lever);
    return sum;
  }
  double damper(double speed, double stribeck) const;
  /// Returns the friction (N) at every point of the path, without offset, drift and delay of the sensor.
  std::vector<double> force_on_stage(const FitValues& values);
  /// Applies the sensor's first-order low-pass of this time (s) to a force that is linear between samples.
  Eigen::VectorXd low_passed(Eigen::VectorXd force, double time) const;
  BrushShape shape(const FitValues& values) const;
  /// Subtracts from the path of the contact the distance by which the stage bends.
  void bend_path(const FitValues& values);
  /// Returns the friction at the samples (N), without offset, drift and delay of the sensor.
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
};

}  // namespace cli
