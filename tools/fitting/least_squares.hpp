// Wraps Eigen's least squares in plain functions, so that its decompositions are compiled once, in one file.
#pragma once

#include <functional>

#include <Eigen/Core>

namespace cli {

/// Returns x that minimises |a x - b|; columns of `a` that depend on others get 0.
Eigen::VectorXd solve_least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// Returns the shortest x that minimises |a x - b|.
Eigen::VectorXd solve_shortest(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// Returns x that minimises x' normal x - 2 x' side, with its first `count` components nonnegative (Lawson
/// and Hanson).
Eigen::VectorXd solve_nonnegative(const Eigen::MatrixXd& normal, const Eigen::VectorXd& side,
                                  Eigen::Index count);

/// Returns the matrix that solve_shortest() multiplies b by.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& a);

Eigen::VectorXd singular_values(const Eigen::MatrixXd& a);

/// Eigenvectors of a symmetric matrix, as columns, and its eigenvalues in ascending order.
struct EigenBasis {
  Eigen::MatrixXd vectors;
  Eigen::VectorXd values;
};
EigenBasis eigen_basis(const Eigen::MatrixXd& symmetric);

/// Sum of squares to minimise: functions that fill the residuals and their derivatives (a column per
/// unknown).
struct SumOfSquares {
  Eigen::Index residuals = 0;
  std::function<void(const Eigen::VectorXd&, Eigen::VectorXd&)> fill;
  std::function<void(const Eigen::VectorXd&, Eigen::MatrixXd&)> differentiate;
};

/// Stopping limits of Levenberg-Marquardt, named as in MINPACK's lmder. `factor` bounds the first step.
struct LevenbergLimits {
  int evaluations;
  double ftol, xtol, factor;
};

/// Minimises by Levenberg-Marquardt (MINPACK's lmder) from `unknowns`, which become the best found.
void minimise(const SumOfSquares& sum, const LevenbergLimits& limits, Eigen::VectorXd& unknowns);

}  // namespace cli
