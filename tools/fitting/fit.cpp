#include "tools/fitting/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <Eigen/QR>
#include <Eigen/SVD>

#include <bristle/error.hpp>

#include "tools/files/user_error.hpp"
#include "tools/fitting/model.hpp"
#include "tools/fitting/solve.hpp"
#include "tools/reports/progress.hpp"
#include "tools/scene/snap_law.hpp"

namespace cli {
namespace {

using bristle::SnapLaw;
using bristle::SnapRule;

constexpr double one_speed = 1.3;         // fast over slow below which there is one speed only
constexpr double widest_deviation = 0.5;  // of a logarithm: beyond, the interval spans a factor of seven
constexpr double widest_offset = 0.25;    // deviation over the rms of the force
constexpr double least_explained = 0.3;   // of the force: below, this is no friction of this motion
constexpr double least_back = 0.02;       // of the travel, for an offset
constexpr double least_friction = 0.01;   // of the force: below, the brush has no part in it
constexpr double fewest_informing = 4.0;  // samples that a parameter must rest on
constexpr double bristles_per_newton = 900.0;
constexpr std::size_t search_samples = 2000;

bool contains(const FitParameterSet& set, FitParameter p) {
  return std::count(set.begin(), set.end(), p) > 0;
}

void take_out(FitParameterSet& set, FitParameter p) {
  set.erase(std::remove(set.begin(), set.end(), p), set.end());
}

/// How many samples a parameter rests on: those with weight in its estimate, a column of J (J'J)^-1, counted
/// by (sum of squares)^2 over the sum of fourth powers. Least squares alone would trust a single one.
double informing_samples(const Eigen::MatrixXd& jacobian, Eigen::Index parameter) {
  const Eigen::VectorXd length = jacobian.colwise().norm().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled = jacobian * length.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd normal = scaled.transpose() * scaled;
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(normal.rows(), parameter);
  const Eigen::ArrayXd weight = (scaled * normal.completeOrthogonalDecomposition().solve(unit)).array();
  const double fourth = weight.square().square().sum();
  return fourth > 0.0 ? std::pow(weight.square().sum(), 2) / fourth : 0.0;
}

bristle::Material make_material(const FitValues& p, const FitOptions& options, const FitModel& model) {
  bristle::Material m = model.unit_material(p);
  m.damper_decay = options.decay;
  m.asperity_height_deviation = 1e-6;
  m.normal_stiffness = 1.0 / (bristles_per_newton * m.asperity_height_deviation);
  m.bristle_stiffness = p[fit_kinetic] / (bristles_per_newton * model.kinetic_deflection(p));
  m.bristle_damping = p[fit_damping] / bristles_per_newton;
  m.viscous_friction = p[fit_viscous];
  m.stribeck_velocity = p[fit_stribeck];
  m.validate();
  return m;
}

bool rubs(const FitParameterSet& set) { return contains(set, fit_residual) || contains(set, fit_renewal); }

/// A point, and of what is not free why.
struct Found {
  FitPoint point;
  std::array<std::string, fit_parameters> why;
};

/// Share of the travel that goes the way that it goes less.
double share_back(const std::vector<PathPoint>& path) {
  double forth = 0.0, back = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double move = path[i].x - path[i - 1].x;
    (move > 0.0 ? forth : back) += std::fabs(move);
  }
  return std::min(forth, back) / std::max(forth + back, 1e-300);
}

bool better(const FitPoint& a, const FitPoint& b) { return a.sum_of_squares < b.sum_of_squares; }

/// The lowest of a row of points that have no lower neighbour.
std::vector<FitPoint> valleys(const std::vector<FitPoint>& row, std::size_t most) {
  std::vector<FitPoint> low;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const bool hill =
        (i > 0 && better(row[i - 1], row[i])) || (i + 1 < row.size() && better(row[i + 1], row[i]));
    if (!hill) low.push_back(row[i]);
  }
  std::sort(low.begin(), low.end(), better);
  if (low.size() > most) low.resize(most);
  return low;
}

