// What a finite number of bristles does to a fit.
#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/QR>

#include "tools/fitting/solve.hpp"
#include "tools/scene/snap_law.hpp"

namespace cli {

using bristle::SnapLaw;
using bristle::SnapRule;

double fluctuating_bristles(const FitModel& model, const FitPoint& point, const Eigen::VectorXd& r) {
  const FitData& data = model.data();
  const FitOptions& options = model.options();
  const double length = point.values[fit_length], residual = point.values[fit_residual] * length;
  const bristle::SnapLength law = make_snap_length(options.law, length - residual, point.values[fit_spread]);
  const double m1 = law.moment(1), bend = kinetic_bend(options.rule, law.cv()) * m1;
  const double third = options.rule == SnapRule::keep ? law.moment(2) / 3.0 : law.moment(3) / (3.0 * m1);
  // Variance of one bristle over its mean squared. (Renewal narrows it a little: still a lower bound.)
  const double relative = (third - bend * bend) / std::pow(residual + bend, 2);

  double slid = 0.0, direction = 0.0, sliding = 0.0, sticking = 0.0, alike = 0.0, counts[3] = {};
  bool slid_before = false, stuck_before = false;
  Eigen::Index sample = -1;
  for (std::size_t k = 1; k < data.path.size(); ++k) {
    const double move = data.path[k].x - data.path[k - 1].x;
    if (move * direction < 0.0) slid = 0.0;
    if (move != 0.0) direction = move;
    slid += std::fabs(move);
    if (!data.path[k].wanted) continue;
    sample = sample < 0 ? 1 : sample + 1;
    const bool slides = slid > 4.0 * length;
    if (slides) {
      sliding += r[sample] * r[sample];
      counts[0] += 1.0;
      if (slid_before) {
        alike += r[sample] * r[sample - 1];
        counts[2] += 1.0;
      }
    }
    const bool sticks = slid < 0.3 * length;
    if (sticks && stuck_before) {
      sticking += 0.5 * std::pow(r[sample] - r[sample - 1], 2);
      counts[1] += 1.0;
    }
    slid_before = slides;
    stuck_before = sticks;
  }
  constexpr double fewest = 30.0;  // samples for a variance
  double excess = 0.0;
  if (counts[0] >= fewest && counts[1] >= fewest) excess = sliding / counts[0] - sticking / counts[1];
  if (counts[2] >= fewest) excess = std::max(excess, alike / counts[2]);
  const double force = point.values[fit_kinetic] * data.mean_load;
  return excess > 0.0 ? relative * force * force / excess : std::numeric_limits<double>::infinity();
}

Eigen::MatrixXd population_error(FitModel& model, const FitPoint& point, const Eigen::MatrixXd& j,
                                 double bristles) {
  const FitData& data = model.data();
  const FitOptions& options = model.options();
  const auto samples = static_cast<Eigen::Index>(data.force.size());
  const double share = point.values[fit_residual];
  const bristle::SnapLength law =
      make_snap_length(options.law, (1.0 - share) * point.values[fit_length], point.values[fit_spread]);
  const double m1 = law.moment(1), m2 = law.moment(2), m3 = law.moment(3), m4 = law.moment(4);
  const double variance = m2 - m1 * m1, third = m3 - 3.0 * m2 * m1 + 2.0 * m1 * m1 * m1;
  const double fourth = m4 - 4.0 * m3 * m1 + 6.0 * m2 * m1 * m1 - 3.0 * m1 * m1 * m1 * m1;
  // Covariance of the logarithms of mean and deviation of a sample.
  Eigen::Matrix2d sample;
  sample << variance / (m1 * m1), third / (2.0 * m1 * variance), third / (2.0 * m1 * variance),
      0.25 * (fourth / (variance * variance) - 1.0);
  sample /= bristles;
  // Spread is deviation over mean.
  Eigen::Matrix2d to_parameters;
  to_parameters << 1.0, 0.0, -1.0, 1.0;
  sample = to_parameters * sample * to_parameters.transpose();

  model.set_start(point.start);
  const Eigen::VectorXd kinetic = model.derivative(point.values, fit_kinetic);
  // The kinetic coefficient goes with the deflection of sliding, the residual stays.
  const auto kinetic_slope = [&](double lengthened, double widened) {
    FitValues moved = point.values;
    const double mean = (1.0 - share) * moved[fit_length] * std::exp(lengthened);
    moved[fit_length] = share * moved[fit_length] + mean;
    moved[fit_residual] = 1.0 - mean / moved[fit_length];
    moved[fit_spread] *= std::exp(widened);
    return std::log(model.kinetic_deflection(moved) / model.kinetic_deflection(point.values));
  };
  constexpr double step = 1e-3;
  Eigen::MatrixXd effect(samples, 2);
  effect.col(0) = (1.0 - share) * model.derivative(point.values, fit_length) +
                  kinetic_slope(-step, 0.0) / -step * kinetic;
  if (share > 0.0) effect.col(0) -= share * (1.0 - share) * model.derivative(point.values, fit_residual);
  effect.col(1) = Eigen::VectorXd::Zero(samples);
  if (options.law != SnapLaw::exponential) {
    effect.col(1) += model.derivative(point.values, fit_spread) + kinetic_slope(0.0, -step) / -step * kinetic;
  }

  const Eigen::MatrixXd pseudo = j.completeOrthogonalDecomposition().pseudoInverse();
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(pseudo.rows(), pseudo.rows());
  const double renewed = 3.0 * point.values[fit_length];
  double slid = 0.0, direction = 0.0;
  Eigen::Index begin = 0, sample_number = 0;
  const auto close = [&](Eigen::Index end) {
    const Eigen::MatrixXd moved =
        pseudo.middleCols(begin, end - begin) * effect.middleRows(begin, end - begin);
    sum += moved * sample * moved.transpose();
    begin = end;
  };
  for (std::size_t k = 1; k < data.path.size(); ++k) {
    const double move = data.path[k].x - data.path[k - 1].x;
    if (move * direction < 0.0) slid = 0.0;
    if (move != 0.0) direction = move;
    slid += std::fabs(move);
    sample_number += data.path[k].wanted ? 1 : 0;
    if (options.rule == SnapRule::redraw && slid > renewed && sample_number > begin) {
      close(sample_number);
      slid = 0.0;
    }
  }
  close(samples);
  return sum;
}

}  // namespace cli
