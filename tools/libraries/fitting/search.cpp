// Searches starting points of a fit and minimises the residuals from them.
#include "tools/libraries/fitting/fitter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/least_squares.hpp"

namespace cli {
namespace {

using bristle::SnapLaw;
using bristle::SnapRule;

// Share of the travel that must lead backwards for a record to determine the sensor's offset.
constexpr double least_back = 0.02;

/// Returns the share of the travelled distance in the less travelled direction; in the plane, the share that
/// does not lead away from the start.
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

bool rubs(const FitParameterSet& set) { return contains(set, fit_residual) || contains(set, fit_renewal); }

/// Returns the lowest local minima, at most `most`, in a row of points ordered by length.
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

}  // namespace

bool Fitter::two_ways() const { return data_.reversals > 0 && share_back(data_.path) > least_back; }

FitParameterSet Fitter::linear_set() const {
  FitParameterSet linear{fit_kinetic};
  if (!two_ways()) return linear;
  linear.push_back(fit_offset);
  if (data_.axes == 2) linear.push_back(fit_offset_y);
  if (options_.no_drift) return linear;
  linear.push_back(fit_drift);
  if (data_.axes == 2) linear.push_back(fit_drift_y);
  return linear;
}

/// Makes a starting point of a fit: shape parameters (length, spread, rubbing, Stribeck velocity) from
/// `bent`, the others, in which the force is linear, from least squares.
FitPoint Fitter::linear_start(const FitValues& bent, const FitParameterSet& linear) {
  FitPoint point;
  point.past = model_.past();
  point.frame = model_.frame();
  for (const FitParameter p :
       {fit_length, fit_spread, fit_residual, fit_renewal, fit_ageing, fit_ageing_time,
        fit_strengthening_speed, fit_stribeck, fit_compliance, fit_softening, fit_delay}) {
    point.values[p] = bent[p];
  }
  point.values[fit_kinetic] = 1.0;  // at this value, the derivative is the force for a coefficient of
                                    // 1
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

/// Searches a grid of presliding lengths and shapes (spread; rubbing, that is residual and renewal), with the
/// linear parameters from least squares. From the best lengths, Levenberg-Marquardt refines the linear
/// parameters and those in `bending`.
FitPoint Fitter::search_with(const std::vector<FitValues>& shapes, const FitParameterSet& bending,
                             double progress) {
  FitParameterSet linear = linear_set();
  FitParameterSet free = linear;
  free.insert(free.end(), bending.begin(), bending.end());
  // Fits no lubricant to a record of a single speed, which cannot tell it from the brush.
  if (several_speeds()) linear.push_back(fit_viscous);

  std::vector<FitPoint> best_of_length, best_of_shape(shapes.size());
  std::vector<std::vector<FitPoint>> of_shapes(shapes.size());
  for (FitPoint& point : best_of_shape) point.values[fit_kinetic] = 0.0;
  const double low = model_.lowest(fit_length), high = model_.highest(fit_length);
  // Uses a finer grid of lengths for kept snap lengths, whose force has waves: many narrow minima.
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
    // Leaves out a length at which no shape gives positive friction.
    if (best.sum_of_squares < std::numeric_limits<double>::infinity()) best_of_length.push_back(best);
  }
  std::vector<FitPoint> starts = valleys(best_of_length, 3);
  // Starts from every shape of the grid: a wide law fits fairly at all lengths and would hide a narrow one.
  if (keep) {
    starts.clear();
    for (const std::vector<FitPoint>& of_shape : of_shapes) {
      const std::vector<FitPoint> lowest = valleys(of_shape, 2);
      starts.insert(starts.end(), lowest.begin(), lowest.end());
    }
  }
  if (rubs(bending)) {  // starts from the best shapes, each at its best length: shapes matter more than
                        // further lengths
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

/// Lists shapes from which a fit of rubbing (residual and renewal) starts; values that options fix are kept.
/// Empty if options fix both.
std::vector<FitValues> Fitter::rubbed_shapes() const {
  std::vector<FitValues> shapes;
  if (options_.residual && options_.renewal) return shapes;
  constexpr double tried[][2] = {{0.1, 1.0}, {0.4, 0.3}, {0.4, 3.0}, {0.7, 1.0}};
  for (const auto& [residual, renewal] : tried) {
    FitValues shape = fit_defaults;
    shape[fit_spread] = options_.law == SnapLaw::exponential ? 1.0 : 0.4;
    shape[fit_residual] = options_.residual.value_or(residual);
    shape[fit_renewal] = options_.renewal.value_or(renewal);
    hold_stage(shape);
    const bool there = std::any_of(shapes.begin(), shapes.end(), [&](const FitValues& other) {
      return other[fit_residual] == shape[fit_residual] && other[fit_renewal] == shape[fit_renewal];
    });
    if (!there) shapes.push_back(shape);
  }
  return shapes;
}

/// Searches with the paper's brush, or with the rubbing (residual and renewal) that options fix.
FitPoint Fitter::search_plain() {
  std::vector<FitValues> shapes;
  const std::vector<double> spreads = options_.rule == SnapRule::keep
                                          ? std::vector<double>{0.12, 0.25, 0.5, 1.0}
                                      : options_.rule == SnapRule::slide ? std::vector<double>{0.15, 0.5, 1.5}
                                                                         : std::vector<double>{0.2, 0.5};
  for (const double spread : spreads) {
    FitValues shape = fit_defaults;
    shape[fit_spread] = options_.law == SnapLaw::exponential ? 1.0 : spread;
    shape[fit_residual] = options_.residual.value_or(0.0);
    shape[fit_renewal] = options_.renewal.value_or(0.0);
    hold_stage(shape);
    shapes.push_back(shape);
    if (options_.law == SnapLaw::exponential) break;
  }
  if (options_.rule != SnapRule::keep) return search_with(shapes, bending(), 0.0);
  const FitPoint forgotten = search_with(shapes, bending(), 0.0);
  if (forgotten.free.empty()) return forgotten;
  const FitPoint whole = search_whole_memory(forgotten);
  return better(whole, forgotten) ? whole : forgotten;
}

/// Searches a fine grid of presliding lengths for bristles that never forget their phases, about the best fit
/// with fading memory. A relative error e of the length puts phases off by a length in 1/e lengths.
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
      if (has_spread(options_.law))
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

/// Refines a fit with kept snap lengths, whose sum of squares has waves that stop Levenberg-Marquardt: tries
/// a grid of lengths and spreads about the point, then ever smaller steps from the best. All other parameters
/// are linear.
FitPoint Fitter::polish(const FitPoint& point) {
  FitParameterSet linear;
  for (const FitParameter p : point.free) {
    if (p == fit_asymmetry) return point;
    if (p == fit_compliance || p == fit_delay) return point;
    if (!FitModel::bends(p) && p != fit_stribeck && p != fit_strengthening_speed) linear.push_back(p);
  }
  if (!contains(point.free, fit_length) || !contains(linear, fit_kinetic)) return point;
  const bool spreads = contains(point.free, fit_spread);
  assume(model_, point);
  FitPoint best = point;
  const auto try_at = [&](const FitPoint& about, double log_length, double log_spread) {
    FitValues bent = about.values;
    bent[fit_length] = std::clamp(bent[fit_length] * std::exp(log_length), model_.lowest(fit_length),
                                  model_.highest(fit_length));
    if (spreads)
      bent[fit_spread] = std::clamp(bent[fit_spread] * std::exp(log_spread), model_.lowest(fit_spread),
                                    0.99 * model_.highest(fit_spread));
    FitPoint other = linear_start(bent, linear);
    other.free = point.free;
    if (other.values[fit_kinetic] > 0.0 && other.values[fit_strengthening] >= 0.0 && better(other, best))
      best = other;
  };
  for (int i = -2; i <= 2; ++i)
    for (int k = spreads ? -4 : 0; k <= (spreads ? 4 : 0); ++k) try_at(point, 0.004 * i, 0.05 * k);
  for (double part = 1.0; part > 0.03;) {
    const FitPoint from = best;
    for (const double sign : {-1.0, 1.0}) {
      try_at(from, 0.003 * part * sign, 0.0);
      if (spreads) try_at(from, 0.0, 0.04 * part * sign);
    }
    if (!better(best, from)) part *= 0.5;
  }
  return best;
}

/// Returns whether one more parameter, at one of some values, promises half the gain that would justify it,
/// by linear theory about the point without it; the minimum may gain more. The stage is deflected by the
/// fitted force, since noise of the measured force would hide a compliance.
bool Fitter::promises(const FitPoint& core, const std::vector<FitValues>& with) {
  if (with.empty()) return false;
  assume(model_, core);
  const Eigen::VectorXd stage_force = model_.stage_force();
  model_.set_stage_force(model_.force_on_stage(core.values));
  const Eigen::VectorXd without = model_.force(core.values);
  const Eigen::VectorXd left = Eigen::Map<const Eigen::VectorXd>(data_.force.data(), samples()) - without;
  const Eigen::MatrixXd j = jacobian(model_, core);
  const bool promised = std::any_of(with.begin(), with.end(), [&](const FitValues& values) {
    Eigen::MatrixXd columns(j.rows(), j.cols() + 1);
    columns << j, model_.force(values) - without;
    const Projection found = project(columns, left);
    const double count = static_cast<double>(samples()) / correlated_samples(found.left);
    const double gain = count * std::log(core.sum_of_squares / std::max(found.left.squaredNorm(), 1e-300));
    return found.coefficients[j.cols()] > 0.0 && gain > 0.5 * price(1, count);
  });
  model_.set_stage_force(stage_force);
  return promised;
}

bool Fitter::promises_rubbing(const FitPoint& core) {
  std::vector<FitValues> with;
  const auto add = [&](double residual, double renewal) {
    FitValues values = core.values;
    values[fit_residual] = options_.residual.value_or(residual);
    values[fit_renewal] = options_.renewal.value_or(renewal);
    if (values != core.values) with.push_back(values);
  };
  add(0.1, 0.0);
  add(0.0, 0.3);
  for (const FitValues& shape : rubbed_shapes()) add(shape[fit_residual], shape[fit_renewal]);
  return promises(core, with);
}

/// Searches with rubbing (residual and renewal) as free parameters. Returns a point without free parameters
/// if options fix both.
FitPoint Fitter::search_rubbed() {
  if (options_.residual && options_.renewal) return {};
  FitParameterSet free = bending();
  if (!options_.residual) free.push_back(fit_residual);
  if (!options_.renewal) free.push_back(fit_renewal);
  return search_with(rubbed_shapes(), free, 0.4);
}

/// Adds rubbing (residual and renewal) to a complete fit without it: a search for rubbing before damper and
/// lubricant may end where these cannot be added.
FitPoint Fitter::made_to_rub(const FitPoint& plain) {
  FitPoint best = plain;
  for (const double residual : {0.0, 0.2}) {
    FitPoint point = plain;
    const auto release = [&](FitParameter p, double value) {
      point.values[p] = value;
      point.free.push_back(p);
    };
    if (!options_.renewal) release(fit_renewal, 1.0);
    if (!options_.residual && residual > 0.0) release(fit_residual, residual);
    if (point.free.size() == plain.free.size()) continue;
    point = bends_stage(point.values) ? minimise_bent(point) : minimise(model_, point);
    if (justified(point, best)) best = point;
  }
  return best;
}

/// Chooses between a brush without and one with rubbing (residual and renewal), after all other terms that
/// the data show were added to both. Rubbing must lower the residuals enough to justify its parameters.
FitPoint Fitter::choose() {
  struct Brush {
    FitPoint core, whole;
    std::array<std::string, fit_parameters> why;
    std::string stage_note;
  };
  const auto completed = [&](const FitPoint& found, double progress) {
    Brush brush{found, found, {}, {}};
    if (found.free.empty()) return brush;
    why_ = {};
    stage_note_.clear();
    brush.core = add_stage_terms(try_starts(found));
    progress_.update(progress);
    brush.whole = add_speed_terms(brush.core);
    brush.why = why_;
    brush.stage_note = stage_note_;
    return brush;
  };
  Brush of_plain = completed(search_plain(), 0.40), of_rubbed;
  const bool has_more = of_plain.whole.free.size() > of_plain.core.free.size();
  if (of_plain.core.free.empty() || promises_rubbing(of_plain.core) ||
      (has_more && promises_rubbing(of_plain.whole)))
    of_rubbed = completed(search_rubbed(), 0.75);
  if (of_plain.core.free.empty() && of_rubbed.core.free.empty())
    throw UserError(fmt::format("{}: the force never opposes the motion as friction does: nothing to fit",
                                data_.columns.name));
  if (!of_plain.whole.free.empty() && !of_rubbed.whole.free.empty()) {
    const FitPoint point = made_to_rub(of_plain.whole);
    const double count = samples_that_count(point);
    if (point.free.size() > of_plain.whole.free.size() &&
        criterion(point, count) < criterion(of_rubbed.whole, count)) {
      of_rubbed = {made_to_rub(of_plain.core), point, of_plain.why, of_plain.stage_note};
    }
  }
  const auto prefers_rubbed = [&] {
    if (of_plain.whole.free.empty() || of_rubbed.whole.free.empty()) return of_plain.whole.free.empty();
    return justified(of_rubbed.whole, of_plain.whole);
  };
  const auto with_time_terms = [&](Brush& brush) {
    if (brush.whole.free.empty()) return false;
    why_ = brush.why;
    const FitPoint point = add_time_terms(brush.core, brush.whole);
    const bool more = contains(point.free, fit_ageing) || contains(point.free, fit_strengthening);
    brush.whole = point;
    brush.why = why_;
    return more;
  };
  bool takes_rubbed = prefers_rubbed();
  if (with_time_terms(takes_rubbed ? of_rubbed : of_plain)) {
    progress_.update(0.82);
    with_time_terms(takes_rubbed ? of_plain : of_rubbed);
    takes_rubbed = prefers_rubbed();
  }
  why_ = takes_rubbed ? of_rubbed.why : of_plain.why;
  stage_note_ = takes_rubbed ? of_rubbed.stage_note : of_plain.stage_note;
  for (const FitParameter p : {fit_residual, fit_renewal}) {
    const bool held = p == fit_residual ? options_.residual.has_value() : options_.renewal.has_value();
    if (held)
      why_[p] = options_.rule == SnapRule::redraw ? "held" : "with this rule there is none";
    else if (!takes_rubbed)
      why_[p] = "not seen: it does not pay for itself";
  }
  return add_asymmetry(takes_rubbed ? of_rubbed.whole : of_plain.whole);
}

/// Chooses the brush's state at the first sample: straight bristles, unless the data say clearly that the
/// body was already sliding.
FitPoint Fitter::try_starts(FitPoint best) {
  const FitPoint straight = best;
  for (const StartState start : {StartState::forward, StartState::backward}) {
    FitPoint from = straight;
    from.past.start = start;
    // Skips a state at the first sample that contradicts the first stroke.
    if (residuals(from).squaredNorm() > 1.1 * straight.sum_of_squares) continue;
    const FitPoint point = minimise(model_, from);
    const double count = samples_that_count(point);
    const double gain = count * std::log(straight.sum_of_squares / std::max(point.sum_of_squares, 1e-300));
    if (gain > 10.0 && point.sum_of_squares < best.sum_of_squares) best = point;
  }
  return try_later_starts(best);
}

/// Chooses the starting state of each later record with all parameters fixed, then fits everything again.
FitPoint Fitter::try_later_starts(FitPoint point) {
  if (data_.columns.parts.empty()) return point;
  bool changed = false;
  point.past.later.assign(data_.columns.parts.size(), StartState::straight);
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

/// Returns candidates that add lubricant (viscous friction), damper, or both to the brush of `core`. With the
/// rules redraw and keep, the brush's shape stays fixed, so that it need not be stepped again.
std::vector<FitPoint> Fitter::speed_candidates(const FitPoint& core) {
  const FitParameterSet all = core.free;
  FitPoint rigid = core;
  for (const FitParameter p :
       {fit_length, fit_spread, fit_residual, fit_renewal, fit_compliance, fit_softening, fit_delay})
    take_out(rigid.free, p);
  std::vector<FitPoint> candidates;
  const auto add = [&](const FitPoint& start) {
    FitPoint point = minimise(model_, start);
    for (const FitParameter p : all) {
      if (!contains(point.free, p)) point.free.push_back(p);
    }
    // Fits the lengths anew with the rule slide, which shows a damper only with lengths fitted beside it.
    if (options_.rule == SnapRule::slide) point = minimise_all(point);
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

/// Adds lubricant (viscous friction), damper, or both to a fit where they lower the residuals enough to
/// justify their parameters.
FitPoint Fitter::add_speed_terms(const FitPoint& core) {
  const std::string speeds = fmt::format("{:.3g} and {:.3g} m/s", data_.slow, data_.fast);
  for (const FitParameter p : {fit_viscous, fit_damping, fit_stribeck}) {
    const bool seen = several_speeds() || (p != fit_viscous && slow_turns());
    why_[p] = seen         ? "not seen between " + speeds
              : two_ways() ? "one speed only each way, between " + speeds
                           : "one speed only, between " + speeds;
  }
  if (!several_speeds() && !slow_turns()) return core;
  FitPoint best = core;
  for (const FitPoint& candidate : speed_candidates(core)) {
    if (candidate.values[fit_viscous] < 0.0 || candidate.values[fit_damping] < 0.0) continue;
    if (justified(candidate, best)) best = candidate;
  }
  if (best.free.size() > core.free.size()) best = minimise(model_, best);
  for (const FitParameter p : {fit_viscous, fit_damping, fit_stribeck})
    if (contains(best.free, p)) why_[p].clear();
  return best;
}

}  // namespace cli
