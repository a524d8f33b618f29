// Solves the nonlinear least squares of a fit, and finds parameters' intervals.
#pragma once

#include <algorithm>
#include <vector>

#include <Eigen/Core>

#include "tools/libraries/fitting/model.hpp"

namespace cli {

using FitParameterSet = std::vector<FitParameter>;

struct FitPoint {
  FitValues values = fit_defaults;
  FitParameterSet free;
  Past past;
  double sum_of_squares = 0.0;  ///< sum of squares of measured minus computed force, N^2
};

/// Returns whether a stage bends at this point, or is free to bend.
inline bool bends_stage(const FitPoint& point) {
  return point.values[fit_softening] != 0.0 ||
         std::count(point.free.begin(), point.free.end(), fit_softening) > 0;
}
/// Sets the model's past, and the force that bends its stage, to those of a point.
void assume(FitModel& model, const FitPoint& point);

/// Minimises the sum of squares by Levenberg-Marquardt over the free parameters of `from`, starting there.
FitPoint minimise(FitModel& model, FitPoint from);

/// Returns derivatives of the force by a point's free parameters, in units of FitModel::scale.
Eigen::MatrixXd jacobian(FitModel& model, const FitPoint& point);

/// Least-squares fit of a force by columns: the columns' coefficients, and the remainder of the force.
struct Projection {
  Eigen::VectorXd coefficients, left;
};
Projection project(const Eigen::MatrixXd& columns, const Eigen::VectorXd& force);

/// Returns how many correlated residuals carry as much information as one independent: their integrated
/// autocorrelation time.
double correlated_samples(const Eigen::VectorXd& residuals);

/// Returns the covariance of the free parameters, in units of FitModel::scale: that for independent residuals
/// times `correlated`, its variances raised to those of (J'J)^-1 M (J'J)^-1 where these are larger. M is the
/// gradient's covariance with correlated neighbouring residuals (Newey and West). Singular directions get
/// very large variances.
Eigen::MatrixXd covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                           double correlated);

/// Raises variances to those that the differences between five successive parts of the record imply, if noise
/// would hardly explain the differences. Friction that wanders over minutes is correlated for longer than
/// neighbouring samples show.
void raise_to_parts(Eigen::MatrixXd& covariance, const Eigen::MatrixXd& jacobian,
                    const Eigen::VectorXd& residuals, std::size_t samples);

/// Number of blocks into which a record is cut to test predictions; every fifth is held out in turn.
inline constexpr std::size_t mixed_blocks = 25;
/// Returns the sum of squared errors (N^2) of the held-out parts of a record, each predicted from the rest.
double held_out_squares(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                        std::size_t samples);

/// Free law of snap lengths (a histogram), and the fitted point that it belongs to.
struct FreeLaw {
  /// Quantiles of the snap lengths over their mean, as SnapLength::table takes them.
  std::vector<double> quantiles;
  FitPoint point;
};
/// Finds a free law of snap lengths for the slide rule, as a histogram with nonnegative weights. Throws
/// UserError if no such law fits.
FreeLaw find_free_law(FitModel& model, const FitOptions& options, const FitPoint& about);

/// Returns the 97.5 % quantile of Student's law, within 1 %; below one degree of freedom, that of one.
double student_quantile(double degrees_of_freedom);

}  // namespace cli
