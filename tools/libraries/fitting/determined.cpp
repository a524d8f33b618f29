// Finds the fitted parameters that the data do not determine, and explains why.
#include "tools/libraries/fitting/fitter.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/libraries/fitting/least_squares.hpp"

namespace cli {
namespace {

// Standard deviation of the logarithm of a parameter above which it counts as undetermined: its 95 % interval
// then spans a factor of seven.
constexpr double widest_deviation = 0.5;
// Standard deviation of the logarithm of a time or a speed above which it counts as undetermined: its 95 %
// interval then spans a factor of a hundred.
constexpr double widest_scale = 1.2;
// Standard deviation of the sensor's offset, over the rms force, above which it counts as undetermined.
constexpr double widest_offset = 0.25;
// Factor of widening above which two terms of a fit differ by less than the error of their laws.
constexpr double nearly_alike = 5.0;
constexpr double widest_asymmetry = 0.1;
// Range of the motion, in presliding lengths, below which the record may show no sliding.
constexpr double no_sliding = 4.0;
constexpr double longer = 3.0;            // factor on the presliding length to test whether longer bristles
                                          // fit
constexpr double clearly_worse = 8.0;     // loss in twice the log likelihood that refutes longer
                                          // bristles
constexpr double fewest_informing = 4.0;  // number of samples below which a parameter is undetermined

/// Returns the effective number of samples that determine a parameter: (sum of squares)^2 over the sum of
/// fourth powers of its weights, a column of J (J'J)^-1. Least squares would trust a single sample.
double informing_samples(const Eigen::MatrixXd& jacobian, Eigen::Index parameter) {
  const Eigen::VectorXd length = jacobian.colwise().norm().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled = jacobian * length.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd normal = scaled.transpose() * scaled;
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(normal.rows(), parameter);
  const Eigen::ArrayXd weight = (scaled * solve_shortest(normal, unit)).array();
  const double fourth = weight.square().square().sum();
  return fourth > 0.0 ? std::pow(weight.square().sum(), 2) / fourth : 0.0;
}

/// Returns whether the record slides far enough to determine the presliding length. If the motion is short,
/// bristles three times as long and equally stiff may fit as well, which no derivative shows; so the function
/// fits such bristles.
bool shows_sliding(FitModel& model, const FitPoint& point, double count) {
  if (!contains(point.free, fit_kinetic) || !contains(point.free, fit_length)) return true;
  if (model.data().range > no_sliding * point.values[fit_length]) return true;
  FitPoint other = point;
  other.values[fit_length] = std::min(longer * point.values[fit_length], model.highest(fit_length));
  other.values[fit_kinetic] *= other.values[fit_length] / point.values[fit_length];
  take_out(other.free, fit_kinetic);
  other = minimise(model, other);
  return count * std::log(other.sum_of_squares / std::max(point.sum_of_squares, 1e-300)) > clearly_worse;
}

/// Returns whether a parameter is the time of ageing or the speed of strengthening. If that scale is below
/// all ages or speeds of the record, growth is logarithmic throughout and the scale keeps its default.
bool is_scale(FitParameter p) { return p == fit_ageing_time || p == fit_strengthening_speed; }

/// Returns the parameter without which the undetermined parameter `open` has no meaning.
FitParameter owner_of(FitParameter open) {
  return open == fit_ageing_time           ? fit_ageing
         : open == fit_strengthening_speed ? fit_strengthening
                                           : fit_length;
}

}  // namespace

std::string Fitter::lacking(FitParameter p) const {
  switch (p) {
    case fit_kinetic:
      return "no sliding: only kinetic / presliding_length is determined";
    case fit_length:
      return "no presliding: too few samples before break-away and after reversals";
    case fit_spread:
      return "neither break-away nor a reversal is resolved";
    case fit_residual:
    case fit_renewal:
      return "not seen";
    case fit_offset:
    case fit_drift:
    case fit_offset_y:
    case fit_drift_y:
    case fit_asymmetry:
      return "cannot be separated from friction";
    case fit_compliance:
      return several_loads() ? "not seen beside the bristles' own"
                             : "under one load the stage's and the bristles' are one number in sticking; "
                               "loads that differ tell them apart";
    case fit_softening:
      return "not seen: the stage bends alike either way";
    case fit_delay:
      return "not seen: shorter than the motion between samples shows";
    case fit_ageing_time:
      return "any shorter time does as well";
    case fit_strengthening_speed:
      return "any slower speed does as well";
    default:
      return "cannot be separated from other terms";
  }
}

/// Fixes one parameter that the fit drove to an end of its range at that end, or at 0 for compliance and
/// delay. Returns whether there was such a parameter.
bool Fitter::at_an_edge(FitPoint& point) {
  for (const FitParameter p : {fit_length, fit_spread, fit_residual, fit_renewal, fit_ageing_time,
                               fit_strengthening_speed, fit_compliance, fit_delay}) {
    if (!contains(point.free, p)) continue;
    const double low = model_.lowest(p), high = model_.highest(p);
    const double place = FitModel::is_logarithmic(p) ? std::log(point.values[p] / low) / std::log(high / low)
                                                     : (point.values[p] - low) / (high - low);
    if (place > 0.01 && place < 0.99) continue;
    take_out(point.free, p);
    point.values[p] = place < 0.5 ? low : high;
    if (p == fit_compliance || p == fit_delay) {
      point.values[p] = 0.0;
      why_[p] = lacking(p);
      return true;
    }
    if (is_scale(p)) {
      why_[p] = place < 0.5            ? lacking(p)
                : p == fit_ageing_time ? "longer than the record: ageing in proportion to time"
                                       : "faster than the record: strengthening in proportion to speed";
      return true;
    }
    why_[p] = p == fit_residual || p == fit_renewal
                  ? (place < 0.5 ? std::string("not seen") : fmt::format("{:g} or more", high))
              : p == fit_spread
                  ? fmt::format("at the {} end of what this law takes", place < 0.5 ? "lower" : "upper")
              : place < 0.5 ? std::string("presliding is shorter than the data resolve")
                            : std::string("presliding is longer than the motion");
    return true;
  }
  return false;
}

bool Fitter::is_determined(const FitPoint& point, const Eigen::MatrixXd& j, const Eigen::MatrixXd& cov,
                           Eigen::Index i) const {
  const FitParameter p = point.free[static_cast<std::size_t>(i)];
  const double deviation = std::sqrt(cov(i, i));
  if (informing_samples(j, i) < fewest_informing) return false;
  if (is_scale(p)) return deviation <= widest_scale;
  if (FitModel::is_logarithmic(p)) return deviation <= widest_deviation;
  if (p == fit_asymmetry) return deviation <= widest_asymmetry;
  if (p >= fit_offset) return deviation <= widest_offset;
  if (p == fit_softening)
    return std::fabs(point.values[p]) >= 2.0 * deviation * model_.scale(point.values, p);
  // Keeps a lubricant or a damper only if it exceeds two standard deviations.
  return point.values[p] >= 2.0 * deviation * model_.scale(point.values, p);
}

/// Removes a parameter from the fit for the reason `why`, with those that mean nothing without it.
void Fitter::leave(FitPoint& point, FitParameter p, const std::string& why) {
  const auto drop = [&](FitParameter q) {
    take_out(point.free, q);
    point.values[q] = fit_defaults[q];
    why_[q] = why;
  };
  if (is_scale(p)) {
    take_out(point.free, p);
    why_[p] = why;
    return;
  }
  const double before = point.values[p];
  drop(p);
  if (p == fit_kinetic) {  // resets the kinetic coefficient, but not the stiffness
    double& length = point.values[fit_length];
    length =
        std::clamp(length * point.values[p] / before, model_.lowest(fit_length), model_.highest(fit_length));
  }
  if (p == fit_damping) drop(fit_stribeck);
  if (p == fit_stribeck) drop(fit_damping);
  if (p == fit_ageing) drop(fit_ageing_time);
  if (p == fit_strengthening) drop(fit_strengthening_speed);
}

/// Returns the factor by which the standard deviation of ageing (or strengthening) grows if the other of the
/// two, which is not fitted, may exist: the change of friction with speed determines only their difference.
double Fitter::widened_by_rival(const FitPoint& point, const Eigen::MatrixXd& j, FitParameter p) {
  const FitParameter rival = p == fit_ageing ? fit_strengthening : fit_ageing;
  if (contains(point.free, rival) || !several_speeds() || point.frame.speed == 0.0) return 1.0;
  if (rival == fit_ageing && options_.rule != bristle::SnapRule::redraw) return 1.0;
  // Separates ageing from strengthening by the path over which ageing follows a change of speed, whereas
  // strengthening follows at once.
  if (!contains(point.free, fit_length)) return 1e6;
  FitValues values = point.values;
  values[fit_strengthening_speed] =
      rival == fit_strengthening ? 0.1 * data_.slow : values[fit_strengthening_speed];
  if (rival == fit_ageing) values[fit_ageing_time] = model_.lowest(fit_ageing_time);
  Eigen::MatrixXd wide(j.rows(), j.cols() + 1);
  wide << j, model_.derivative(values, rival);
  const auto i = std::find(point.free.begin(), point.free.end(), p) - point.free.begin();
  // Returns the norm of the part of the Jacobian's column i that its other columns cannot explain.
  const auto left = [&](const Eigen::MatrixXd& m) {
    Eigen::MatrixXd others = m;
    others.col(i).setZero();
    const Eigen::VectorXd column = m.col(i);
    return (column - others * solve_shortest(others, column)).norm();
  };
  const double alone = left(j), beside = left(wide);
  return beside > 1e-6 * alone ? alone / beside : 1e6;
}

/// Removes from the fit the most expendable one of the undetermined parameters. Returns false if all are
/// determined.
bool Fitter::drop_one(FitPoint& point, bool with_bristles) {
  assume(model_, point);
  if (at_an_edge(point)) return true;
  const Eigen::MatrixXd j = jacobian(model_, point);
  const Eigen::VectorXd r = residuals(point);
  const double nothing = 1e-6 * data_.force_scale * std::sqrt(static_cast<double>(samples()));
  const bool without_effect = j.colwise().norm().minCoeff() < nothing;
  const double correlated = correlated_samples(r);
  const Eigen::MatrixXd cov = without_effect  ? Eigen::MatrixXd()
                              : with_bristles ? covariance(j, r, correlated, bristle_error(point, j, r))
                                              : covariance(j, r, correlated);
  for (const FitParameter p :
       {fit_drift,   fit_drift_y,   fit_offset,        fit_offset_y,    fit_asymmetry,
        fit_delay,   fit_softening, fit_compliance,    fit_ageing_time, fit_strengthening_speed,
        fit_damping, fit_stribeck,  fit_strengthening, fit_ageing,      fit_viscous,
        fit_renewal, fit_residual,  fit_spread,        fit_kinetic,     fit_length}) {
    const auto at = std::find(point.free.begin(), point.free.end(), p);
    if (at == point.free.end()) continue;
    const auto i = static_cast<Eigen::Index>(at - point.free.begin());
    if (without_effect) {
      if (j.col(i).norm() >= nothing) continue;
    } else if (is_determined(point, j, cov, i)) {
      if (p != fit_ageing && p != fit_strengthening) continue;
      const double wider = widened_by_rival(point, j, p);
      const double deviation = std::sqrt(cov(i, i)) * wider;
      if (wider < nearly_alike && point.values[p] >= 2.0 * deviation * model_.scale(point.values, p))
        continue;
      leave(point, p,
            "the record does not tell ageing from strengthening: only their difference is determined");
      why_[p == fit_ageing ? fit_strengthening : fit_ageing] = why_[p];
      return true;
    }
    // Keeps rubbing (residual and shared renewal) that lowers the residuals enough, even if its own values
    // are poorly known: without it the presliding length would be wrong by more than its interval.
    const bool rubbing = p == fit_renewal || p == fit_residual;
    if (rubbing && !without_effect && point.values[p] >= std::sqrt(cov(i, i)) * model_.scale(point.values, p))
      continue;
    leave(point, p, lacking(p));
    return true;
  }
  return false;
}

/// Fits with a range of fixed values of an undetermined parameter, refined about the best one until several
/// fit about equally well. Returns these fits, ordered by the parameter.
std::vector<FitPoint> Fitter::as_good(const FitPoint& point, FitParameter open) {
  constexpr int tried = 6, passes = 3;
  constexpr std::size_t several_fits = 3;
  constexpr double as_good = 3.84;  // loss in twice the log likelihood at the ends of a 95 % interval
  double low = model_.lowest(open), high = model_.highest(open);
  std::vector<FitPoint> all{point}, row;
  for (int pass = 0; pass < passes && row.size() < several_fits; ++pass) {
    const double ratio = std::pow(high / low, 1.0 / tried);
    for (int i = 0; i < tried; ++i) {
      FitPoint other = point;
      other.values[open] = low * std::pow(ratio, i + 0.25);
      other = minimise(model_, other);
      if (other.values[owner_of(open)] > 0.0) all.push_back(other);
    }
    const FitPoint best = *std::min_element(all.begin(), all.end(), better);
    const double noise =
        best.sum_of_squares / static_cast<double>(samples()) * correlated_samples(residuals(best));
    row.clear();
    std::copy_if(all.begin(), all.end(), std::back_inserter(row), [&](const FitPoint& q) {
      return q.sum_of_squares <= best.sum_of_squares + as_good * noise;
    });
    low = std::max(best.values[open] / ratio, low);
    high = std::min(best.values[open] * ratio, high);
  }
  std::sort(row.begin(), row.end(),
            [&](const FitPoint& a, const FitPoint& b) { return a.values[open] < b.values[open]; });
  return row;
}

/// Replaces an undetermined spread, ageing time or strengthening speed by the middle of the values that fit
/// as well as the best. The scatter over these values then widens the interval of every parameter.
FitPoint Fitter::take_middle(FitPoint point, FitParameter open) {
  if (!contains(point.free, owner_of(open)) || contains(point.free, open)) return point;
  // Keeps the spread if only the stiffness is known, or if the fit drove the spread to an end of its range.
  if (open == fit_spread && (!contains(point.free, fit_kinetic) || why_[open] != lacking(open))) return point;
  assume(model_, point);
  std::vector<FitPoint> row = as_good(point, open);
  if (row.size() > 1)
    why_[open] =
        fmt::format("{:.2g} to {:.2g}{} do as well", row.front().values[open], row.back().values[open],
                    open == fit_spread        ? ""
                    : open == fit_ageing_time ? " s"
                                              : " m/s");
  const FitPoint middle = row[row.size() / 2];
  rows_.push_back({middle, std::move(row)});
  return middle;
}

FitPoint Fitter::keep_determined(FitPoint point) {
  for (const FitParameter p : {fit_offset, fit_drift, fit_offset_y, fit_drift_y}) {
    if (!two_ways()) why_[p] = "the motion has one direction only";
  }
  if (two_ways() && options_.no_drift) why_[fit_drift] = why_[fit_drift_y] = "held";
  if (!has_spread(options_.law)) why_[fit_spread] = "this law has none to choose";
  if (options_.for_prediction) return point;
  if (!point.free.empty() && !shows_sliding(model_, point, samples_that_count(point))) {
    leave(point, fit_kinetic, lacking(fit_kinetic));
    point = minimise(model_, point);
  }
  while (!point.free.empty() && drop_one(point)) point = minimise(model_, point);
  if (!point.free.empty()) point = keep_predicting(point);
  // Removes parameters that are undetermined if the error of a finite number of bristles is included.
  while (!point.free.empty() && drop_one(point, true)) point = minimise(model_, point);
  for (const FitParameter open : {fit_spread, fit_ageing_time, fit_strengthening_speed})
    point = take_middle(point, open);
  return point;
}

}  // namespace cli
