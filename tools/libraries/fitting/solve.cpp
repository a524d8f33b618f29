#include "tools/libraries/fitting/solve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/libraries/fitting/least_squares.hpp"

namespace cli {
namespace {

/// Coordinates without bounds for the fitted parameters, in which Levenberg-Marquardt searches: the logarithm
/// of a positive parameter, a logistic function for one with a range.
class Coordinates {
 public:
  Coordinates(const FitModel& model, const FitPoint& from) : model_(model), from_(from) {
    for (const FitParameter p : from.free)
      units_.push_back(FitModel::is_logarithmic(p) ? 1.0 : model.scale(from.values, p));
  }

  Eigen::VectorXd inside(const FitValues& values) const {
    Eigen::VectorXd u(static_cast<Eigen::Index>(from_.free.size()));
    for (std::size_t i = 0; i < from_.free.size(); ++i) {
      const FitParameter p = from_.free[i];
      double& number = u[static_cast<Eigen::Index>(i)];
      if (ranged(p)) {
        const double low = scaled(p, model_.lowest(p)), high = scaled(p, model_.highest(p));
        const double share = std::clamp((scaled(p, values[p]) - low) / (high - low), 1e-3, 1.0 - 1e-3);
        number = std::log(share / (1.0 - share));
      } else {
        number = FitModel::is_logarithmic(p) ? std::log(values[p]) : values[p] / units_[i];
      }
    }
    return u;
  }

  FitValues outside(const Eigen::VectorXd& u) const {
    FitValues values = from_.values;
    for (std::size_t i = 0; i < from_.free.size(); ++i) {
      const FitParameter p = from_.free[i];
      const double number = u[static_cast<Eigen::Index>(i)];
      if (ranged(p)) {
        const double low = scaled(p, model_.lowest(p)), high = scaled(p, model_.highest(p));
        const double at = low + (high - low) / (1.0 + std::exp(-number));
        // Clamps a parameter to its range, which rounding may leave at an end.
        values[p] =
            std::clamp(FitModel::is_logarithmic(p) ? std::exp(at) : at, model_.lowest(p), model_.highest(p));
      } else {
        values[p] =
            FitModel::is_logarithmic(p) ? std::exp(std::clamp(number, -40.0, 40.0)) : number * units_[i];
      }
    }
    return values;
  }

  /// Returns the derivative of a parameter by its coordinate, in units of FitModel::scale.
  double slope(std::size_t i, const FitValues& values, double number) const {
    const FitParameter p = from_.free[i];
    if (ranged(p)) {
      const double share = 1.0 / (1.0 + std::exp(-number));
      const double width = scaled(p, model_.highest(p)) - scaled(p, model_.lowest(p));
      return width * share * (1.0 - share) / (FitModel::is_logarithmic(p) ? 1.0 : model_.scale(values, p));
    }
    return FitModel::is_logarithmic(p) ? 1.0 : units_[i] / model_.scale(values, p);
  }