/// Finds the best point of a record, or takes away from one what the record does not determine.
class Fitter {
 public:
  Fitter(const FitData& data, const FitOptions& options, Detail detail, Progress& progress)
      : data_(data), options_(options), model_(data, options, detail), progress_(progress) {}

  Found search() {
    const FitPoint point = choose();
    return {point, why_};
  }
  FitResult finish(const Found& found) {
    why_ = found.why;
    const FitPoint point = found.point.free.empty() ? found.point : minimise(model_, found.point);
    refuse_without_friction(point);
    return report(keep_determined(point));
  }

 private:
  FitPoint search_plain();
  FitPoint search_whole_memory(const FitPoint& about);
  FitPoint search_rubbed();
  FitPoint choose();
  FitParameterSet bending() const {
    FitParameterSet set{fit_length};
    if (options_.law != SnapLaw::exponential) set.push_back(fit_spread);
    return set;
  }
  FitPoint linear_start(const FitValues& bent, const FitParameterSet& linear);
  FitPoint search_with(const std::vector<FitValues>& shapes, const FitParameterSet& bending, double progress);
  std::vector<FitValues> rubbed_shapes() const;
  FitPoint try_starts(FitPoint best);
  std::vector<FitPoint> speed_candidates(const FitPoint& core);
  FitPoint add_speed_terms(const FitPoint& core);
  FitPoint keep_determined(FitPoint point);
  bool drop_one(FitPoint& point, bool with_bristles = false);
  PopulationError bristle_error(const FitPoint& point, const Eigen::MatrixXd& j, const Eigen::VectorXd& r) {
    return population_error(model_, point, j, r, bristles_per_newton * data_.mean_load);
  }
  bool is_determined(const FitPoint& point, const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& cov,
                     Eigen::Index i) const;
  bool at_an_edge(FitPoint& point);
  std::string lacking(FitParameter p) const;
  void refuse_without_friction(const FitPoint& point);
  std::string why_no_peak(const FitPoint& point, const FitResult& result);
  FitResult report(const FitPoint& point);
  void derive(const FitPoint& point, const Eigen::MatrixXd& cov, double quantile, FitResult& result);

  Eigen::VectorXd residuals(const FitPoint& point) {
    model_.set_past(point.past);
    return model_.force(point.values) - Eigen::Map<const Eigen::VectorXd>(data_.force.data(), samples());
  }
  Eigen::Index samples() const { return static_cast<Eigen::Index>(data_.force.size()); }
  double samples_that_count(const FitPoint& point) {
    if (options_.for_prediction) return static_cast<double>(samples());
    return static_cast<double>(samples()) / correlated_samples(residuals(point));
  }
  /// Bayes' information criterion with the samples that count, parameters weighing twice: what a small
  /// population has of its own must not look like a damper.
  double criterion(const FitPoint& point, double count) const {
    return count * std::log(std::max(point.sum_of_squares, 1e-300)) +
           2.0 * static_cast<double>(point.free.size()) * std::log(count);
  }
  /// A few samples that go back do not tell an offset of the sensor from friction.
  bool two_ways() const { return data_.reversals > 0 && share_back(data_.path) > least_back; }

  const FitData& data_;
  const FitOptions& options_;
  FitModel model_;
  std::array<std::string, fit_parameters> why_;
  Progress& progress_;
};

/// The point that is bent like this (length, spread, rubbing, Stribeck velocity), everything else being
/// linear.
FitPoint Fitter::linear_start(const FitValues& bent, const FitParameterSet& linear) {
  FitPoint point;
  point.past = model_.past();
  for (const FitParameter p : {fit_length, fit_spread, fit_residual, fit_renewal, fit_stribeck}) {
    point.values[p] = bent[p];
  }
  point.values[fit_kinetic] = 1.0;  // so that its derivative is the unit force
  Eigen::MatrixXd a(samples(), static_cast<Eigen::Index>(linear.size()));
  for (std::size_t i = 0; i < linear.size(); ++i) {
    a.col(static_cast<Eigen::Index>(i)) = model_.derivative(point.values, linear[i]);
  }
  const Eigen::Map<const Eigen::VectorXd> f(data_.force.data(), samples());
  const Eigen::VectorXd solution = a.colPivHouseholderQr().solve(f);
  point.sum_of_squares = (a * solution - f).squaredNorm();
  const FitValues at = point.values;
  for (std::size_t i = 0; i < linear.size(); ++i) {
    point.values[linear[i]] = solution[static_cast<Eigen::Index>(i)] * model_.scale(at, linear[i]);
  }
  return point;
}

