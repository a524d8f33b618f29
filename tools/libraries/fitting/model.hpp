// Computes friction along a measured path, and its derivatives, as a function of a fit's parameters.
#pragma once

#include <Eigen/Core>

#include "tools/libraries/fitting/fit.hpp"

namespace cli {

class FitModel {
 public:
  FitModel(const FitData& data, const FitOptions& options, Detail detail);

  void set_past(Past past) {
    if (past != past_) known_values_ = {};
    past_ = past;
  }
  Past past() const { return past_; }
  void set_frame(const FitFrame& frame) {
    if (frame != frame_) known_values_ = {};
    frame_ = frame;
  }
  const FitFrame& frame() const { return frame_; }
  Detail detail() const { return detail_; }

  /// Returns the force by the body at the samples (N), as the sensor measures it.
  Eigen::VectorXd force(const FitValues& values);
  /// Returns the force at the samples before the sensor's delay and offset; it deflects a compliant stage.
  Eigen::VectorXd force_on_stage(const FitValues& values);
  /// Sets the force that deflects a compliant stage (N, by the body, at the samples). Without this call it is
  /// the measured force.
  void set_stage_force(Eigen::VectorXd force) {
    stage_force_ = std::move(force);
    known_values_ = {};
  }
  const Eigen::VectorXd& stage_force() const { return stage_force_; }
  /// Sets the force that deflects the stage to the model's own, found by iteration without measured forces.
  void settle_stage(const FitValues& values);
  /// Returns the path of the contact: the measured path less the deflection of the stage.
  std::vector<PathPoint> contact_path(const FitValues& values) const;
  /// Returns the derivative of the force by a parameter, times scale() of that parameter. Parameters that
  /// shape the brush need differences: central ones, or one-sided ones at half the cost.
  Eigen::VectorXd derivative(const FitValues& values, FitParameter parameter, bool central = true);
  /// Returns the unit in which a parameter is varied: its own value if it is positive by nature (then its
  /// logarithm is fitted), else a unit that suits the data.
  double scale(const FitValues& values, FitParameter parameter) const;
  static bool is_logarithmic(FitParameter p) {
    return p == fit_kinetic || p == fit_length || p == fit_spread || p == fit_stribeck ||
           p == fit_ageing_time || p == fit_strengthening_speed || p == fit_compliance || p == fit_delay;
  }
  /// Returns whether a parameter shapes the elastic force, so that the brush must be stepped again.
  static bool bends(FitParameter p) { return p >= fit_length && p <= fit_ageing_time; }
  struct Range {
    double low, high;
  };
  /// Returns the range in which a parameter is searched.
  Range range(FitParameter parameter) const;
  double lowest(FitParameter parameter) const { return range(parameter).low; }
  double highest(FitParameter parameter) const { return range(parameter).high; }

  /// Returns the elastic friction at the samples (N) for an elastic friction coefficient of 1.
  const Eigen::VectorXd& elastic(const FitValues& values);
  /// Returns the elastic friction coefficient: the kinetic one less what strengthening with speed adds.
  double elastic_coefficient(const FitValues& values) const;
  /// Returns the mean deflection in steady sliding (m): elastic coefficient over stiffness per newton.
  double kinetic_deflection(const FitValues& values) const;
  /// Returns the ageing of the fitted values in the form that a Material takes.
  bristle::Ageing ageing(const FitValues& values) const;
  /// Returns a material with one bristle per newton whose kinetic coefficient is 1 per metre of deflection.
  bristle::Material unit_material(const FitValues& values) const;
  int evaluations() const { return evaluations_; }
  const FitData& data() const { return data_; }
  const FitOptions& options() const { return options_; }

 private:
  double decay(double u) const;
  /// Returns the sum of share x lever^power x function(lever) over the rings of a turning disc; function(1)
  /// for a contact that slides as a whole.
  template <class Function>
  double over_rings(int power, Function&& function) const {
    double sum = 0.0;
    for (const Ring& ring : rings_)
      sum += ring.share * (power == 1 ? ring.lever : ring.lever * ring.lever) * function(ring.lever);
    return sum;
  }
  double damper(double speed, double stribeck) const;
  Eigen::VectorXd derivative_before_sensor(const FitValues& values, FitParameter parameter, bool central);
  /// Applies the sensor's first-order low-pass to a force that is linear between samples.
  Eigen::VectorXd low_passed(Eigen::VectorXd force, double time) const;
  BrushShape shape(const FitValues& values) const;
  Eigen::VectorXd elastic_at(const FitValues& values);
  Eigen::VectorXd bent_derivative(const FitValues& values, FitParameter parameter, bool central);
  /// Scales the force up in one direction of motion and down in the other, by `asymmetry`.
  Eigen::VectorXd skewed(Eigen::VectorXd force, double asymmetry) const;
  /// Returns what strengthening with speed adds to friction over load, per unit of strength, at a sample.
  double strengthening(std::size_t row, double speed_scale) const;

  const FitData& data_;
  const FitOptions& options_;
  Detail detail_;
  Eigen::VectorXd stage_force_;
  std::vector<PathPoint> bent_path_;  // path of the contact, along which brush_ steps
  PathForce brush_;
  std::vector<Ring> rings_;
  double square_lever_ = 1.0;  // mean of the rings' squared levers, weighted by load
  Past past_;
  FitFrame frame_;
  std::vector<double> speed_;  // speed of the contact at the samples, m/s
  FitValues known_values_{};
  Eigen::VectorXd known_;
  int evaluations_ = 0;
};

}  // namespace cli
