// Fits a free law of snap lengths for the slide rule: a histogram whose weights come from least squares.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "tools/files/user_error.hpp"
#include "tools/fitting/least_squares.hpp"
#include "tools/fitting/solve.hpp"

namespace cli {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int bins = 28;
constexpr std::size_t folds = 5;

struct Bins {
  std::vector<double> edge;  // m, edges of the bins of snap length
  double low(int i) const { return edge[static_cast<std::size_t>(i)]; }
  double high(int i) const { return edge[static_cast<std::size_t>(i) + 1]; }
  double middle(int i) const { return 0.5 * (low(i) + high(i)); }
};

/// Makes bins in geometric progression, from the samples' resolution to the reach of the motion.
Bins make_bins(const FitModel& model, double presliding_length) {
  const double low = std::max(model.lowest(fit_length), 0.03 * presliding_length);
  const double high = std::max(std::min(model.data().range, 12.0 * presliding_length), 4.0 * low);
  Bins all;
  for (int i = 0; i <= bins; ++i)
    all.edge.push_back(low * std::pow(high / low, static_cast<double>(i) / bins));
  return all;
}

/// Sum of squares w' N w - 2 w' s + const as a function of the weights w: the matrix N and the right side s.
struct Normal {
  MatrixXd matrix;
  VectorXd side;
  double squares = 0.0;  // N^2, sum of squares of the measured force itself
  double left(const VectorXd& w) const { return w.dot(matrix * w) - 2.0 * w.dot(side) + squares; }
};

/// Returns the penalty matrix of second differences of neighbouring weights; weights beyond either end count
/// as 0.
MatrixXd roughness(Eigen::Index unknowns) {
  MatrixXd d = MatrixXd::Zero(bins, unknowns);
  for (int i = 0; i < bins; ++i) {
    d(i, i) = -2.0;
    if (i > 0) d(i, i - 1) = 1.0;
    if (i + 1 < bins) d(i, i + 1) = 1.0;
  }
  return d.transpose() * d;
}

/// Returns the quantiles, over their mean, of a law of snap lengths that is given as a histogram of
/// probability.
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

}  // namespace

/// Finds the law of snap lengths with the other parameters of `about` fixed, except those in which the force
/// is linear. Chooses the smoothness with the least error on held-out samples.
FreeLaw find_free_law(FitModel& model, const FitOptions& options, const FitPoint& about) {
  assume(model, about);
  const FitData& data = model.data();
  const std::size_t samples = data.samples();
  const Bins all = make_bins(model, about.values[fit_length]);

  // Columns: for each bin, the force of bristles of its length that carry all the load; then one for each
  // linear parameter.
  std::vector<FitParameter> linear;
  for (const FitParameter p : about.free)
    if (p == fit_viscous || p == fit_damping || p == fit_offset || p == fit_drift) linear.push_back(p);
  const auto unknowns = static_cast<Eigen::Index>(static_cast<std::size_t>(bins) + linear.size());
  MatrixXd columns(static_cast<Eigen::Index>(data.force.size()), unknowns);
  FitOptions uniform = options;
  uniform.law = bristle::SnapLaw::uniform;
  FitModel single(data, uniform, model.detail());
  assume(single, about);
  single.set_stage_force(model.stage_force());
  FitValues values = about.values;
  values[fit_kinetic] = 1.0;
  for (int i = 0; i < bins; ++i) {
    values[fit_length] = all.middle(i);
    values[fit_spread] = (all.high(i) - all.low(i)) / (all.high(i) + all.low(i)) / std::sqrt(3.0);
    columns.col(i) = single.derivative(values, fit_kinetic);
  }
  VectorXd rest = Eigen::Map<const VectorXd>(data.force.data(), columns.rows()) - model.force(about.values) +
                  model.derivative(about.values, fit_kinetic);
  for (std::size_t i = 0; i < linear.size(); ++i) {
    const FitParameter p = linear[i];
    const VectorXd column = model.derivative(about.values, p);
    columns.col(bins + static_cast<Eigen::Index>(i)) = column;
    rest += about.values[p] / model.scale(about.values, p) * column;
  }

  std::vector<Normal> of_fold(folds);
  Normal whole{MatrixXd::Zero(unknowns, unknowns), VectorXd::Zero(unknowns)};
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<Eigen::Index> held;
    for (Eigen::Index row = 0; row < columns.rows(); ++row)
      if (static_cast<std::size_t>(row) % samples * mixed_blocks / samples % folds == fold)
        held.push_back(row);
    const MatrixXd part = columns(held, Eigen::all);
    const VectorXd force = rest(held);
    of_fold[fold] = {part.transpose() * part, part.transpose() * force, force.squaredNorm()};
    whole.matrix += of_fold[fold].matrix;
    whole.side += of_fold[fold].side;
  }
  const MatrixXd penalty = roughness(unknowns) * (whole.matrix.topLeftCorner(bins, bins).trace() / bins);
  const auto solved = [&](const Normal& of, double smoothness) {
    return solve_nonnegative(of.matrix + smoothness * penalty, of.side, bins);
  };
  double best = std::numeric_limits<double>::infinity(), smoothness = 0.0;
  for (const double tried : {1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0}) {
    double left = 0.0;
    for (const Normal& held : of_fold)
      left += held.left(solved({whole.matrix - held.matrix, whole.side - held.side}, tried));
    if (left < best) {
      best = left;
      smoothness = tried;
    }
  }
  const VectorXd weights = solved(whole, smoothness);

  FreeLaw found;
  // Number of bristles in each bin: proportional to stiffness, which is force over length.
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
  found.point = about;
  found.point.values[fit_kinetic] = kinetic;
  found.point.values[fit_length] = kinetic / stiffness;
  for (std::size_t i = 0; i < linear.size(); ++i)
    found.point.values[linear[i]] =
        weights[bins + static_cast<Eigen::Index>(i)] * model.scale(about.values, linear[i]);
  FitParameterSet& free = found.point.free;
  free.erase(std::remove(free.begin(), free.end(), fit_spread), free.end());
  return found;
}

}  // namespace cli
