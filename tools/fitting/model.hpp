// Friction along a measured path as a function of the fitted parameters, and its derivatives.
#pragma once

#include <Eigen/Core>

#include "tools/fitting/fit.hpp"

namespace cli {

class FitModel {
 public:
  FitModel(const FitData& data, const FitOptions& options) : data_(data), options_(options) {}

  void set_start(StartState start) {
    if (start != start_) known_length_ = 0.0;
    start_ = start;
  }
  StartState start() const { return start_; }

  /// N, by the body, at the samples.
  Eigen::VectorXd force(const FitValues& values);
  /// dF/dp times scale(p). Length and spread by differences: central ones, or one-sided ones at half the
  /// cost.
  Eigen::VectorXd derivative(const FitValues& values, FitParameter parameter, bool central = true);
  /// A step of a parameter that counts as one: the value itself where it is positive by nature (a logarithm
  /// is fitted), else a natural unit of the data.
  double scale(const FitValues& values, FitParameter parameter) const;
  static bool is_logarithmic(FitParameter p) {
    return p == fit_kinetic || p == fit_length || p == fit_spread || p == fit_stribeck;
  }
  /// Range in which a parameter is looked for.
  double lowest(FitParameter parameter) const;
  double highest(FitParameter parameter) const;

  /// Elastic friction for a kinetic coefficient of 1, N.
  const Eigen::VectorXd& elastic(double length, double spread);
  int evaluations() const { return evaluations_; }
  const FitData& data() const { return data_; }
  const FitOptions& options() const { return options_; }

 private:
  double decay(double speed, double stribeck) const;
  Eigen::VectorXd elastic_at(double length, double spread);

  const FitData& data_;
  const FitOptions& options_;
  StartState start_ = StartState::straight;
  double known_length_ = 0.0, known_spread_ = 0.0;
  Eigen::VectorXd known_;
  int evaluations_ = 0;
};

}  // namespace cli
