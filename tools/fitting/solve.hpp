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
  StartState start = StartState::straight;
  double sum_of_squares = 0.0;  ///< N^2
};

/// Levenberg-Marquardt from `from` over its free parameters.
FitPoint minimise(FitModel& model, FitPoint from);

/// Derivatives by the free parameters, in units of FitModel::scale.
Eigen::MatrixXd jacobian(FitModel& model, const FitPoint& point);

/// Samples that count as one: the integrated autocorrelation time of the residuals.
double correlated_samples(const Eigen::VectorXd& residuals);

/// Covariance of the free parameters, in units of FitModel::scale: (J'J)^-1 M (J'J)^-1, M the covariance of
/// the gradient with the correlation of neighbouring residuals in it (Newey and West), or, where that is
/// larger, the independent one times `correlated`. Singular directions come out as very large variances.
Eigen::MatrixXd covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                           double correlated);

/// How many bristles at the mean load fluctuate in sliding as much as the residuals do that go beyond the
/// noise of the sensor: beyond that of sticking, and where neighbours are alike. Misfit counts too, so it is
/// a lower bound.
double fluctuating_bristles(const FitModel& model, const FitPoint& point, const Eigen::VectorXd& residuals);

/// The bristles that happen to be there have a mean length and a spread of their own, while their stiffness
/// stays: an error that residuals do not show, as the same bristles bend in every small loop. They are
/// replaced in sliding (redraw). Each lot of them moves the estimates by (J'J)^-1 J' times what it does to
/// the force.
Eigen::MatrixXd population_error(FitModel& model, const FitPoint& point, const Eigen::MatrixXd& jacobian,
                                 double bristles);

/// 97.5 % point of Student's law, within 1 %; below one degree of freedom that of one.
double student_quantile(double degrees_of_freedom);

}  // namespace cli