/// A grid over length and shapes (spread, rubbing), the rest linear; Levenberg-Marquardt from its best
/// lengths over the linear ones and `bending`.
FitPoint Fitter::search_with(const std::vector<FitValues>& shapes, const FitParameterSet& bending,
                             double progress) {
  FitParameterSet linear{fit_kinetic};
  if (two_ways()) linear.push_back(fit_offset);
  if (two_ways() && !options_.no_drift) linear.push_back(fit_drift);
  FitParameterSet free = linear;
  free.insert(free.end(), bending.begin(), bending.end());
  if (data_.fast > one_speed * data_.slow)
    linear.push_back(fit_viscous);  // else it would bend the force of the brush

  std::vector<FitPoint> best_of_length, best_of_shape(shapes.size());
  std::vector<std::vector<FitPoint>> of_shapes(shapes.size());
  for (FitPoint& point : best_of_shape) point.values[fit_kinetic] = 0.0;
  const double low = model_.lowest(fit_length), high = model_.highest(fit_length);
  // Kept lengths leave waves in the force: many minima, each narrow.
  const bool keep = options_.rule == SnapRule::keep;
  const double factor = keep ? 1.2 : 1.6;
  const int count = static_cast<int>(std::log(high / low) / std::log(factor)) + 2;
  for (int i = 0; i < count; ++i) {
    progress_.update(progress + 0.3 * i / count);
    FitPoint best;
    best.sum_of_squares = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < shapes.size(); ++k) {
      FitValues shape = shapes[k];
      shape[fit_length] = low * std::pow(high / low, (i + 0.5) / count);
      shape[fit_spread] = std::min(shape[fit_spread], 0.9 * model_.highest(fit_spread));
      const FitPoint point = linear_start(shape, linear);
      if (!(point.values[fit_kinetic] > 0.0)) continue;
      of_shapes[k].push_back(point);
      if (point.sum_of_squares < best.sum_of_squares) best = point;
      FitPoint& of_shape = best_of_shape[k];
      if (of_shape.values[fit_kinetic] == 0.0 || point.sum_of_squares < of_shape.sum_of_squares)
        of_shape = point;
    }
    if (best.values[fit_kinetic] > 0.0) best_of_length.push_back(best);
  }
  std::vector<FitPoint> starts = valleys(best_of_length, 3);
  if (keep) {  // a wide law is fair everywhere, and hides the narrow one that is right
    starts.clear();
    for (const std::vector<FitPoint>& of_shape : of_shapes) {
      const std::vector<FitPoint> lowest = valleys(of_shape, 2);
      starts.insert(starts.end(), lowest.begin(), lowest.end());
    }
  }
  if (rubs(bending)) {  // shapes differ more than lengths
    starts.clear();
    for (const FitPoint& point : best_of_shape) {
      if (point.values[fit_kinetic] > 0.0) starts.push_back(point);
    }
    std::sort(starts.begin(), starts.end(), better);
    if (starts.size() > 2) starts.resize(2);
  }
  FitPoint best;
  best.sum_of_squares = std::numeric_limits<double>::infinity();
  for (FitPoint& start : starts) {
    start.values[fit_viscous] = 0.0;
    start.values[fit_stribeck] = fit_defaults[fit_stribeck];
    start.free = free;
    const FitPoint point = minimise(model_, start);
    if (point.sum_of_squares < best.sum_of_squares) best = point;
  }
  return best;
}

