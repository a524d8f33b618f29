// Finds the fitted parameters that the data do not determine, holds each at the value that fits best, and
// explains why to the user.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/libraries/fitting/fitter.hpp"
#include "tools/libraries/fitting/least_squares.hpp"

namespace cli {
namespace {

// Standard deviation of the logarithm of a parameter, above which the parameter counts as undetermined: its
// 95 % interval then spans a factor of seven.
constexpr double widest_deviation = 0.5;
// Standard deviation of the sensor's offset, over the rms force, above which the offset counts as
// undetermined.
constexpr double widest_offset = 0.25;
// Range of the motion, in presliding lengths, below which the record may show no sliding at all.
constexpr double no_sliding = 4.0;
constexpr double longer = 3.0;         // factor on the presliding length to test whether longer bristles fit
constexpr double clearly_worse = 8.0;  // loss in twice the log likelihood that refutes longer bristles
constexpr double fewest_informing = 4.0;  // number of samples below which a parameter is undetermined
// Ratio of the sums of squares without and with an undetermined term, up to which the fit does without the
// term.
constexpr double little_worse = 1.02;
// Ratio of two rms errors, with undetermined parameters held and with all fitted. Above it the fit of all
// parameters is kept.
constexpr double spoilt = 1.05;

/// Returns by how many samples, in effect, a parameter is determined: (sum of w^2)^2 / sum of w^4, with w the
/// weights of the samples, a column of J (J'J)^-1. Least squares alone would trust a single sample.
double informing_samples(const Eigen::MatrixXd& jacobian, Eigen::Index parameter) {
  const Eigen::VectorXd length = jacobian.colwise().norm().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled = jacobian * length.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd normal = scaled.transpose() * scaled;
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(normal.rows(), parameter);
  const Eigen::ArrayXd weight = (scaled * solve_shortest(normal, unit)).array();
  const double fourth = weight.square().square().sum();
  return fourth > 0.0 ? std::pow(weight.square().sum(), 2) / fourth : 0.0;
}

/// Returns whether the record slides far enough to determine the presliding length. In a short motion
/// bristles three times as long and equally stiff may fit as well. No derivative shows that, so the function
/// fits these bristles and compares.
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

/// Returns whether a parameter belongs to a term that adds to the plain brush. The parameter is 0 without the
/// term.
bool is_added(FitParameter p) { return p >= fit_residual && p != fit_stribeck; }

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
    case fit_softening:
    case fit_delay:
      return "not seen";
    case fit_offset:
    case fit_drift:
    case fit_offset_y:
    case fit_drift_y:
      return "cannot be separated from friction";
    default:
      return "cannot be separated from other terms";
  }
}

