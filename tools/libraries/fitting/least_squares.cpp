#include "tools/libraries/fitting/least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <unsupported/Eigen/NonLinearOptimization>

#include "tools/libraries/platform/platform.hpp"

namespace cli {
namespace {

volatile std::sig_atomic_t stopped = 0;

/// Handles Ctrl-C. At the first signal the fit ends with the best brush found so far; the second one ends the
/// program.
void stop(int signal) {
  if (stopped != 0) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
  stopped = 1;
}

constexpr int ends = -1;  // answer by which a function ends Levenberg-Marquardt

/// Adapts a SumOfSquares to the interface that Eigen's Levenberg-Marquardt expects.
struct Function {
  using Scalar = double;
  const SumOfSquares& sum;
  Eigen::Index unknowns;

  int inputs() const { return static_cast<int>(unknowns); }
  int values() const { return static_cast<int>(sum.residuals); }
  int operator()(const Eigen::VectorXd& u, Eigen::VectorXd& out) const {
    if (fit_stopped()) return ends;
    sum.fill(u, out);
    return 0;
  }
  int df(const Eigen::VectorXd& u, Eigen::MatrixXd& out) const {
    if (fit_stopped()) return ends;
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

Eigen::VectorXd solve_nonnegative(const Eigen::MatrixXd& normal, const Eigen::VectorXd& side,
                                  Eigen::Index count) {
  const Eigen::Index n = side.size();
  std::vector<Eigen::Index> used;
  for (Eigen::Index i = count; i < n; ++i) used.push_back(i);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  const auto solved = [&] {
    const Eigen::VectorXd part = solve_shortest(normal(used, used), side(used));
    Eigen::VectorXd all = Eigen::VectorXd::Zero(n);
    all(used) = part;
    return all;
  };
  if (!used.empty()) x = solved();
  for (Eigen::Index round = 0; round < 3 * n; ++round) {
    const Eigen::VectorXd slope = side - normal * x;
    Eigen::Index steepest = -1;
    for (Eigen::Index i = 0; i < count; ++i)
      if (std::find(used.begin(), used.end(), i) == used.end() && slope[i] > 1e-9 * std::fabs(side[i]) &&
          (steepest < 0 || slope[i] > slope[steepest]))
        steepest = i;
    if (steepest < 0) break;
    used.push_back(steepest);
    // Moves towards the solution without bounds until an unknown reaches 0, then fixes that unknown at 0 and
    // solves again.
    for (;;) {
      const Eigen::VectorXd to = solved();
      double share = 1.0;
      for (const Eigen::Index i : used)
        if (i < count && to[i] <= 0.0) share = std::min(share, x[i] / (x[i] - to[i]));
      if (!(share < 1.0)) {
        x = to;
        break;
      }
      x += std::max(share, 0.0) * (to - x);
      used.erase(std::remove_if(used.begin(), used.end(),
                                [&](Eigen::Index i) {
                                  return i < count && to[i] <= 0.0 &&
                                         x[i] <= 1e-12 * to.cwiseAbs().maxCoeff();
                                }),
                 used.end());
      for (Eigen::Index i = 0; i < count; ++i)
        if (std::find(used.begin(), used.end(), i) == used.end()) x[i] = 0.0;
    }
  }
  return x;
}

EigenBasis eigen_basis(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  return {solver.eigenvectors(), solver.eigenvalues()};
}

void stop_fits_on_signals() { platform::on_stop_signals(&stop); }
bool fit_stopped() noexcept { return stopped != 0; }

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
