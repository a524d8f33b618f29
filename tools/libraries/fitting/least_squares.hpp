// Least squares as plain functions over Eigen, so that Eigen's decompositions are compiled only once.
#pragma once

#include <functional>

#include <Eigen/Core>

namespace cli {

/// Returns an x that minimises |a x - b|. Unknowns whose columns depend on other columns are 0.
Eigen::VectorXd solve_least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// Returns the shortest of all x that minimise |a x - b|.
Eigen::VectorXd solve_shortest(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// Returns the x that minimises x' normal x - 2 x' side with its first `count` components >= 0, by the method
/// of Lawson and Hanson.
Eigen::VectorXd solve_nonnegative(const Eigen::MatrixXd& normal, const Eigen::VectorXd& side,
                                  Eigen::Index count);

/// Eigenvectors of a symmetric matrix (as columns), and its eigenvalues in ascending order.
struct EigenBasis {
  Eigen::MatrixXd vectors;
  Eigen::VectorXd values;
};
EigenBasis eigen_basis(const Eigen::MatrixXd& symmetric);

/// Sum of squares to be minimised: functions that compute the residuals and their derivatives (a column for
/// each unknown).
struct SumOfSquares {
  Eigen::Index residuals = 0;
  std::function<void(const Eigen::VectorXd&, Eigen::VectorXd&)> fill;
  std::function<void(const Eigen::VectorXd&, Eigen::MatrixXd&)> differentiate;
};

/// Limits at which Levenberg-Marquardt stops, as in MINPACK's lmder; `factor` limits the first step.
struct LevenbergLimits {
  int evaluations;
  double ftol, xtol, factor;
};

/// Installs a handler of Ctrl-C, after which all fits of this process end with the best that they have found.
void stop_fits_on_signals();
bool fit_stopped() noexcept;
inline constexpr const char* stopped_early = "stopped early: the best that was found until then";

/// Minimises a sum of squares by Levenberg-Marquardt (MINPACK's lmder). `unknowns`: the starting point,
/// replaced by the solution, or by the best found when fits are stopped.
void minimise(const SumOfSquares& sum, const LevenbergLimits& limits, Eigen::VectorXd& unknowns);

}  // namespace cli