/// Where rubbing is looked for: what is held stays. Empty where both are held.
std::vector<FitValues> Fitter::rubbed_shapes() const {
  std::vector<FitValues> shapes;
  if (options_.residual && options_.renewal) return shapes;
  constexpr double tried[][2] = {{0.1, 1.0}, {0.4, 0.3}, {0.4, 3.0}, {0.7, 1.0}};
  for (const auto& [residual, renewal] : tried) {
    FitValues shape = fit_defaults;
    shape[fit_spread] = options_.law == SnapLaw::exponential ? 1.0 : 0.4;
    shape[fit_residual] = options_.residual.value_or(residual);
    shape[fit_renewal] = options_.renewal.value_or(renewal);
    const bool there = std::any_of(shapes.begin(), shapes.end(), [&](const FitValues& other) {
      return other[fit_residual] == shape[fit_residual] && other[fit_renewal] == shape[fit_renewal];
    });
    if (!there) shapes.push_back(shape);
  }
  return shapes;
}

/// The paper's brush, or what is held of rubbing.
FitPoint Fitter::search_plain() {
  std::vector<FitValues> shapes;
  const std::vector<double> spreads = options_.rule == SnapRule::keep
                                          ? std::vector<double>{0.12, 0.25, 0.5, 1.0}
                                          : std::vector<double>{0.2, 0.5};
  for (const double spread : spreads) {
    FitValues shape = fit_defaults;
    shape[fit_spread] = options_.law == SnapLaw::exponential ? 1.0 : spread;
    shape[fit_residual] = options_.residual.value_or(0.0);
    shape[fit_renewal] = options_.renewal.value_or(0.0);
    shapes.push_back(shape);
    if (options_.law == SnapLaw::exponential) break;
  }
  if (options_.rule == SnapRule::redraw) return search_with(shapes, bending(), 0.0);
  const FitPoint forgotten = search_with(shapes, bending(), 0.0);
  if (forgotten.free.empty()) return forgotten;
  const FitPoint whole = search_whole_memory(forgotten);
  return better(whole, forgotten) ? whole : forgotten;
}

/// Bristles that remember all are out of step by a whole length after a slide of as many lengths as one is
/// off: a fine grid about the brush that forgets.
FitPoint Fitter::search_whole_memory(const FitPoint& about) {
  model_.set_past({about.past.start, Memory::whole});
  FitParameterSet linear;
  for (const FitParameter p : about.free)
    if (!FitModel::bends(p)) linear.push_back(p);
  std::vector<FitPoint> row;
  for (const double wider : {0.75, 0.9, 1.1}) {
    for (int i = -20; i <= 20; ++i) {
      FitValues bent = about.values;
      bent[fit_length] *= std::exp(0.005 * i);
      if (options_.law != SnapLaw::exponential)
        bent[fit_spread] = std::clamp(bent[fit_spread] * wider, model_.lowest(fit_spread),
                                      0.95 * model_.highest(fit_spread));
      FitPoint point = linear_start(bent, linear);
      point.free = about.free;
      if (point.values[fit_kinetic] > 0.0) row.push_back(point);
    }
  }
  FitPoint best;
  best.sum_of_squares = std::numeric_limits<double>::infinity();
  for (const FitPoint& start : valleys(row, 4)) {
    const FitPoint point = minimise(model_, start);
    if (better(point, best)) best = point;
  }
  return best;
}

/// A brush that can be rubbed; nothing free where both numbers are held.
FitPoint Fitter::search_rubbed() {
  if (options_.residual && options_.renewal) return {};
  FitParameterSet free = bending();
  if (!options_.residual) free.push_back(fit_residual);
  if (!options_.renewal) free.push_back(fit_renewal);
  return search_with(rubbed_shapes(), free, 0.4);
}

/// Rubbing where it pays for its parameters, once both brushes have all else that the data show.
FitPoint Fitter::choose() {
  FitPoint plain = search_plain(), rubbed = search_rubbed();
  if (plain.free.empty() && rubbed.free.empty()) {
    throw UserError(fmt::format("{}: the force never opposes the motion as friction does: nothing to fit",
                                data_.columns.name));
  }
  const auto complete = [&](FitPoint& point, double progress) {
    if (point.free.empty()) return why_;
    why_ = {};
    point = try_starts(point);
    progress_.update(progress);
    point = add_speed_terms(point);
    return why_;
  };
  const auto why_plain = complete(plain, 0.75), why_rubbed = complete(rubbed, 0.85);
  bool takes_rubbed = plain.free.empty();
  if (!plain.free.empty() && !rubbed.free.empty()) {
    const double count = samples_that_count(rubbed);
    takes_rubbed = criterion(rubbed, count) < criterion(plain, count);
  }
  why_ = takes_rubbed ? why_rubbed : why_plain;
  for (const FitParameter p : {fit_residual, fit_renewal}) {
    const bool held = p == fit_residual ? options_.residual.has_value() : options_.renewal.has_value();
    if (held)
      why_[p] = options_.rule == SnapRule::keep ? "with the rule keep there is none" : "held";
    else if (!takes_rubbed)
      why_[p] = "not seen: it does not pay for itself";
  }
  return takes_rubbed ? rubbed : plain;
}

