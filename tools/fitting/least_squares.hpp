// Least squares by Eigen behind plain functions: its decompositions are compiled once, in one file.
#pragma once

#include <functional>

#include <Eigen/Core>

namespace cli {

/// x that minimises |a x - b|; columns of `a` that depend on others get 0.
Eigen::VectorXd solve_least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// The shortest x of those that minimise |a x - b|.
Eigen::VectorXd solve_shortest(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// x that minimises x' normal x - 2 x' side, its first `count` numbers none negative (Lawson and Hanson).
Eigen::VectorXd solve_nonnegative(const Eigen::MatrixXd& normal, const Eigen::VectorXd& side,
                                  Eigen::Index count);

/// The matrix that solve_shortest() multiplies b by.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& a);

Eigen::VectorXd singular_values(const Eigen::MatrixXd& a);

/// Eigenvectors of a symmetric matrix, its columns, and its eigenvalues from the smallest on.
struct EigenBasis {
  Eigen::MatrixXd vectors;
  Eigen::VectorXd values;
};
EigenBasis eigen_basis(const Eigen::MatrixXd& symmetric);

/// A sum of squares to minimise: what fills the residuals, and their derivatives (a column for each unknown).
struct SumOfSquares {
  Eigen::Index residuals = 0;
  std::function<void(const Eigen::VectorXd&, Eigen::VectorXd&)> fill;
  std::function<void(const Eigen::VectorXd&, Eigen::MatrixXd&)> differentiate;
};

/// When Levenberg-Marquardt stops: as MINPACK's lmder names it. `factor` bounds the first step.
struct LevenbergLimits {
  int evaluations;
  double ftol, xtol, factor;
};

/// Levenberg-Marquardt (MINPACK's lmder) from `unknowns`, which become the best found.
void minimise(const SumOfSquares& sum, const LevenbergLimits& limits, Eigen::VectorXd& unknowns);

}  // namespace cli
