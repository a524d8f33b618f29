#include "tools/fitting/least_squares.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <unsupported/Eigen/NonLinearOptimization>

namespace cli {
namespace {

/// A sum of squares in the form that Eigen's Levenberg-Marquardt takes.
struct Function {
  using Scalar = double;
  const SumOfSquares& sum;
  Eigen::Index unknowns;

  int inputs() const { return static_cast<int>(unknowns); }
  int values() const { return static_cast<int>(sum.residuals); }
  int operator()(const Eigen::VectorXd& u, Eigen::VectorXd& out) const {
    sum.fill(u, out);
    return 0;
  }
  int df(const Eigen::VectorXd& u, Eigen::MatrixXd& out) const {
    sum.differentiate(u, out);
    return 0;
  }
};

}  // namespace

Eigen::VectorXd solve_least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

Eigen::VectorXd solve_shortest(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  return a.completeOrthogonalDecomposition().solve(b);
}

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& a) {
  return a.completeOrthogonalDecomposition().pseudoInverse();
}

Eigen::VectorXd singular_values(const Eigen::MatrixXd& a) { return a.jacobiSvd().singularValues(); }

EigenBasis eigen_basis(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  return {solver.eigenvectors(), solver.eigenvalues()};
}

void minimise(const SumOfSquares& sum, const LevenbergLimits& limits, Eigen::VectorXd& unknowns) {
  Function function{sum, unknowns.size()};
  Eigen::LevenbergMarquardt<Function> solver(function);
  solver.parameters.maxfev = limits.evaluations;
  solver.parameters.ftol = limits.ftol;
  solver.parameters.xtol = limits.xtol;
  solver.parameters.factor = limits.factor;
  solver.minimize(unknowns);
}

}  // namespace cli
