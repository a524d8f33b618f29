// Solves the nonlinear least squares of a fit, and computes the parameters' intervals.
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

/// Returns whether the stage bends at a point of the fit, or would bend if the fit chose so.
inline bool bends_stage(const FitPoint& point) {
  return point.values[fit_softening] != 0.0 ||
         std::count(point.free.begin(), point.free.end(), fit_softening) > 0;
}
/// Sets the model's state before the record, and the force that bends its stage, to those of a point.
void assume(FitModel& model, const FitPoint& point);

/// Minimises the sum of squares over the free parameters of `from` by Levenberg-Marquardt, beginning at
/// `from`.
FitPoint minimise(FitModel& model, FitPoint from);

/// Returns the derivatives of the force by the free parameters of a point, in units of FitModel::scale.
Eigen::MatrixXd jacobian(FitModel& model, const FitPoint& point);

/// Least-squares fit of a force by columns: their coefficients, and the part of the force that is left.
struct Projection {
  Eigen::VectorXd coefficients, left;
};
Projection project(const Eigen::MatrixXd& columns, const Eigen::VectorXd& force);

/// Returns how many correlated residuals carry as much information as one independent residual (integrated
/// autocorrelation time).
double correlated_samples(const Eigen::VectorXd& residuals);

/// Returns (J'J)^-1 of a Jacobian J by eigenvectors, after scaling its columns to length 1.
Eigen::MatrixXd inverse_normal_matrix(const Eigen::MatrixXd& jacobian);

/// Returns the covariance of the free parameters, in units of FitModel::scale: that of independent residuals
/// times `correlated`. Its variances are raised to those of (J'J)^-1 M (J'J)^-1 where these are larger, M
/// being the covariance of the gradient when neighbouring residuals are correlated (Newey and West).
/// Undetermined directions get very large variances.
Eigen::MatrixXd covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                           double correlated);

/// Returns the covariance of the free parameters over contacts of one bristle each, in units of
/// FitModel::scale, by simulating single bristles along the path. A contact of n bristles has the n-th part.
/// `most_load` is the highest load of the record, N.
Eigen::MatrixXd covariance_of_one_bristle(const FitModel& model, const FitPoint& point,
                                          const Eigen::MatrixXd& jacobian, double most_load);

/// Raises each variance to that of `other` if the latter is larger; correlations stay.
void raise_to(Eigen::MatrixXd& covariance, const Eigen::MatrixXd& other);

/// Raises variances to those that the differences between five successive parts of the record imply, widened
/// by Student's law, where the differences imply more. Friction that wanders is correlated for longer than
/// neighbouring samples show.
void raise_to_parts(Eigen::MatrixXd& covariance, const Eigen::MatrixXd& jacobian,
                    const Eigen::VectorXd& residuals, std::size_t samples);

/// Number of blocks into which a record is cut to test predictions. Every fifth one is held out in turn.
inline constexpr std::size_t mixed_blocks = 25;
/// Returns the sum of squared errors (N^2) of the held-out parts of a record, each predicted from the rest.
double held_out_squares(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                        std::size_t samples);

/// Free law of snap lengths (a histogram), and the fitted point that goes with it.
struct FreeLaw {
  /// Quantiles of the snap lengths over their mean, in the form that SnapLength::table takes.
  std::vector<double> quantiles;
  FitPoint point;
};
/// Finds a free law of snap lengths for the rule slide, as a histogram with nonnegative weights. Throws
/// UserError if no law fits.
FreeLaw find_free_law(FitModel& model, const FitOptions& options, const FitPoint& about);

/// Returns the 97.5 % quantile of Student's law, within 1 %; for less than one degree of freedom, that of
/// one.
double student_quantile(double degrees_of_freedom);

}  // namespace cli
