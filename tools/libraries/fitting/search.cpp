// Searches starting points of a fit, minimises the residuals from them, and adds terms where these lower the
// residuals enough.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/fitter.hpp"
#include "tools/libraries/fitting/least_squares.hpp"

namespace cli {
namespace {

using bristle::SnapLaw;
using bristle::SnapRule;

// Share of the travel that has to lead backwards, for a record to determine the sensor's offset.
constexpr double least_back = 0.02;
// Factor from one presliding length that a search tries to the next.
constexpr double length_factor = 1.7;
// Delays of a sensor (first-order low-pass) from which a fit starts, in intervals between samples.
constexpr double tried_delays[] = {0.5, 5.0};
// Loss in twice the log likelihood, up to which the shortest presliding length counts as fitting as well as
// the best.
constexpr double as_well = 8.0;

/// Returns the share of the travelled distance that goes in the less travelled direction; in the plane, the
/// share that does not lead away from the start.
double share_back(const std::vector<PathPoint>& path) {
  double travel = 0.0, away = 0.0;
  std::size_t begin = 0;
  const auto far = [](const PathPoint& a, const PathPoint& b) { return std::hypot(b.x - a.x, b.y - a.y); };
  for (std::size_t i = 1; i < path.size(); ++i) {
    if (path[i].begins) {
      away += far(path[begin], path[i - 1]);
      begin = i;
    } else {
      travel += far(path[i - 1], path[i]);
    }
  }
  away += far(path[begin], path.back());
  return 0.5 * (1.0 - away / std::max(travel, 1e-300));
}

/// Returns the lowest local minima of the error, at most three, in a row of points ordered by presliding
/// length.
std::vector<FitPoint> valleys(const std::vector<FitPoint>& row) {
  constexpr std::size_t most = 3;
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

}  // namespace

bool Fitter::both_directions() const { return data_.reversals > 0 && share_back(data_.path) > least_back; }

FitParameterSet Fitter::linear_set() const {
  FitParameterSet linear{fit_kinetic};
  if (!both_directions()) return linear;
  linear.push_back(fit_offset);
  if (data_.axes == 2) linear.push_back(fit_offset_y);
  if (options_.no_drift) return linear;
  linear.push_back(fit_drift);
  if (data_.axes == 2) linear.push_back(fit_drift_y);
  return linear;
}

/// Makes a starting point of a fit. The parameters that shape the brush (length, spread, rubbing, Stribeck
/// velocity) are those of `bent`; the others, in which the force is linear, follow from least squares.
FitPoint Fitter::linear_start(const FitValues& bent, const FitParameterSet& linear) {
  FitPoint point;
  point.past = model_.past();
  for (const FitParameter p :
       {fit_length, fit_spread, fit_residual, fit_renewal, fit_softening, fit_delay, fit_stribeck})
    point.values[p] = bent[p];
  point.values[fit_kinetic] = 1.0;  // at this value, the derivative is the force for a coefficient of 1
  Eigen::MatrixXd a(samples(), static_cast<Eigen::Index>(linear.size()));
  for (std::size_t i = 0; i < linear.size(); ++i)
    a.col(static_cast<Eigen::Index>(i)) = model_.derivative(point.values, linear[i]);
  const Eigen::Map<const Eigen::VectorXd> f(data_.force.data(), samples());
  const Eigen::VectorXd solution = solve_least_squares(a, f);
  point.sum_of_squares = (a * solution - f).squaredNorm();
  const FitValues at = point.values;
  for (std::size_t i = 0; i < linear.size(); ++i)
    point.values[linear[i]] = solution[static_cast<Eigen::Index>(i)] * model_.scale(at, linear[i]);
  return point;
}

/// Searches a grid of presliding lengths and spreads, with the linear parameters from least squares. From the
/// best lengths Levenberg-Marquardt refines the linear parameters and, unless the shortest length fits as
/// well (the record then shows no presliding), length and spread. Returns a point without free parameters if
/// no length gives positive friction.
FitPoint Fitter::search_grid() {
  const FitParameterSet terms = linear_set();
  FitParameterSet linear = terms;
  // Fits no lubricant to a record of a single speed, in which it looks like friction of the brush.
  if (several_speeds()) linear.push_back(fit_viscous);
  const double low = model_.lowest(fit_length), high = model_.highest(fit_length);
  const int count = static_cast<int>(std::log(high / low) / std::log(length_factor)) + 2;
  std::vector<double> spreads{0.2, 0.5};
  if (options_.rule == SnapRule::slide) spreads = {0.15, 0.5, 1.5};
  if (!has_spread(options_.law)) spreads = {1.0};
  std::vector<FitPoint> row;
  for (int i = 0; i < count; ++i) {  // also when stopped: a first point has to be found
    FitPoint best;
    best.sum_of_squares = std::numeric_limits<double>::infinity();
    for (const double spread : spreads) {
      FitValues shape = fit_defaults;
      shape[fit_residual] = options_.residual.value_or(0.0);
      shape[fit_renewal] = options_.renewal.value_or(0.0);
      shape[fit_length] = low * std::pow(high / low, (i + 0.01) / (count - 1 + 0.02));
      shape[fit_spread] = std::min(spread, 0.9 * model_.highest(fit_spread));
      const FitPoint point = linear_start(shape, linear);
      if (point.values[fit_kinetic] > 0.0 && better(point, best)) best = point;
    }
    // Leaves out a presliding length at which no spread gives positive friction.
    if (best.sum_of_squares < std::numeric_limits<double>::infinity()) row.push_back(best);
  }
  if (row.empty()) return {};
  FitParameterSet free = terms;
  for (const FitParameter p : bending()) free.push_back(p);
  FitPoint best;
  best.sum_of_squares = std::numeric_limits<double>::infinity();
  for (FitPoint& start : valleys(row)) {
    start.values[fit_viscous] = 0.0;
    start.free = free;
    if (!resolves(start)) take_out(start.free, fit_spread);
    const FitPoint point = minimise(model_, start);
    if (better(point, best)) best = point;
  }
  // Compares with the shortest length, both with a lubricant if the speeds of the record can show one.
  FitPoint shortest = row.front(), refined = linear_start(best.values, linear);
  const double gain = samples_that_count(refined) *
                      std::log(shortest.sum_of_squares / std::max(refined.sum_of_squares, 1e-300));
  if (shortest.values[fit_length] > 1.1 * low || gain > as_well) return best;
  for (const FitParameter p : bending()) why_[p] = lacking(p);
  shortest.values[fit_viscous] = 0.0;
  shortest.free = terms;
  return minimise(model_, shortest);
}

Found Fitter::search_plain() {
  FitPoint core = search_grid();
  if (core.free.empty())
    throw UserError(fmt::format("{}: the force never opposes the motion as friction does: nothing to fit",
                                data_.columns.name));
  core = try_starts(core);
  const FitPoint whole = add_speed_terms(core);
  for (const FitParameter p : {fit_residual, fit_renewal}) {
    const bool held = p == fit_residual ? options_.residual.has_value() : options_.renewal.has_value();
    why_[p] = !held                               ? "not seen: it does not pay for itself"
              : options_.rule == SnapRule::redraw ? "held"
                                                  : "with this rule there is none";
  }
  for (const FitParameter p : {fit_softening, fit_delay}) why_[p] = "not seen: it does not pay for itself";
  return found(whole);
}

/// Starts from little and from more rubbing (residual and shared renewal). Keeps what lowers the residuals
/// enough to justify its parameters.
Found Fitter::add_rubbing(const Found& plain) {
  go_on(plain);
  FitPoint best = plain.point;
  if (!contains(best.free, fit_length)) return plain;
  constexpr double tried[][2] = {{0.0, 1.0}, {0.3, 1.0}, {0.6, 0.5}};
  for (const auto& [residual, renewal] : tried) {
    if (fit_stopped()) break;
    FitPoint point = plain.point;
    const auto release = [&](FitParameter p, double value) {
      point.values[p] = value;
      point.free.push_back(p);
    };
    if (!options_.renewal) release(fit_renewal, renewal);
    if (!options_.residual && residual > 0.0) release(fit_residual, residual);
    if (point.free.size() == plain.point.free.size()) continue;
    point = minimise(model_, point);
    if (justified(point, best)) best = point;
  }
  for (const FitParameter p : {fit_residual, fit_renewal})
    if (contains(best.free, p)) why_[p].clear();
  return found(best);
}

Found Fitter::with_speed_terms(const Found& plain) {
  go_on(plain);
  FitPoint best = plain.point;
  if (contains(best.free, fit_damping) || (!several_speeds() && !slow_reversals()) || fit_stopped())
    return plain;
  for (const FitPoint& candidate : speed_candidates(plain.point))
    if (candidate.free.size() > plain.point.free.size() && better(candidate, best)) best = candidate;
  if (best.free.size() == plain.point.free.size()) return plain;
  best = minimise(model_, best);
  for (const FitParameter p : {fit_viscous, fit_damping, fit_stribeck})
    if (contains(best.free, p)) why_[p].clear();
  return found(best);
}

/// Returns whether the parameters of `point`, which has one or two more than `core`, promise at least half of
/// the gain that would justify them, if the force were linear in all of them. If not, a full fit is not worth
/// its time.
bool Fitter::promises(const FitPoint& point, const FitPoint& core) {
  const Eigen::VectorXd left = project(jacobian(model_, point), residuals(point)).left;
  const double count = static_cast<double>(samples()) / correlated_samples(left);
  const double gain = count * std::log(core.sum_of_squares / std::max(left.squaredNorm(), 1e-300));
  return gain > std::log(count) * static_cast<double>(point.free.size() - core.free.size());
}

/// Fits with a sensor that lags (low-pass), with a stage that is stiffer one way than the other, and with
/// both. Takes what lowers the residuals enough to justify its parameters. Adds terms of speed to a brush
/// that had none.
Found Fitter::add_stage(const Found& plain) {
  go_on(plain);
  const FitPoint& core = plain.point;
  FitPoint best = core;
  const auto attempt = [&](FitPoint point) {
    if (fit_stopped() || !promises(point, core)) return;
    point = minimise(model_, point);
    if (justified(point, best)) best = point;
  };
  const auto delayed = [&](FitPoint from) {
    if (!both_directions() || contains(from.free, fit_delay)) return;
    from.free.push_back(fit_delay);
    for (const double times : tried_delays) {
      from.values[fit_delay] = std::clamp(times * data_.sample_time, 1.1 * model_.lowest(fit_delay),
                                          0.9 * model_.highest(fit_delay));
      attempt(from);
    }
  };
  delayed(core);
  if (data_.axes == 1 && both_directions() && contains(core.free, fit_length) && resolves(core)) {
    std::vector<FitPoint> starts{core};
    if (contains(best.free, fit_delay)) starts.push_back(best);
    for (FitPoint& from : starts) {
      if (contains(from.free, fit_softening)) continue;
      from.free.push_back(fit_softening);
      attempt(from);
    }
    if (contains(best.free, fit_softening)) delayed(best);
  }
  if (best.free != core.free && !contains(best.free, fit_damping)) best = add_speed_terms(best);
  for (const FitParameter p : {fit_softening, fit_delay})
    why_[p] = contains(best.free, p) ? "" : "not seen: it does not pay for itself";
  return found(best);
}

Found Fitter::with_free_law(const Found& start, std::vector<double>& quantiles) {
  FreeLaw free = find_free_law(model_, options_, start.point);
  quantiles = std::move(free.quantiles);
  go_on(start);
  return found(free.point);
}

Found Fitter::fit_again(const Found& start) {
  go_on(start);
  return found(start.point.free.empty() ? start.point : try_starts(minimise(model_, start.point)));
}

/// Chooses the state of the brush at the first sample: straight bristles, unless the data say clearly that
/// the body was sliding already.
FitPoint Fitter::try_starts(FitPoint best) {
  const FitPoint straight = best;
  for (const StartState start : {StartState::forward, StartState::backward}) {
    FitPoint from = straight;
    from.past.start = start;
    // Skips a state at the first sample that contradicts the first stroke of the record.
    if (residuals(from).squaredNorm() > 1.1 * straight.sum_of_squares) continue;
    const FitPoint point = minimise(model_, from);
    const double count = samples_that_count(point);
    const double gain = count * std::log(straight.sum_of_squares / std::max(point.sum_of_squares, 1e-300));
    if (gain > 10.0 && point.sum_of_squares < best.sum_of_squares) best = point;
  }
  return try_later_starts(best);
}

/// Chooses the state at the start of each later record with all parameters fixed, then fits everything again.
FitPoint Fitter::try_later_starts(FitPoint point) {
  if (data_.columns.parts.empty()) return point;
  bool changed = false;
  point.past.later.resize(data_.columns.parts.size(), StartState::straight);
  for (std::size_t k = 0; k < point.past.later.size(); ++k) {
    double least = residuals(point).squaredNorm();
    const double count = samples_that_count(point);
    for (const StartState start : {StartState::forward, StartState::backward}) {
      FitPoint other = point;
      other.past.later[k] = start;
      const double squares = residuals(other).squaredNorm();
      if (count * std::log(least / std::max(squares, 1e-300)) <= 10.0) continue;
      least = squares;
      point = other;
      changed = true;
    }
  }
  return changed ? minimise(model_, point) : point;
}

/// Returns candidates that add a lubricant (viscous friction), a damper, or both to the brush of `core`. With
/// the rule redraw the shape of the brush stays fixed, so that it need not be stepped again.
std::vector<FitPoint> Fitter::speed_candidates(const FitPoint& core) {
  FitPoint rigid = core;
  for (const FitParameter p : {fit_length, fit_spread, fit_residual, fit_renewal, fit_softening, fit_delay})
    take_out(rigid.free, p);
  assume(model_, core);
  std::vector<FitPoint> candidates;
  const auto add = [&](const FitPoint& start) {
    FitPoint point = minimise(model_, start);
    for (const FitParameter p : core.free) {
      if (!contains(point.free, p)) point.free.push_back(p);
    }
    // Fits the lengths again with the rule slide: a damper shows only beside lengths that were fitted with
    // it.
    if (options_.rule != SnapRule::redraw) point = minimise(model_, point);
    candidates.push_back(point);
  };
  if (several_speeds()) {
    FitPoint lubricant = rigid;
    lubricant.free.push_back(fit_viscous);
    add(lubricant);
  }
  for (const bool both : {false, true}) {
    if (both && !several_speeds()) continue;
    FitParameterSet linear = rigid.free;
    linear.push_back(fit_damping);
    if (both) linear.push_back(fit_viscous);
    FitPoint best;
    best.sum_of_squares = std::numeric_limits<double>::infinity();
    for (const double stribeck : trial_stribeck_velocities(data_)) {
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

/// Adds a lubricant (viscous friction), a damper, or both to a fit, if they lower the residuals enough to
/// justify their parameters.
FitPoint Fitter::add_speed_terms(const FitPoint& core) {
  const std::string speeds = fmt::format("{:.3g} and {:.3g} m/s", data_.slow, data_.fast);
  for (const FitParameter p : {fit_viscous, fit_damping, fit_stribeck}) {
    const bool seen = several_speeds() || (p != fit_viscous && slow_reversals());
    why_[p] = seen                ? "not seen between " + speeds
              : both_directions() ? "one speed only each way, between " + speeds
                                  : "one speed only, between " + speeds;
  }
  if ((!several_speeds() && !slow_reversals()) || fit_stopped()) return core;
  FitPoint best = core;
  for (const FitPoint& candidate : speed_candidates(core)) {
    if (candidate.free.size() > core.free.size() && justified(candidate, best)) best = candidate;
  }
  if (best.free.size() > core.free.size()) best = minimise(model_, best);
  // Tries a lubricant once more, now beside the damper: at the first try the shape of the brush had been
  // fitted without either.
  if (several_speeds() && contains(best.free, fit_damping) && !contains(best.free, fit_viscous)) {
    FitPoint both = best;
    both.free.push_back(fit_viscous);
    both = minimise(model_, both);
    if (justified(both, best)) best = both;
  }
  for (const FitParameter p : {fit_viscous, fit_damping, fit_stribeck})
    if (contains(best.free, p)) why_[p].clear();
  return best;
}

}  // namespace cli