/// Straight bristles at the first sample unless the data say clearly that the body came sliding.
FitPoint Fitter::try_starts(FitPoint best) {
  const FitPoint straight = best;
  for (const StartState start : {StartState::forward, StartState::backward}) {
    FitPoint from = straight;
    from.past.start = start;
    // Where the first stroke speaks against it, fitting would not help.
    if (residuals(from).squaredNorm() > 1.1 * straight.sum_of_squares) continue;
    const FitPoint point = minimise(model_, from);
    const double count = samples_that_count(point);
    const double gain = count * std::log(straight.sum_of_squares / std::max(point.sum_of_squares, 1e-300));
    if (gain > 10.0 && point.sum_of_squares < best.sum_of_squares) best = point;
  }
  return best;
}

/// With the lubricant, the damper, or both; all that bends the brush as in `core`, so that nothing need be
/// stepped.
std::vector<FitPoint> Fitter::speed_candidates(const FitPoint& core) {
  const FitParameterSet all = core.free;
  FitPoint rigid = core;
  for (const FitParameter p : {fit_length, fit_spread, fit_residual, fit_renewal}) take_out(rigid.free, p);
  std::vector<FitPoint> candidates;
  const auto add = [&](const FitPoint& start) {
    FitPoint point = minimise(model_, start);
    for (const FitParameter p : all) {
      if (!contains(point.free, p)) point.free.push_back(p);
    }
    candidates.push_back(point);
  };
  FitPoint lubricant = rigid;
  lubricant.free.push_back(fit_viscous);
  add(lubricant);
  for (const bool both : {false, true}) {
    FitParameterSet linear = rigid.free;
    linear.push_back(fit_damping);
    if (both) linear.push_back(fit_viscous);
    FitPoint best;
    best.sum_of_squares = std::numeric_limits<double>::infinity();
    for (double stribeck = data_.slow / 4.0; stribeck < 4.0 * data_.fast; stribeck *= 1.8) {
      FitValues bent = core.values;
      bent[fit_stribeck] = stribeck;
      const FitPoint point = linear_start(bent, linear);
      if (point.values[fit_damping] > 0.0 && point.values[fit_kinetic] > 0.0 &&
          point.sum_of_squares < best.sum_of_squares) {
        best = point;
      }
    }
    if (!(best.sum_of_squares < std::numeric_limits<double>::infinity())) continue;
    best.free = linear;
    best.free.push_back(fit_stribeck);
    add(best);
  }
  return candidates;
}

/// The lubricant, the damper, or both, where they pay for their parameters.
FitPoint Fitter::add_speed_terms(const FitPoint& core) {
  if (data_.fast < one_speed * data_.slow) {
    for (const FitParameter p : {fit_viscous, fit_damping, fit_stribeck}) {
      why_[p] = fmt::format("one speed only ({:.3g} to {:.3g} m/s)", data_.slow, data_.fast);
    }
    return core;
  }
  FitPoint best = core;
  for (const FitPoint& candidate : speed_candidates(core)) {
    if (candidate.values[fit_viscous] < 0.0 || candidate.values[fit_damping] < 0.0) continue;
    const double count = samples_that_count(candidate);
    if (criterion(candidate, count) < criterion(best, count)) best = candidate;
  }
  if (best.free.size() > core.free.size()) best = minimise(model_, best);
  for (const FitParameter p : {fit_viscous, fit_damping, fit_stribeck}) {
    if (!contains(best.free, p)) {
      why_[p] = fmt::format("not seen between {:.3g} and {:.3g} m/s", data_.slow, data_.fast);
    }
  }
  return best;
}

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
      return "cannot be separated from friction";
    default:
      return "cannot be separated from other terms";
  }
}

