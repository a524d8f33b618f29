// Tests whether a term of a fit predicts parts of the record to which it was not fitted.
#include <cmath>

#include <Eigen/Cholesky>

#include "tools/libraries/fitting/fitter.hpp"
#include "tools/libraries/fitting/least_squares.hpp"

namespace cli {

/// Cuts the record into blocks and holds out every fifth one in turn. Each kind of event then occurs in
/// fitted and in held-out parts, and correlated neighbours stay together. The parameters of a fit without a
/// part follow to first order from derivatives, so no fit is repeated.
double held_out_squares(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                        std::size_t samples) {
  constexpr std::size_t folds = 5;
  const Eigen::VectorXd length = jacobian.colwise().norm().cwiseMax(1e-300);
  const Eigen::MatrixXd j = jacobian * length.cwiseInverse().asDiagonal();
  const auto fold_of = [&](Eigen::Index row) {
    return static_cast<std::size_t>(row) % samples * mixed_blocks / samples % folds;
  };
  const Eigen::MatrixXd whole = j.transpose() * j;
  const Eigen::VectorXd gradient = j.transpose() * residuals;
  double squares = 0.0;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    Eigen::MatrixXd normal = whole;
    Eigen::VectorXd slope = gradient;
    for (Eigen::Index row = 0; row < j.rows(); ++row) {
      if (fold_of(row) != fold) continue;
      normal.noalias() -= j.row(row).transpose() * j.row(row);
      slope -= j.row(row).transpose() * residuals[row];
    }
    normal.diagonal().array() += 1e-9;
    const Eigen::VectorXd step = normal.ldlt().solve(-slope);
    for (Eigen::Index row = 0; row < j.rows(); ++row)
      if (fold_of(row) == fold) squares += std::pow(residuals[row] + j.row(row).dot(step), 2);
  }
  return squares;
}

double Fitter::held_out(const FitPoint& point) {
  assume(model_, point);
  return held_out_squares(jacobian(model_, point), residuals(point), data_.samples());
}

/// Returns the sum of squared errors (N^2) in the later fifths of a record, where each is forecast by the
/// sensor's offset and drift as fitted to all earlier samples. (A drift fitted to samples on both sides would
/// follow any slow change.)
double Fitter::forecast(const FitPoint& point) {
  constexpr std::size_t parts = 5, first = 2;
  FitPoint sensor = point;
  sensor.free.clear();
  for (const FitParameter p : {fit_offset, fit_drift, fit_offset_y, fit_drift_y})
    if (contains(point.free, p)) sensor.free.push_back(p);
  assume(model_, point);
  const Eigen::MatrixXd j = jacobian(model_, sensor);
  const Eigen::VectorXd r = residuals(point);
  const auto part_of = [&](Eigen::Index row) {
    return static_cast<std::size_t>(row) % data_.samples() * parts / data_.samples();
  };
  double squares = 0.0;
  for (std::size_t part = first; part < parts; ++part) {
    std::vector<Eigen::Index> before, here;
    for (Eigen::Index row = 0; row < j.rows(); ++row) {
      if (part_of(row) < part) before.push_back(row);
      if (part_of(row) == part) here.push_back(row);
    }
    const Eigen::VectorXd step = solve_least_squares(j(before, Eigen::all), -r(before));
    squares += (r(here) + j(here, Eigen::all) * step).squaredNorm();
  }
  return squares;
}

/// Removes terms that lower the residuals but do not predict held-out parts of the record. The plain brush
/// and the sensor's offset stay in any case.
FitPoint Fitter::keep_predicting(FitPoint point) {
  for (const FitParameter p : {fit_drift, fit_drift_y, fit_softening, fit_delay, fit_damping, fit_viscous,
                               fit_renewal, fit_residual}) {
    if (!contains(point.free, p)) continue;
    const auto why = why_;
    const FitPoint left =
        without(point, p, "what it was not fitted to is predicted no better with it (held-out error)", true);
    const bool drifts = p == fit_drift || p == fit_drift_y;
    if ((drifts ? forecast(left) <= forecast(point) : held_out(left) <= held_out(point)))
      point = left;
    else
      why_ = why;
  }
  return point;
}

}  // namespace cli
