// Fits a free law of snap lengths for the rule slide, as a histogram whose weights follow from least squares.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/fitter.hpp"
#include "tools/libraries/fitting/least_squares.hpp"

namespace cli {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int bins = 28;
constexpr std::size_t folds = 5;
// Ratio of squared errors on held-out parts, with and without a lubricant or damper, below which the term is
// kept. It is below 1, because the best of many trials predicts even noise a little better by chance.
constexpr double clearly_less = 0.98;

struct Bins {
  std::vector<double> edge;  // edges of the histogram's bins of snap length, m
  double low(int i) const { return edge[static_cast<std::size_t>(i)]; }
  double high(int i) const { return edge[static_cast<std::size_t>(i) + 1]; }
  double middle(int i) const { return 0.5 * (low(i) + high(i)); }
};

/// Makes bins of snap length in a geometric series, from the shortest length that the samples resolve to the
/// range of the motion.
Bins make_bins(const FitModel& model, double presliding_length) {
  const double low = std::max(model.lowest(fit_length), 0.03 * presliding_length);
  const double high = std::max(std::min(model.data().range, 12.0 * presliding_length), 4.0 * low);
  Bins all;
  for (int i = 0; i <= bins; ++i)
    all.edge.push_back(low * std::pow(high / low, static_cast<double>(i) / bins));
  return all;
}

/// Least squares over weights w, written as the function w' N w - 2 w' s + const with the matrix N and the
/// right-hand side s.
struct Normal {
  MatrixXd matrix;
  VectorXd side;
  double squares = 0.0;  // sum of squares of the measured force, N^2
  double left(const VectorXd& w) const { return w.dot(matrix * w) - 2.0 * w.dot(side) + squares; }
};

/// Returns the matrix of a penalty that keeps the histogram smooth: squared second differences of
/// neighbouring weights. Weights beyond either end count as 0.
MatrixXd roughness(Eigen::Index unknowns) {
  MatrixXd d = MatrixXd::Zero(bins, unknowns);
  for (int i = 0; i < bins; ++i) {
    d(i, i) = -2.0;
    if (i > 0) d(i, i - 1) = 1.0;
    if (i + 1 < bins) d(i, i + 1) = 1.0;
  }
  return d.transpose() * d;
}

/// Returns the quantiles, over their mean, of a law of snap lengths that is given by the probability of each
/// bin of a histogram.
std::vector<double> quantiles_of(const Bins& all, const std::vector<double>& probability) {
  constexpr int last = bristle::SnapLength::max_table_size - 1;
  double total = 0.0, mean = 0.0;
  for (const double p : probability) total += p;
  std::vector<double> quantiles;
  double below = 0.0;
  int bin = 0;
  for (int i = 0; i <= last; ++i) {
    const double u = total * i / last;
    const auto p = [&] { return probability[static_cast<std::size_t>(bin)]; };
    while (bin + 1 < bins && below + p() <= u && (i < last || below + p() < u))
      below += probability[static_cast<std::size_t>(bin++)];
    const double share = p() > 0.0 ? std::clamp((u - below) / p(), 0.0, 1.0) : 0.0;
    quantiles.push_back(all.low(bin) + share * (all.high(bin) - all.low(bin)));
    mean += quantiles.back() * (i == 0 || i == last ? 0.5 : 1.0) / last;
  }
  for (double& q : quantiles) q /= mean;
  return quantiles;
}

/// Lists variants of a fitted point: without lubricant and damper and, if the record's speeds can show them,
/// with each and with both. Their coefficients are still 0 here.
std::vector<FitPoint> with_terms_of_speed(const FitData& data, const FitPoint& bare) {
  const bool several_speeds = data.ratio_of_speeds >= one_speed;
  std::vector<FitPoint> all{bare};
  if (several_speeds) {
    all.push_back(bare);
    all.back().free.push_back(fit_viscous);
  }
  if (!several_speeds && data.fast < one_speed * data.slow) return all;
  for (const FitPoint& from : std::vector<FitPoint>(all)) {
    for (const double speed : trial_stribeck_velocities(data)) {
      all.push_back(from);
      all.back().values[fit_stribeck] = speed;
      all.back().free.push_back(fit_damping);
    }
  }
  return all;
}

/// Histogram of snap lengths, the other terms of the fit, and the error on held-out parts.
struct Weighed {
  FitPoint terms;
  std::vector<FitParameter> linear;
  VectorXd weights;
  double held_out = std::numeric_limits<double>::infinity();  // N^2
};

/// Finds the weights of the histogram of snap lengths, and the terms in which the force is linear. Of several
/// degrees of smoothness takes the one with the least error on held-out parts. Weights, lubricant and damper
/// are not negative.
Weighed weigh(FitModel& model, const MatrixXd& of_bins, const VectorXd& force, const FitPoint& terms) {
  Weighed found{terms, {}, {}};
  Eigen::Index positive = bins;
  for (const FitParameter p : {fit_viscous, fit_damping, fit_offset, fit_drift}) {
    if (!contains(terms.free, p)) continue;
    found.linear.push_back(p);
    if (p == fit_viscous || p == fit_damping) ++positive;
  }
  const auto unknowns = bins + static_cast<Eigen::Index>(found.linear.size());
  MatrixXd columns(of_bins.rows(), unknowns);
  columns.leftCols(bins) = of_bins;
  for (std::size_t i = 0; i < found.linear.size(); ++i)
    columns.col(bins + static_cast<Eigen::Index>(i)) = model.derivative(terms.values, found.linear[i]);

  const std::size_t samples = model.data().samples();
  std::vector<Normal> of_fold(folds);
  Normal whole{MatrixXd::Zero(unknowns, unknowns), VectorXd::Zero(unknowns)};
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<Eigen::Index> held;
    for (Eigen::Index row = 0; row < columns.rows(); ++row)
      if (static_cast<std::size_t>(row) % samples * mixed_blocks / samples % folds == fold)
        held.push_back(row);
    const MatrixXd part = columns(held, Eigen::all);
    const VectorXd of_part = force(held);
    of_fold[fold] = {part.transpose() * part, part.transpose() * of_part, of_part.squaredNorm()};
    whole.matrix += of_fold[fold].matrix;
    whole.side += of_fold[fold].side;
  }
  const MatrixXd penalty = roughness(unknowns) * (whole.matrix.topLeftCorner(bins, bins).trace() / bins);
  const auto solved = [&](const Normal& of, double smoothness) {
    return solve_nonnegative(of.matrix + smoothness * penalty, of.side, positive);
  };
  double smoothness = 0.0;
  for (const double tried : {1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0}) {
    double left = 0.0;
    for (const Normal& held : of_fold)
      left += held.left(solved({whole.matrix - held.matrix, whole.side - held.side}, tried));
    if (left < found.held_out) {
      found.held_out = left;
      smoothness = tried;
    }
  }
  found.weights = solved(whole, smoothness);
  return found;
}

}  // namespace

