// Nonlinear least squares, what the data determine, and intervals.
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
  double sum_of_squares = 0.0;  ///< N^2
};

/// The past and the frame of a point: what its values mean.
void assume(FitModel& model, const FitPoint& point);

/// Levenberg-Marquardt from `from` over its free parameters.
FitPoint minimise(FitModel& model, FitPoint from);

/// Derivatives by the free parameters, in units of FitModel::scale.
Eigen::MatrixXd jacobian(FitModel& model, const FitPoint& point);

/// Remainder of a force after projection on columns, and their coefficients.
struct Projection {
  Eigen::VectorXd coefficients, left;
};
Projection project(const Eigen::MatrixXd& columns, const Eigen::VectorXd& force);

/// Samples that count as one: the integrated autocorrelation time of the residuals.
double correlated_samples(const Eigen::VectorXd& residuals);

/// Covariance of the free parameters, in units of FitModel::scale: (J'J)^-1 M (J'J)^-1, M the covariance of
/// the gradient with the correlation of neighbouring residuals in it (Newey and West), or, where that is
/// larger, the independent one times `correlated`. Singular directions come out as very large variances.
Eigen::MatrixXd covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                           double correlated);

/// Errors of a fit from a finite number of bristles. They have a mean length and a spread of their own, and
/// where they snap is a matter of chance: an error that the residuals show in part only, as the same bristles
/// bend in every small loop. Found by simulation: brushes of the fitted material, drawn at random, each
/// fitted in turn (to first order).
struct PopulationError {
  Eigen::MatrixXd covariance;  ///< of the free parameters, in units of FitModel::scale
  bool seen = false;           ///< whether their fluctuation is seen in the residuals
  double bristles = 0.0;  ///< where seen: how many at the mean load; misfit counts too, so at least as many
  double noise = 0.0;     ///< N^2, variance that they leave to the sensor
};
/// `usual_bristles` at the mean load are assumed as far as the residuals do not show how many there are.
PopulationError population_error(const FitModel& model, const FitPoint& point,
                                 const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                                 double usual_bristles);

/// The whole of it: noise of the sensor and bristles, or the residuals' own (above) where that is larger.
Eigen::MatrixXd covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                           double correlated, const PopulationError& population);
/// Raises variances to those that five parts of the record, one after the other, show by their differences,
/// where noise would hardly make these so large. Friction that wanders is alike over minutes, which no
/// correlation of neighbours shows.
void raise_to_parts(Eigen::MatrixXd& covariance, const Eigen::MatrixXd& jacobian,
                    const Eigen::VectorXd& residuals, std::size_t samples);

/// Blocks of time that a record is cut into: every fifth of them is held out in its turn.
inline constexpr std::size_t mixed_blocks = 25;
/// Sum of squares of the errors of the parts of a record that were not fitted to, each in its turn (N^2).
double held_out_squares(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                        std::size_t samples);

/// Lengths of any law, and the point that they go with.
struct FreeLaw {
  std::vector<double> quantiles;  ///< over their mean, as SnapLength::table takes them
  FitPoint point;
};
/// Finds the law of the lengths of bristles that slide, as a histogram of weights that are not negative.
/// Throws UserError where there is none.
FreeLaw find_free_law(FitModel& model, const FitOptions& options, const FitPoint& about);

/// 97.5 % point of Student's law, within 1 %; below one degree of freedom that of one.
double student_quantile(double degrees_of_freedom);

}  // namespace cli
