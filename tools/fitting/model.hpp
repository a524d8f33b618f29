// Friction along a measured path as a function of the fitted parameters, and its derivatives.
#pragma once

#include <Eigen/Core>

#include "tools/fitting/fit.hpp"

namespace cli {

class FitModel {
 public:
  FitModel(const FitData& data, const FitOptions& options, Detail detail)
      : data_(data), options_(options), detail_(detail), brush_(data.path) {}

  void set_past(Past past) {
    if (past != past_) known_values_ = {};
    past_ = past;
  }
  Past past() const { return past_; }
  Detail detail() const { return detail_; }

  /// N, by the body, at the samples.
  Eigen::VectorXd force(const FitValues& values);
  /// dF/dp times scale(p). What bends the brush by differences: central ones, or one-sided ones at half the
  /// cost.
  Eigen::VectorXd derivative(const FitValues& values, FitParameter parameter, bool central = true);
  /// A step of a parameter that counts as one: the value itself where it is positive by nature (a logarithm
  /// is fitted), else a natural unit of the data.
  double scale(const FitValues& values, FitParameter parameter) const;
  static bool is_logarithmic(FitParameter p) {
    return p == fit_kinetic || p == fit_length || p == fit_spread || p == fit_stribeck;
  }
  /// A number that shapes the elastic force, which is the same for all others.
  static bool bends(FitParameter p) {
    return p == fit_length || p == fit_spread || p == fit_residual || p == fit_renewal;
  }
  /// Range in which a parameter is looked for.
  double lowest(FitParameter parameter) const;
  double highest(FitParameter parameter) const;

  /// Elastic friction for a kinetic coefficient of 1, N.
  const Eigen::VectorXd& elastic(const FitValues& values);
  /// Mean deflection in steady sliding, m: kinetic coefficient over stiffness per newton.
  double kinetic_deflection(const FitValues& values) const;
  /// Kinetic coefficient 1 per metre of it, one bristle per newton.
  bristle::Material unit_material(const FitValues& values) const;
  int evaluations() const { return evaluations_; }
  const FitData& data() const { return data_; }
  const FitOptions& options() const { return options_; }

 private:
  double decay(double speed, double stribeck) const;
  BrushShape shape(const FitValues& values) const;
  Eigen::VectorXd elastic_at(const FitValues& values);

  const FitData& data_;
  const FitOptions& options_;
  Detail detail_;
  PathForce brush_;
  Past past_;
  FitValues known_values_{};
  Eigen::VectorXd known_;
  int evaluations_ = 0;
};

}  // namespace cli