/// Finds the free law of snap lengths and the parameters in which the force is linear; the other parameters
/// stay as in `about`. Chooses smoothness, lubricant and damper by the error on held-out samples.
FreeLaw find_free_law(FitModel& model, const FitOptions& options, const FitPoint& about) {
  assume(model, about);
  const FitData& data = model.data();
  const Bins all = make_bins(model, about.values[fit_length]);

  // Matrix with a column for each bin: the force if bristles with the snap length of that bin carried all the
  // load.
  MatrixXd of_bins(static_cast<Eigen::Index>(data.force.size()), bins);
  FitOptions uniform = options;
  uniform.law = bristle::SnapLaw::uniform;
  FitModel single(data, uniform, model.detail());
  single.set_past(about.past);
  single.bend_as(model);
  FitValues values = about.values;
  values[fit_kinetic] = 1.0;
  for (int i = 0; i < bins; ++i) {
    values[fit_length] = all.middle(i);
    values[fit_spread] = (all.high(i) - all.low(i)) / (all.high(i) + all.low(i)) / std::sqrt(3.0);
    of_bins.col(i) = single.derivative(values, fit_kinetic);
  }
  VectorXd remaining = Eigen::Map<const VectorXd>(data.force.data(), of_bins.rows()) -
                       model.force(about.values) + model.derivative(about.values, fit_kinetic);
  FitPoint bare = about;  // fitted point, but without lubricant and damper
  for (const FitParameter p : {fit_viscous, fit_damping, fit_offset, fit_drift}) {
    if (!contains(about.free, p)) continue;
    remaining += about.values[p] / model.scale(about.values, p) * model.derivative(about.values, p);
    bare.values[p] = 0.0;
  }
  for (const FitParameter p : {fit_viscous, fit_damping, fit_stribeck}) take_out(bare.free, p);

  const Weighed plain = weigh(model, of_bins, remaining, bare);
  Weighed best = plain;
  const auto attempt = [&](const FitPoint& terms) {
    Weighed tried = weigh(model, of_bins, remaining, terms);
    if (tried.held_out < best.held_out) best = std::move(tried);
  };
  for (const FitPoint& terms : with_terms_of_speed(data, bare)) attempt(terms);
  // Refines the Stribeck velocity of the damper. The best of the tried velocities lies within a factor of
  // 1.34 of the true one.
  for (const double factor : {1.34, 1.16, 1.08, 1.04}) {
    if (!contains(best.terms.free, fit_damping)) break;
    for (const FitPoint from = best.terms; const double by : {factor, 1.0 / factor}) {
      FitPoint terms = from;
      terms.values[fit_stribeck] *= by;
      attempt(terms);
    }
  }
  if (best.held_out > clearly_less * plain.held_out) best = plain;
  const VectorXd& weights = best.weights;
  FreeLaw found;
  // Relative number of bristles in each bin: in proportion to the stiffness, which is the bin's force over
  // its length.
  std::vector<double> probability;
  double stiffness = 0.0, kinetic = 0.0;
  for (int i = 0; i < bins; ++i) {
    probability.push_back(weights[i] / all.middle(i));
    stiffness += probability.back();
    kinetic += weights[i];
  }
  if (!(kinetic > 0.0))
    throw UserError(data.columns.name +
                    ": --law free: no law of lengths explains the force better than none");
  found.quantiles = quantiles_of(all, probability);
  found.point = best.terms;
  found.point.values[fit_kinetic] = kinetic;
  found.point.values[fit_length] = kinetic / stiffness;
  for (std::size_t i = 0; i < best.linear.size(); ++i) {
    const FitParameter p = best.linear[i];
    found.point.values[p] = weights[bins + static_cast<Eigen::Index>(i)] * model.scale(best.terms.values, p);
  }
  FitParameterSet& free = found.point.free;
  if (contains(free, fit_damping)) free.push_back(fit_stribeck);
  free.erase(std::remove(free.begin(), free.end(), fit_spread), free.end());
  return found;
}

}  // namespace cli
