// Computes friction along a measured path as a function of the fitted parameters, with its derivatives.
#pragma once

#include <Eigen/Core>

#include "tools/fitting/fit.hpp"

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

  /// Returns the force at the samples, N, by the body.
  Eigen::VectorXd force(const FitValues& values);
  /// Returns the force before the sensor's delay and offset, which is the force that bends a compliant stage.
  Eigen::VectorXd force_on_stage(const FitValues& values);
  /// Sets the force that bends a compliant stage (N, by the body, at the samples). Initially it is the
  /// measured force.
  void set_stage_force(Eigen::VectorXd force) {
    stage_force_ = std::move(force);
    known_values_ = {};
  }
  const Eigen::VectorXd& stage_force() const { return stage_force_; }
  /// Sets the force that bends the stage to the model's own, found by iteration without the measured force.
  void settle_stage(const FitValues& values);
  /// Returns the path of the contact, shifted by the bending of the stage.
  std::vector<PathPoint> contact_path(const FitValues& values) const;
  /// Returns the derivative of the force by a parameter, times scale() of the parameter. Parameters that
  /// shape the brush need finite differences: central, or one-sided at half the cost.
  Eigen::VectorXd derivative(const FitValues& values, FitParameter parameter, bool central = true);
  /// Returns the unit step of a parameter: the value itself if it is positive by nature (its logarithm is
  /// fitted), else a natural unit of the data.
  double scale(const FitValues& values, FitParameter parameter) const;
  static bool is_logarithmic(FitParameter p) {
    return p == fit_kinetic || p == fit_length || p == fit_spread || p == fit_stribeck ||
           p == fit_ageing_time || p == fit_strengthening_speed || p == fit_compliance || p == fit_delay;
  }
  /// Returns whether a parameter shapes the elastic force; the others leave that force unchanged.
  static bool bends(FitParameter p) { return p >= fit_length && p <= fit_ageing_time; }
  /// Returns the lower end of the range in which a parameter is searched; highest() returns the upper end.
  double lowest(FitParameter parameter) const;
  double highest(FitParameter parameter) const;

  /// Returns the elastic friction for an elastic coefficient of 1, N.
  const Eigen::VectorXd& elastic(const FitValues& values);
  /// Returns fit_kinetic minus the part that strengthening with speed adds.
  double elastic_coefficient(const FitValues& values) const;
  /// Returns the mean deflection in steady sliding, m: elastic coefficient over stiffness per newton.
  double kinetic_deflection(const FitValues& values) const;
  /// Returns the ageing at these fitted values in the form that a material takes.
  bristle::Ageing ageing(const FitValues& values) const;
  /// Returns a material with one bristle per newton whose kinetic coefficient is 1 per metre of deflection.
  bristle::Material unit_material(const FitValues& values) const;
  int evaluations() const { return evaluations_; }
  const FitData& data() const { return data_; }
  const FitOptions& options() const { return options_; }

 private:
  double decay(double u) const;
  /// Returns the sum of share x lever^power x function(lever) over the rings of a contact that turns as a
  /// disc; function(1) for other contacts.
  template <class Function>
  double over_rings(int power, Function&& function) const {
    double sum = 0.0;
    for (const Ring& ring : rings_)
      sum += ring.share * (power == 1 ? ring.lever : ring.lever * ring.lever) * function(ring.lever);
    return sum;
  }
  double damper(double speed, double stribeck) const;
  Eigen::VectorXd derivative_before_sensor(const FitValues& values, FitParameter parameter, bool central);
  Eigen::VectorXd before_sensor(const FitValues& values);
  /// Applies a first-order low-pass to a force that is linear between samples.
  Eigen::VectorXd low_passed(Eigen::VectorXd force, double time) const;
  BrushShape shape(const FitValues& values) const;
  Eigen::VectorXd elastic_at(const FitValues& values);
  Eigen::VectorXd bent_derivative(const FitValues& values, FitParameter parameter, bool central);
  /// Scales the force up in one direction and down in the other.
  Eigen::VectorXd skewed(Eigen::VectorXd force, double asymmetry) const;
  /// Returns friction over load per unit of strengthening with speed, at a sample, along the axis.
  double strengthening(std::size_t row, double speed_scale) const;

  const FitData& data_;
  const FitOptions& options_;
  Detail detail_;
  Eigen::VectorXd stage_force_;
  std::vector<PathPoint> bent_path_;  // path of the contact, which brush_ steps along
  PathForce brush_;
  std::vector<Ring> rings_;
  double square_lever_ = 1.0;  // mean square of the rings' levers, weighted by load
  Past past_;
  FitFrame frame_;
  std::vector<double> speed_;  // m/s, speed of the contact at the samples
  FitValues known_values_{};
  Eigen::VectorXd known_;
  int evaluations_ = 0;
};

}  // namespace cli
