// Computes the errors of a fit that come from the contact's finite number of bristles.
#include <algorithm>
#include <cmath>

#include <bristle/patch_batch.hpp>

#include "core/patches/representatives/population.hpp"
#include "tools/libraries/fitting/least_squares.hpp"
#include "tools/libraries/fitting/solve.hpp"

namespace cli {
namespace {

constexpr std::size_t brushes = 100;
constexpr std::uint32_t bristles_of_each = 200;
// Limit of samples used: neighbouring samples have nearly equal errors, so that more add nothing.
constexpr std::size_t most_samples = 2000;
constexpr double widest_slide = 3000.0;  // longest simulated slide before a record, in presliding lengths

/// Returns how the elastic forces of randomly drawn brushes deviate from their mean, N: a row per sample, a
/// column per brush.
Eigen::MatrixXd fluctuations(const FitModel& model, const FitPoint& point, const FitData& data) {
  const bristle::Material material = model.unit_material(point.values);
  double most_load = 0.0;
  for (const PathPoint& place : data.path) most_load = std::max(most_load, place.load);
  const std::vector<Ring> rings = rings_of(data.columns.disc, Detail::search);
  const bristle::detail::RandomFirstLengths at_random;
  bristle::PatchBatch batch;
  // Motions of all brushes in the contact's first ring, then in the next one, and so on.
  std::vector<bristle::Motion> motions(brushes * rings.size());
  std::vector<bristle::Response> responses(motions.size());
  bristle::PatchOptions options;
  options.with_axes(static_cast<int>(data.axes)).with_max_normal_load(most_load);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const double here = rings[i / brushes].share * bristles_of_each;
    options.with_bristles(std::max(static_cast<std::uint32_t>(std::lround(here)), 1u));
    motions[i].id = batch.add(material, options.with_seed(static_cast<std::uint32_t>(i + 1)));
  }
  batch.warm_up();
  const auto step = [&](double dx, double dy, double load, double dt) {
    for (std::size_t i = 0; i < motions.size(); ++i) {
      const double lever = rings[i / brushes].lever;
      motions[i].displacement[0] = lever * dx;
      motions[i].displacement[1] = lever * dy;
      motions[i].normal_load = load;
    }
    batch.step(std::max(dt, 1e-9), {motions.data(), motions.size()}, {responses.data(), responses.size()});
  };
  const PathPoint& first = data.path.front();
  const auto begin = [&](StartState start, const PathPoint& at) {
    if (start != StartState::straight) {
      const double way = (start == StartState::forward ? 1.0 : -1.0) * point.values[fit_length];
      for (int i = 0; i < 2; ++i) step(0.5 * widest_slide * way, 0.0, at.load, 0.0);
    }
  };
  begin(point.past.start, first);
  const double scale = point.values[fit_kinetic] / model.kinetic_deflection(point.values);
  Eigen::MatrixXd force(static_cast<Eigen::Index>(data.force.size()), static_cast<Eigen::Index>(brushes));
  Eigen::Index sample = 0;
  PathPoint at = first;
  std::size_t record = 0;
  for (const PathPoint& place : data.path) {
    if (place.begins) {
      for (const bristle::Motion& motion : motions) batch.reset(motion.id);
      begin(point.past.of_part(++record), place);
      at = place;
    }
    step(place.x - at.x, place.y - at.y, place.load, place.t - at.t);
    at = place;
    if (!place.wanted) continue;
    for (unsigned axis = 0; axis < data.axes; ++axis) {
      const Eigen::Index row = sample + static_cast<Eigen::Index>(axis * data.samples());
      for (std::size_t i = 0; i < brushes; ++i) {
        double sum = 0.0;
        for (std::size_t k = 0; k < rings.size(); ++k)
          sum += rings[k].share * rings[k].lever * responses[k * brushes + i].elastic[axis];
        force(row, static_cast<Eigen::Index>(i)) = -scale * sum;
      }
    }
    ++sample;
  }
  return force.colwise() - force.rowwise().mean();
}

/// Returns the sum of products of neighbouring residuals, which is 0 on average for independent noise.
double neighbours_alike(const Eigen::VectorXd& r) { return r.head(r.size() - 1).dot(r.tail(r.size() - 1)); }

}  // namespace

PopulationError population_error(const FitModel& model, const FitPoint& point,
                                 const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                                 double usual_bristles) {
  // Returns no such error for the slide rule, whose snap lengths follow the law exactly, not at random.
  if (model.options().rule == bristle::SnapRule::slide) {
    const auto freedom = static_cast<double>(residuals.size() - jacobian.cols());
    return {Eigen::MatrixXd::Zero(jacobian.cols(), jacobian.cols()),
            residuals.squaredNorm() / std::max(freedom, 1.0)};
  }
  std::vector<std::size_t> kept;
  const std::size_t all = model.data().samples(), every = (all + most_samples - 1) / most_samples;
  for (std::size_t i = 0; i < all; i += every) kept.push_back(i);
  const FitData data = with_samples(model.data(), kept);
  const std::size_t part = kept.size();
  const auto samples = static_cast<Eigen::Index>(part * data.axes);
  Eigen::MatrixXd j(samples, jacobian.cols());
  Eigen::VectorXd r(samples);
  for (Eigen::Index i = 0; i < samples; ++i) {
    const std::size_t row = static_cast<std::size_t>(i), axis = row / part;
    const auto from = static_cast<Eigen::Index>(kept[row % part] + axis * all);
    j.row(i) = jacobian.row(from);
    r[i] = residuals[from];
  }
  const Eigen::MatrixXd force = fluctuations(model, point, data);
  const Eigen::MatrixXd moved = pseudo_inverse(j) * force;
  const Eigen::MatrixXd left = force - j * moved;

  // Averages over simulated brushes: the sum of squares, and the sum of products of neighbours, in the
  // residuals that a fit to one brush leaves.
  const double count = static_cast<double>(brushes);
  double squares = 0.0, products = 0.0, scatter = 0.0;
  for (Eigen::Index i = 0; i < left.cols(); ++i) {
    const double product = neighbours_alike(left.col(i));
    squares += left.col(i).squaredNorm() / (count - 1.0);
    products += product / (count - 1.0);
    scatter += product * product / (count - 1.0);
  }
  scatter = std::sqrt(std::max(scatter - products * products, 0.0));
  double most_load = 0.0;
  for (const PathPoint& place : data.path) most_load = std::max(most_load, place.load);
  const double of_mean_load = bristles_of_each * model.data().mean_load / most_load;

  // Estimates the variance that bristles cause, over that in the simulation, as a weighted mean of two
  // values: that of the usual number, with an error as large as itself, and that shown by the residuals. Adds
  // a quarter of the mean's error: intervals are wrong with too many bristles, only wide with too few.
  const double usual = of_mean_load / usual_bristles;
  const double chance = r.squaredNorm() / std::sqrt(static_cast<double>(samples));
  PopulationError error;
  double share = usual;
  if (products > 0.0) {
    const double shown = std::max(neighbours_alike(r), 0.0) / products;
    const double width = (std::max(usual, shown) * scatter + chance) / products;
    const double weight = 1.0 / (width * width), usual_weight = 1.0 / (usual * usual);
    share = (shown * weight + usual * usual_weight) / (weight + usual_weight) +
            0.25 / std::sqrt(weight + usual_weight);
  }
  error.covariance = moved * moved.transpose() * (share / (count - 1.0));
  error.noise = std::max(r.squaredNorm() - share * squares, 0.05 * r.squaredNorm()) /
                std::max(static_cast<double>(samples - j.cols()), 1.0);
  return error;
}

}  // namespace cli
