// Solves nonlinear least squares, and finds which parameters the data determine, with intervals.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "tools/fitting/model.hpp"

namespace cli {

using FitParameterSet = std::vector<FitParameter>;

struct FitPoint {
  FitValues values = fit_defaults;
  FitParameterSet free;
  Past past;
  FitFrame frame;
  double sum_of_squares = 0.0;  ///< N^2, sum of the squared differences between measured and computed force
};

/// Sets the model's past and frame to those of a point; they give the point's values their meaning.
void assume(FitModel& model, const FitPoint& point);

/// Minimises by Levenberg-Marquardt over the free parameters of `from`, where it starts.
FitPoint minimise(FitModel& model, FitPoint from);

/// Returns derivatives by the free parameters, in units of FitModel::scale.
Eigen::MatrixXd jacobian(FitModel& model, const FitPoint& point);

/// Projection of a force on columns: the columns' coefficients, and the remainder of the force.
struct Projection {
  Eigen::VectorXd coefficients, left;
};
Projection project(const Eigen::MatrixXd& columns, const Eigen::VectorXd& force);

/// Returns the number of correlated residuals that count as one independent: their integrated autocorrelation
/// time.
double correlated_samples(const Eigen::VectorXd& residuals);

/// Returns the covariance of the free parameters, in units of FitModel::scale: (J'J)^-1 M (J'J)^-1, where M
/// is the covariance of the gradient with correlated neighbouring residuals (Newey and West); or, if larger,
/// the covariance for independent residuals times `correlated`. Singular directions get very large variances.
Eigen::MatrixXd covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                           double correlated);

/// Errors of a fit that come from a finite number of bristles, which have a mean length and spread of their
/// own and snap at random places. Residuals show this error only in part, as the same bristles bend in every
/// small loop. The error comes from simulation: random brushes of the fitted material, each fitted in turn
/// (to first order).
struct PopulationError {
  Eigen::MatrixXd covariance;  ///< covariance of the free parameters, in units of FitModel::scale
  bool seen = false;           ///< whether the residuals show the fluctuation of a finite number of bristles

  /// Number of bristles at the mean load, if seen; a lower estimate, as it takes misfit for fluctuation.
  double bristles = 0.0;
  double noise = 0.0;  ///< N^2, variance of the residuals that is attributed to noise of the sensor
};
/// Estimates the errors from a finite number of bristles. Assumes `usual_bristles` at the mean load as far as
/// the residuals do not show their number.
PopulationError population_error(const FitModel& model, const FitPoint& point,
                                 const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                                 double usual_bristles);

/// Returns the covariance from sensor noise and bristles, or that of the residuals alone (above) if it is
/// larger.
Eigen::MatrixXd covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                           double correlated, const PopulationError& population);
/// Raises variances to those by which five successive parts of the record differ, if noise would hardly
/// explain them. Friction that wanders is correlated over minutes, which correlations of neighbouring samples
/// do not show.
void raise_to_parts(Eigen::MatrixXd& covariance, const Eigen::MatrixXd& jacobian,
                    const Eigen::VectorXd& residuals, std::size_t samples);

/// Number of blocks that a record is cut into; every fifth of them is held out in turn.
inline constexpr std::size_t mixed_blocks = 25;
/// Returns the sum of squared errors (N^2) of the held-out parts of a record, each predicted from the rest.
double held_out_squares(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                        std::size_t samples);

/// Free law of snap lengths, and the fitted point that it belongs to.
struct FreeLaw {
  /// Quantiles of the snap lengths over their mean, as SnapLength::table takes them.
  std::vector<double> quantiles;
  FitPoint point;
};
/// Finds a free law of snap lengths for the slide rule, as a histogram of nonnegative weights. Throws
/// UserError if there is none.
FreeLaw find_free_law(FitModel& model, const FitOptions& options, const FitPoint& about);

/// Returns the 97.5 % point of Student's law, within 1 %; below one degree of freedom, that of one.
double student_quantile(double degrees_of_freedom);

}  // namespace cli