/// Parameters that ran to an end of their range stay there.
bool Fitter::at_an_edge(FitPoint& point) {
  for (const FitParameter p : {fit_length, fit_spread, fit_residual, fit_renewal}) {
    if (!contains(point.free, p)) continue;
    const double low = model_.lowest(p), high = model_.highest(p);
    const double place = FitModel::is_logarithmic(p) ? std::log(point.values[p] / low) / std::log(high / low)
                                                     : (point.values[p] - low) / (high - low);
    if (place > 0.01 && place < 0.99) continue;
    take_out(point.free, p);
    point.values[p] = place < 0.5 ? low : high;
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
  if (FitModel::is_logarithmic(p)) return deviation <= widest_deviation;
  if (p == fit_offset || p == fit_drift) return deviation <= widest_offset;
  return point.values[p] >=
         2.0 * deviation * model_.scale(point.values, p);  // lubricant, damper: there at all?
}

/// Takes out the most expendable parameter of those that the data do not determine.
bool Fitter::drop_one(FitPoint& point, bool with_bristles) {
  if (at_an_edge(point)) return true;
  const Eigen::MatrixXd j = jacobian(model_, point);
  const Eigen::VectorXd r = residuals(point);
  const double nothing = 1e-6 * data_.force_scale * std::sqrt(static_cast<double>(samples()));
  const bool without_effect = j.colwise().norm().minCoeff() < nothing;
  const double correlated = correlated_samples(r);
  const Eigen::MatrixXd cov = without_effect  ? Eigen::MatrixXd()
                              : with_bristles ? covariance(j, r, correlated, bristle_error(point, j, r))
                                              : covariance(j, r, correlated);
  for (const FitParameter p : {fit_drift, fit_offset, fit_damping, fit_stribeck, fit_viscous, fit_renewal,
                               fit_residual, fit_spread, fit_kinetic, fit_length}) {
    const auto at = std::find(point.free.begin(), point.free.end(), p);
    if (at == point.free.end()) continue;
    const auto i = static_cast<Eigen::Index>(at - point.free.begin());
    if (without_effect ? j.col(i).norm() >= nothing : is_determined(point, j, cov, i)) continue;
    const double before = point.values[p];
    take_out(point.free, p);
    point.values[p] = fit_defaults[p];
    why_[p] = lacking(p);
    if (p == fit_damping || p == fit_stribeck) {
      for (const FitParameter q : {fit_damping, fit_stribeck}) {
        take_out(point.free, q);
        point.values[q] = fit_defaults[q];
        why_[q] = lacking(q);
      }
    }
    if (p == fit_kinetic) {  // the stiffness stays
      double& length = point.values[fit_length];
      length = std::clamp(length * point.values[p] / before, model_.lowest(fit_length),
                          model_.highest(fit_length));
    }
    return true;
  }
  return false;
}

FitPoint Fitter::keep_determined(FitPoint point) {
  if (!two_ways()) why_[fit_offset] = why_[fit_drift] = "the motion has one direction only";
  if (two_ways() && options_.no_drift) why_[fit_drift] = "held";
  if (options_.law == SnapLaw::exponential) why_[fit_spread] = "the exponential law has none to choose";
  if (options_.for_prediction) return point;
  while (!point.free.empty() && drop_one(point)) point = minimise(model_, point);
  // With the error of the bristles themselves some are not determined after all.
  while (!point.free.empty() && drop_one(point, true)) point = minimise(model_, point);
  return point;
}

void Fitter::refuse_without_friction(const FitPoint& point) {
  model_.set_past(point.past);
  const double brush = point.values[fit_kinetic] * model_.elastic(point.values).norm();
  const double force = data_.force_scale * std::sqrt(static_cast<double>(samples()));
  if (brush >= least_friction * force) return;
  throw UserError(
      fmt::format("{}: {:.2g} % of the force is friction of a brush, less than {:g} %: the rest goes with "
                  "the speed, or is "
                  "an offset (nothing to fit; sign, columns?)",
                  data_.columns.name, 100.0 * brush / force, 100.0 * least_friction));
}

/// The peak is that of a first loading. Empty where the record shows one, and reaches it.
std::string Fitter::why_no_peak(const FitPoint& point, const FitResult& result) {
  model_.set_past(point.past);
  const Eigen::VectorXd& unit = model_.elastic(point.values);
  const double middle = data_.start() + 0.5 * data_.length();
  double highest = 0.0, reached = 0.0;  // over the load: measured, less what the sensor adds; of the fit
  for (std::size_t i = 0; i < data_.force.size(); ++i) {
    if (data_.load[i] < 0.1 * data_.mean_load) continue;
    const double sensor = point.values[fit_offset] + point.values[fit_drift] * (data_.columns.t[i] - middle);
    highest = std::max(highest, std::fabs(data_.force[i] - sensor) / data_.load[i]);
    reached = std::max(
        reached, point.values[fit_kinetic] * std::fabs(unit[static_cast<Eigen::Index>(i)]) / data_.load[i]);
  }
  const double kinetic = point.values[fit_kinetic], peak = result.peak.value;
  if (reached < kinetic + 0.9 * (peak - kinetic) - 0.02 * kinetic)
    return fmt::format("no first loading in the record: the fit rises to {:.3g} there", reached);
  if (highest < result.peak.low)
    return fmt::format("the record contradicts it: its highest is {:.3g}", highest);
  return {};
}

/// Peak coefficient and stiffness: functions of what was fitted, errors carried over.
void Fitter::derive(const FitPoint& point, const Eigen::MatrixXd& cov, double quantile, FitResult& result) {
  const auto moved = [&](FitParameter p, double by) {
    FitValues values = point.values;
    values[p] = FitModel::is_logarithmic(p) ? values[p] * std::exp(by) : values[p] + by;
    values[p] = std::clamp(values[p], p == fit_kinetic ? 0.0 : model_.lowest(p), model_.highest(p));
    return values;
  };
  // Derivatives of the logarithm in units of FitModel::scale.
  const auto interval = [&](FitEstimate& estimate, const auto& function) {
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(cov.rows());
    for (std::size_t i = 0; i < point.free.size(); ++i) {
      const FitParameter p = point.free[i];
      if (p != fit_kinetic && !FitModel::bends(p)) continue;
      constexpr double step = 0.02;
      const FitValues up = moved(p, step), down = moved(p, -step);
      const double between = FitModel::is_logarithmic(p) ? std::log(up[p] / down[p]) : up[p] - down[p];
      gradient[static_cast<Eigen::Index>(i)] = std::log(function(up) / function(down)) / between;
    }
    const double width = quantile * std::sqrt(std::max(gradient.dot(cov * gradient), 0.0));
    estimate.value = function(point.values);
    estimate.low = estimate.value * std::exp(-width);
    estimate.high = estimate.value * std::exp(width);
  };
  interval(result.peak,
           [&](const FitValues& p) { return make_material(p, options_, model_).peak_coefficient(); });
  interval(result.stiffness,
           [&](const FitValues& p) { return p[fit_kinetic] / model_.kinetic_deflection(p); });
  // Parameters that stayed where they were put count as known only where they do not matter.
  result.peak.fitted = contains(point.free, fit_kinetic) &&
                       (contains(point.free, fit_spread) || options_.law == SnapLaw::exponential);
  if (!result.peak.fitted) {
    result.peak.why = "follows from kinetic and spread";
  } else {
    result.peak.why = why_no_peak(point, result);
    result.peak.fitted = result.peak.why.empty();
  }
  result.stiffness.fitted = contains(point.free, fit_length);
  if (!result.stiffness.fitted) result.stiffness.why = "follows from presliding_length";
}

FitResult Fitter::report(const FitPoint& point) {
  FitResult result;
  result.past = point.past;
  result.material = make_material(point.values, options_, model_);
  const Eigen::VectorXd r = residuals(point);
  const Eigen::VectorXd curve = model_.force(point.values);
  result.curve.assign(curve.begin(), curve.end());
  result.residual_rms = std::sqrt(r.squaredNorm() / static_cast<double>(r.size()));
  const double middle = data_.start() + 0.5 * data_.length();
  double squares = 0.0;
  for (std::size_t i = 0; i < data_.force.size(); ++i) {
    const double f =
        data_.force[i] - point.values[fit_offset] - point.values[fit_drift] * (data_.columns.t[i] - middle);
    squares += f * f;
  }
  result.explained = 1.0 - r.squaredNorm() / squares;
  if (!(result.explained >= least_explained) || point.free.empty()) {
    throw UserError(
        fmt::format("{}: the brush explains {:.0f} % of the force, less than {:.0f} %: this is not friction "
                    "of this motion (sign, units, columns?)",
                    data_.columns.name, 100.0 * std::max(result.explained, 0.0), 100.0 * least_explained));
  }
  result.correlated_samples = correlated_samples(r);
  const Eigen::MatrixXd j = jacobian(model_, point);
  const PopulationError population = bristle_error(point, j, r);
  result.fluctuating_bristles =
      population.seen ? population.bristles / data_.mean_load : std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd cov = covariance(j, r, result.correlated_samples, population);
  const Eigen::MatrixXd scaled = j * j.colwise().norm().cwiseInverse().asDiagonal();
  const Eigen::VectorXd singular = scaled.jacobiSvd().singularValues();
  result.smallest_singular_value = singular.minCoeff() / singular.maxCoeff();
  const double count = static_cast<double>(samples()) / result.correlated_samples;
  const double quantile = student_quantile(count - static_cast<double>(point.free.size()));
  for (unsigned k = 0; k < fit_parameters; ++k) {
    const auto p = static_cast<FitParameter>(k);
    FitEstimate& estimate = result.estimates[k];
    estimate.value = point.values[k];
    estimate.why = why_[k];
    const auto at = std::find(point.free.begin(), point.free.end(), p);
    if (at == point.free.end()) continue;
    estimate.fitted = true;
    const auto i = static_cast<Eigen::Index>(at - point.free.begin());
    const double width = quantile * std::sqrt(std::max(cov(i, i), 0.0));
    if (FitModel::is_logarithmic(p)) {
      estimate.low = estimate.value * std::exp(-width);
      estimate.high = estimate.value * std::exp(width);
    } else {
      estimate.low = estimate.value - width * model_.scale(point.values, p);
      estimate.high = estimate.value + width * model_.scale(point.values, p);
    }
    if (p == fit_residual || p == fit_renewal) estimate.low = std::max(estimate.low, 0.0);
    if (p == fit_residual) estimate.high = std::min(estimate.high, 1.0);
  }
  FitEstimate& length = result.estimates[fit_length];
  if (length.fitted && !contains(point.free, fit_kinetic)) {
    length.fitted = false;
    length.why = "what the stiffness asks for with this kinetic coefficient";
  }
  derive(point, cov, quantile, result);
  result.evaluations = model_.evaluations();
  return result;
}

}  // namespace

FitResult fit_material(const FitData& data, const FitOptions& options) {
  if (options.law == SnapLaw::single || options.law == SnapLaw::table) {
    throw UserError("--law: allowed are lognormal, normal, uniform, exponential");
  }
  FitOptions held = options;
  if (options.rule == SnapRule::keep) {
    if (options.residual.value_or(0.0) != 0.0 || options.renewal.value_or(0.0) != 0.0) {
      throw UserError("--residual and --renewal: other values than 0 need --rule redraw");
    }
    held.residual = held.renewal = 0.0;
  }
  try {
    Progress progress("fit", options.quiet);
    // The search needs no more than shows the shape.
    const FitData thin = thinned(data, search_samples);
    const Found found = Fitter(thin, held, Detail::search, progress).search();
    progress.update(0.9);
    return Fitter(data, held, Detail::finish, progress).finish(found);
  } catch (const bristle::Error& error) {
    throw UserError(
        fmt::format("{}: the fit leaves what a material allows: {}", data.columns.name, error.what()));
  }
}

}  // namespace cli