/// Finds a parameter that the fit has driven to an end of its range, where its interval means nothing.
bool Fitter::at_an_edge(const FitPoint& point, FitParameter& edge, std::string& why) const {
  for (const FitParameter p : {fit_length, fit_spread, fit_residual, fit_renewal, fit_softening, fit_delay}) {
    if (!contains(point.free, p)) continue;
    const double low = model_.lowest(p), high = model_.highest(p);
    const double height = FitModel::is_logarithmic(p) ? std::log(point.values[p] / low) / std::log(high / low)
                                                      : (point.values[p] - low) / (high - low);
    if (height > 0.01 && height < 0.99) continue;
    edge = p;
    why = p == fit_softening || p == fit_delay ? std::string("not one: at the end of what is plausible")
          : p == fit_residual || p == fit_renewal
              ? (height < 0.5 ? std::string("not seen") : fmt::format("{:g} or more", high))
          : p == fit_spread
              ? fmt::format("at the {} end of what this law takes", height < 0.5 ? "lower" : "upper")
          : height < 0.5 ? std::string("presliding is shorter than the data resolve")
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
  if (FitModel::is_logarithmic(p)) return deviation <= widest_deviation;
  // Keeps a drift only beyond three standard deviations, because the search adds one to every record.
  if (p == fit_drift || p == fit_drift_y)
    return std::fabs(point.values[p]) >= 3.0 * deviation * model_.scale(point.values, p);
  if (p >= fit_offset) return deviation <= widest_offset;
  // Keeps a lubricant or a damper only if its parameter exceeds two standard deviations. Keeps rubbing
  // (residual and shared renewal) from one standard deviation on, because the presliding length would be
  // wrong by more than its interval without it.
  const double least = p == fit_renewal || p == fit_residual ? 1.0 : 2.0;
  return std::fabs(point.values[p]) >= least * deviation * model_.scale(point.values, p);
}

/// Returns a fit in which the parameter p is no longer fitted. Leaves out its term if the fit is about as
/// good without it, or if the term `must_go`; otherwise holds p at the value that fits best. Fits the other
/// parameters again.
FitPoint Fitter::without(const FitPoint& point, FitParameter p, const std::string& why, bool must_go) {
  FitPoint held = point;
  const bool damper = p == fit_damping || p == fit_stribeck;
  for (const FitParameter q : {p, damper ? fit_damping : p, damper ? fit_stribeck : p}) {
    take_out(held.free, q);
    why_[q] = why;
  }
  // Leaves out the spread and the stage's bending together with the presliding length: a record that does not
  // resolve presliding shows neither.
  if (p == fit_length && point.values[p] < data_.range) {
    for (const FitParameter q : {fit_spread, fit_softening}) {
      if (contains(held.free, q)) why_[q] = lacking(q);
      take_out(held.free, q);
    }
    held.values[fit_softening] = 0.0;
  }
  FitPoint left = held;
  if (is_added(p) || damper) left.values[damper ? fit_damping : p] = 0.0;
  if (p == fit_kinetic) {  // the usual coefficient, with the stiffness that was fitted
    left.values[p] = fit_defaults[p];
    left.values[fit_length] = std::clamp(point.values[fit_length] * fit_defaults[p] / point.values[p],
                                         model_.lowest(fit_length), model_.highest(fit_length));
  }
  if (p == fit_spread) left.values[p] = fit_defaults[p];
  left = minimise(model_, left);
  if (must_go || left.sum_of_squares <= little_worse * point.sum_of_squares) return left;
  return minimise(model_, held);
}

/// Finds, among the undetermined parameters, the one that the fit can best do without. Returns false if all
/// are determined.
bool Fitter::undetermined(const FitPoint& point, FitParameter& open, std::string& why) {
  if (at_an_edge(point, open, why)) return true;
  const Eigen::MatrixXd j = jacobian(model_, point);
  const Eigen::VectorXd r = residuals(point);
  const double nothing = 1e-6 * data_.force_scale * std::sqrt(static_cast<double>(samples()));
  const bool without_effect = j.colwise().norm().minCoeff() < nothing;
  Eigen::MatrixXd cov;
  if (!without_effect) {
    cov = covariance(j, r, correlated_samples(r));
    raise_to_parts(cov, j, r, data_.samples());
  }
  for (const FitParameter p :
       {fit_drift, fit_drift_y, fit_offset, fit_offset_y, fit_softening, fit_delay, fit_damping, fit_stribeck,
        fit_viscous, fit_renewal, fit_residual, fit_spread, fit_kinetic, fit_length}) {
    const auto at = std::find(point.free.begin(), point.free.end(), p);
    if (at == point.free.end()) continue;
    const auto i = static_cast<Eigen::Index>(at - point.free.begin());
    if (without_effect ? j.col(i).norm() >= nothing : is_determined(point, j, cov, i)) continue;
    open = p;
    why = lacking(p);
    return true;
  }
  return false;
}

/// Fits with several fixed values of the spread, refined about the best one until several fit about equally
/// well. Returns these fits, in the order of the spread.
std::vector<FitPoint> Fitter::as_good(const FitPoint& point, FitParameter open) {
  constexpr int tried = 5, passes = 2;
  constexpr std::size_t several_fits = 3;
  constexpr double as_good = 3.84;  // loss in twice the log likelihood at the ends of a 95 % interval
  double low = model_.lowest(open), high = model_.highest(open);
  std::vector<FitPoint> all{point}, row;
  for (int pass = 0; pass < passes && row.size() < several_fits && !fit_stopped(); ++pass) {
    const double ratio = std::pow(high / low, 1.0 / tried);
    for (int i = 0; i < tried; ++i) {
      FitPoint other = point;
      other.values[open] = low * std::pow(ratio, i + 0.25);
      all.push_back(minimise(model_, other));
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

/// Replaces an undetermined spread by the middle of those values that fit as well as the best. How much the
/// other parameters vary over these values then widens their intervals.
FitPoint Fitter::take_middle(FitPoint point, FitParameter open) {
  if (!contains(point.free, fit_length) || !contains(point.free, fit_kinetic)) return point;
  if (!has_spread(options_.law) || contains(point.free, open) || why_[open] != lacking(open)) return point;
  as_good_ = as_good(point, open);
  if (as_good_.empty()) return point;
  if (as_good_.size() > 1)
    why_[open] = fmt::format("{:.2g} to {:.2g} do as well", as_good_.front().values[open],
                             as_good_.back().values[open]);
  return as_good_[as_good_.size() / 2];
}

/// Holds the parameters that the record does not determine, one after the other, and leaves out terms that do
/// not predict held-out data. If the remaining fit is clearly worse, the fit with all parameters stays.
FitPoint Fitter::keep_determined(FitPoint point) {
  for (const FitParameter p : {fit_offset, fit_drift, fit_offset_y, fit_drift_y})
    if (!both_directions()) why_[p] = "the motion has one direction only";
  if (both_directions() && options_.no_drift) why_[fit_drift] = why_[fit_drift_y] = "held";
  if (!has_spread(options_.law)) why_[fit_spread] = "this law has none to choose";
  const FitPoint whole = point;
  const auto why_whole = why_;
  if (!point.free.empty() && !shows_sliding(model_, point, samples_that_count(point)))
    point = without(point, fit_kinetic, lacking(fit_kinetic));
  const auto drop_all = [&] {
    FitParameter open{};
    std::string why;
    while (!point.free.empty() && undetermined(point, open, why)) point = without(point, open, why);
  };
  drop_all();
  double before = point.sum_of_squares, kept = whole.sum_of_squares;
  if (!point.free.empty()) point = keep_predicting(point);
  kept += std::max(point.sum_of_squares - before, 0.0);  // a term that does not predict is no loss
  drop_all();
  point = take_middle(point, fit_spread);
  const double grown = std::sqrt(point.sum_of_squares / std::max(kept, 1e-300));
  if (grown <= spoilt) return point;
  notes_.push_back(fmt::format(
      "the record does not determine all numbers, but without those it is fitted worse by {:.0f} %: all are "
      "kept, for use together only",
      100.0 * (grown - 1.0)));
  why_ = why_whole;
  as_good_.clear();
  return whole;
}

}  // namespace cli