 private:
  static bool ranged(FitParameter p) { return FitModel::bends(p) || p == fit_stribeck || p == fit_delay; }
  static double scaled(FitParameter p, double value) {
    return FitModel::is_logarithmic(p) ? std::log(value) : value;
  }
  const FitModel& model_;
  const FitPoint& from_;
  std::vector<double> units_;
};

}  // namespace

void assume(FitModel& model, const FitPoint& point) {
  model.set_past(point.past);
  if (bends_stage(point)) model.settle(point.values);
}

namespace {

/// Minimises once, while the stage stays bent by the force that the model has now.
FitPoint minimise_once(FitModel& model, const FitPoint& from) {
  const Coordinates coordinates(model, from);
  FitPoint best = from;
  if (!from.free.empty()) {
    const Eigen::Map<const Eigen::VectorXd> measured = measured_force(model.data());
    const double scale = model.data().force_scale;
    SumOfSquares sum;
    sum.residuals = measured.size();
    sum.fill = [&](const Eigen::VectorXd& u, Eigen::VectorXd& out) {
      out = (model.force(coordinates.outside(u)) - measured) / scale;
    };
    sum.differentiate = [&](const Eigen::VectorXd& u, Eigen::MatrixXd& out) {
      // Takes one-sided differences in a search, where they suffice, and central ones in the last fit, which
      // would otherwise end beside its minimum.
      const FitValues p = coordinates.outside(u);
      for (std::size_t i = 0; i < from.free.size(); ++i) {
        const auto column = static_cast<Eigen::Index>(i);
        out.col(column) = model.derivative(p, from.free[i], model.detail() == Detail::refine) *
                          coordinates.slope(i, p, u[column]) / scale;
      }
    };
    // Limits the first Levenberg-Marquardt step to a factor e for each parameter. Limits it more with rubbing
    // (residual and renewal), whose ranges are short and flat at the ends.
    const bool rubbed = std::any_of(from.free.begin(), from.free.end(), [](FitParameter p) {
      return FitModel::bends(p) && !FitModel::is_logarithmic(p);
    });
    const double factor = rubbed ? 0.1 : 1.0;
    const LevenbergLimits limits = model.detail() == Detail::refine ? LevenbergLimits{40, 1e-6, 1e-4, factor}
                                                                    : LevenbergLimits{25, 1e-5, 1e-3, factor};
    Eigen::VectorXd u = coordinates.inside(from.values);
    minimise(sum, limits, u);
    best.values = coordinates.outside(u);
  }
  return best;
}

/// Takes a lubricant or a damper that came out negative, as no material has it, out of a fit. Returns whether
/// there was one.
bool drop_negative(FitPoint& point) {
  bool dropped = false;
  for (const FitParameter p : {fit_viscous, fit_damping}) {
    if (point.values[p] >= 0.0) continue;
    point.values[p] = 0.0;
    std::erase_if(point.free,
                  [p](FitParameter q) { return q == p || (p == fit_damping && q == fit_stribeck); });
    dropped = true;
  }
  return dropped;
}

}  // namespace

FitPoint minimise(FitModel& model, FitPoint from) {
  constexpr int most_rounds = 5;  // number of fits; in each the stage bends by the force of the fit before
  constexpr double clearly_less = 0.995;  // ratio of sums of squares for which one more fit is made
  double before = std::numeric_limits<double>::infinity();
  for (int round = 0; round < (bends_stage(from) ? most_rounds : 1); ++round) {
    assume(model, from);
    from = minimise_once(model, from);
    assume(model, from);
    from.sum_of_squares = (model.force(from.values) - measured_force(model.data())).squaredNorm();
    if (from.sum_of_squares > clearly_less * before) break;
    before = from.sum_of_squares;
  }
  return drop_negative(from) ? minimise(model, from) : from;
}

Eigen::MatrixXd jacobian(FitModel& model, const FitPoint& point) {
  assume(model, point);
  Eigen::MatrixXd j(static_cast<Eigen::Index>(model.data().force.size()),
                    static_cast<Eigen::Index>(point.free.size()));
  for (std::size_t i = 0; i < point.free.size(); ++i)
    j.col(static_cast<Eigen::Index>(i)) = model.derivative(point.values, point.free[i]);
  return j;
}

Projection project(const Eigen::MatrixXd& columns, const Eigen::VectorXd& force) {
  const Eigen::VectorXd length = columns.colwise().norm().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled = columns * length.cwiseInverse().asDiagonal();
  const Eigen::VectorXd solution = solve_shortest(scaled.transpose() * scaled, scaled.transpose() * force);
  return {solution.cwiseQuotient(length), force - scaled * solution};
}

double correlated_samples(const Eigen::VectorXd& residuals) {
  const Eigen::VectorXd r = residuals.array() - residuals.mean();
  const double power = r.squaredNorm();
  if (!(power > 0.0)) return 1.0;
  // Adds up autocorrelations of the residuals up to a lag of five times their sum (Sokal); later terms are
  // noise.
  double sum = 1.0;
  const Eigen::Index n = r.size();
  for (Eigen::Index lag = 1; lag < n / 3; ++lag) {
    sum += 2.0 * r.head(n - lag).dot(r.tail(n - lag)) / power;
    if (static_cast<double>(lag) >= 5.0 * sum) break;
  }
  return std::clamp(sum, 1.0, static_cast<double>(n) / 3.0);
}

Eigen::MatrixXd inverse_normal_matrix(const Eigen::MatrixXd& j) {
  Eigen::VectorXd length = j.colwise().norm();
  for (double& l : length) l = std::max(l, 1e-300);
  const Eigen::MatrixXd scaled = j * length.cwiseInverse().asDiagonal();
  const EigenBasis basis = eigen_basis(scaled.transpose() * scaled);
  const Eigen::VectorXd inverse = basis.values.cwiseMax(1e-13).cwiseInverse();
  return length.cwiseInverse().asDiagonal() *
         (basis.vectors * inverse.asDiagonal() * basis.vectors.transpose()) *
         length.cwiseInverse().asDiagonal();
}

void raise_to(Eigen::MatrixXd& cov, const Eigen::MatrixXd& other) {
  for (Eigen::Index i = 0; i < cov.rows(); ++i) {
    if (cov(i, i) >= other(i, i)) continue;
    const double raise = std::sqrt(other(i, i) / std::max(cov(i, i), 1e-300));
    cov.row(i) *= raise;
    cov.col(i) *= raise;
  }
}

Eigen::MatrixXd covariance(const Eigen::MatrixXd& j, const Eigen::VectorXd& residuals, double correlated) {
  const Eigen::Index n = j.rows(), p = j.cols();
  const Eigen::MatrixXd normal = inverse_normal_matrix(j);
  const double freedom = std::max(static_cast<double>(n) / correlated - static_cast<double>(p), 1.0);
  const double variance = residuals.squaredNorm() / static_cast<double>(n);
  const double whole = static_cast<double>(n) / correlated;
  Eigen::MatrixXd result = normal * (variance * correlated * whole / freedom);

  const Eigen::MatrixXd gradient = residuals.asDiagonal() * j;
  Eigen::MatrixXd middle = gradient.transpose() * gradient;
  const auto window = static_cast<Eigen::Index>(std::min(4.0 * correlated, static_cast<double>(n) / 4.0));
  for (Eigen::Index lag = 1; lag <= window; ++lag) {
    const double weight = 1.0 - static_cast<double>(lag) / static_cast<double>(window + 1);
    const Eigen::MatrixXd product = gradient.bottomRows(n - lag).transpose() * gradient.topRows(n - lag);
    middle += weight * (product + product.transpose());
  }
  raise_to(result, normal * middle * normal * (whole / freedom));
  return result;
}

void raise_to_parts(Eigen::MatrixXd& cov, const Eigen::MatrixXd& j, const Eigen::VectorXd& residuals,
                    std::size_t samples) {
  constexpr std::size_t parts = 5;
  Eigen::MatrixXd gradients = Eigen::MatrixXd::Zero(j.cols(), static_cast<Eigen::Index>(parts));
  for (Eigen::Index row = 0; row < j.rows(); ++row) {
    const std::size_t part = static_cast<std::size_t>(row) % samples * parts / samples;
    gradients.col(static_cast<Eigen::Index>(part)) += j.row(row).transpose() * residuals[row];
  }
  const double freedom = static_cast<double>(parts) - 1.0;
  // Widens intervals by Student's law, because the five parts of a record determine the scatter between parts
  // poorly.
  const double wider = student_quantile(freedom) / student_quantile(1e9);
  const Eigen::MatrixXd normal = inverse_normal_matrix(j);
  Eigen::MatrixXd seen =
      normal * gradients * gradients.transpose() * normal * (static_cast<double>(parts) / freedom);
  for (Eigen::Index i = 0; i < cov.rows(); ++i)
    if (seen(i, i) <= cov(i, i)) seen(i, i) = 0.0;
  raise_to(cov, seen * (wider * wider));
}

double student_quantile(double nu) {
  if (nu < 3.0) {
    // Interpolates Student's quantile below 3 degrees of freedom. It is exact at 1, 2 and 3; in between, a
    // parabola of its logarithm over 1 / nu is within 1 %.
    const double one = std::log(12.70620), two = std::log(4.302653), three = std::log(3.182446);
    const double x = 1.0 / std::max(nu, 1.0);
    return std::exp(one * 3.0 * (x - 1.0 / 2.0) * (x - 1.0 / 3.0) - two * 12.0 * (x - 1.0) * (x - 1.0 / 3.0) +
                    three * 9.0 * (x - 1.0) * (x - 1.0 / 2.0));
  }
  // Expands Student's quantile about 1.96, that of the normal law (Abramowitz and Stegun 26.7.5). From 3
  // degrees of freedom on the expansion is within 1 %.
  constexpr double z = 1.959963984540054;
  constexpr double z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  return z + (z3 + z) / (4 * nu) + (5 * z5 + 16 * z3 + 3 * z) / (96 * nu * nu) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * nu * nu * nu);
}

}  // namespace cli
