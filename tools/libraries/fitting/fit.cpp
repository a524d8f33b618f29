#include "tools/libraries/fitting/fit.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <bristle/error.hpp>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/brushes.hpp"
#include "tools/libraries/fitting/least_squares.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

// Share of the force's sum of squares that a fit has to explain. Below it the record is refused: the force is
// not friction of this motion.
constexpr double least_explained = 0.3;
// Ratio of the ends of its 95 % interval beyond which the stiffness counts as undetermined.
constexpr double widest_ratio = 7.0;
// Share of the measured force that has to be friction of the brush; a record with less is refused.
constexpr double least_friction = 0.01;
// Least share of the squared residuals that goes with the acceleration, with which the report asks for a
// mass.
constexpr double share_of_inertia = 0.2;

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

/// Returns whether the estimates of stiffness and peak depend on a parameter.
bool shapes_friction(FitParameter p) { return p == fit_kinetic || FitModel::bends(p); }

}  // namespace

void Fitter::refuse_without_friction(const FitPoint& point) {
  assume(model_, point);
  const double brush = point.values[fit_kinetic] * model_.elastic(point.values).norm();
  const double force = data_.force_scale * std::sqrt(static_cast<double>(samples()));
  if (brush >= least_friction * force) return;
  throw UserError(
      fmt::format("{}: {:.2g} % of the force is friction of a brush, less than {:g} %: the rest goes with "
                  "the speed, or is an offset (nothing to fit; sign, columns?)",
                  data_.columns.name, 100.0 * brush / force, 100.0 * least_friction));
}

/// Returns the reason why the record does not show the peak of friction at first loading; an empty text if it
/// shows the peak.
std::string Fitter::why_no_peak(const FitPoint& point, const FitResult& result) {
  if (data_.columns.disc) return "a disc does not show it: its rings pass their peaks one after the other";
  assume(model_, point);
  const Eigen::VectorXd& unit = model_.elastic(point.values);
  const Eigen::VectorXd friction = friction_measured(data_, point.values);
  const double elastic = point.values[fit_kinetic];
  const std::size_t n = data_.samples();
  double highest = 0.0, reached = 0.0;  // highest friction over load: measured, and fitted
  for (std::size_t i = 0; i < n; ++i) {
    if (data_.load[i] < 0.1 * data_.mean_load) continue;
    const auto length = [&](const Eigen::VectorXd& force) {
      const auto row = static_cast<Eigen::Index>(i), across = static_cast<Eigen::Index>(i + n);
      return data_.axes == 1 ? std::fabs(force[row]) : std::hypot(force[row], force[across]);
    };
    highest = std::max(highest, length(friction) / data_.load[i]);
    reached = std::max(reached, elastic * length(unit) / data_.load[i]);
  }
  const double kinetic = point.values[fit_kinetic], peak = result.peak.value;
  if (reached < kinetic + 0.9 * (peak - kinetic) - 0.02 * kinetic)
    return fmt::format("no first loading in the record: the fit rises to {:.3g} there", reached);
  if (highest < result.peak.low)
    return fmt::format("the record contradicts it: its highest is {:.3g}", highest);
  return {};
}

/// Computes the peak coefficient and the stiffness, which follow from the fitted parameters, and their
/// intervals.
void Fitter::derive(const FitPoint& point, const Eigen::MatrixXd& cov, double quantile, FitResult& result) {
  const auto moved = [&](FitParameter p, double by) {
    FitValues values = point.values;
    values[p] = FitModel::is_logarithmic(p) ? values[p] * std::exp(by) : values[p] + by;
    if (p == fit_kinetic || FitModel::bends(p))
      values[p] = std::clamp(values[p], p == fit_kinetic ? 0.0 : model_.lowest(p), model_.highest(p));
    return values;
  };
  // Differentiates the logarithm of an estimate by each parameter, by differences, in units of
  // FitModel::scale.
  const auto interval = [&](FitEstimate& estimate, const auto& function) {
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(cov.rows());
    for (std::size_t i = 0; i < point.free.size(); ++i) {
      const FitParameter p = point.free[i];
      if (!shapes_friction(p)) continue;
      const FitValues up = moved(p, 0.02), down = moved(p, -0.02);
      const double between = FitModel::is_logarithmic(p) ? std::log(up[p] / down[p])
                                                         : (up[p] - down[p]) / model_.scale(point.values, p);
      gradient[static_cast<Eigen::Index>(i)] = std::log(function(up) / function(down)) / between;
    }
    const double open = open_variance([&](const FitValues& values) { return std::log(function(values)); });
    const double width = quantile * std::sqrt(std::max(gradient.dot(cov * gradient), 0.0) + open);
    estimate.value = function(point.values);
    estimate.low = estimate.value * std::exp(-width);
    estimate.high = estimate.value * std::exp(width);
  };
  interval(result.peak,
           [&](const FitValues& p) { return make_material(p, options_, model_).peak_coefficient(); });
  interval(result.stiffness,
           [&](const FitValues& p) { return p[fit_kinetic] / model_.kinetic_deflection(p); });
  // Counts the peak as fitted if the parameters that determine it are: the kinetic coefficient and, for a law
  // that has one, the spread.
  result.peak.fitted = result.estimates[fit_kinetic].fitted &&
                       (result.estimates[fit_spread].fitted || !has_spread(options_.law));
  if (!result.peak.fitted) {
    result.peak.why = "follows from kinetic and spread";
  } else {
    result.peak.why = why_no_peak(point, result);
    result.peak.fitted = result.peak.why.empty();
  }
  result.stiffness.fitted =
      contains(point.free, fit_length) && result.stiffness.high < widest_ratio * result.stiffness.low;
  if (!result.stiffness.fitted) result.stiffness.why = "follows from presliding_length";
}

/// Adds remarks that say what the numbers of the result stand for, such as the rim of a disc.
void Fitter::note(FitResult& result) const {
  if (data_.columns.disc)
    result.notes.push_back(
        "speeds, paths and forces are those at the rim of the disc; a replay moves a point as the rim moves, "
        "which in sliding has 3/2 of the disc's torque over its radius; the disc itself is Outline::disc of "
        "the library");
  if (data_.axes == 2)
    result.notes.push_back("two axes: both forces fitted as one isotropic contact that moves in the plane");
  const FitEstimate& offset = result.estimates[fit_offset];
  if (data_.axes == 1 && data_.steady_load && offset.fitted && offset.low * offset.high > 0.0) {
    const double share = offset.value / (result.estimates[fit_kinetic].value * data_.mean_load);
    result.notes.push_back(fmt::format(
        "the force differs with the direction: an offset of the sensor of {:.3g} N, or friction over load "
        "of {:.4g} towards +x and {:.4g} towards -x; one load does not tell them apart",
        offset.value, result.estimates[fit_kinetic].value * (1.0 + share),
        result.estimates[fit_kinetic].value * (1.0 - share)));
  }
  result.notes.insert(result.notes.end(), notes_.begin(), notes_.end());
}

/// Returns how many bristles per newton the scatter of sliding friction shows, at most the usual number.
/// Where friction slides, neither an error of the position nor one of the lengths lets residuals wander.
double Fitter::bristles_shown(const FitPoint& point, const Eigen::VectorXd& residuals) {
  constexpr double of_one = 0.45;  // variance of one bristle's force in sliding, over its squared mean
  constexpr double steady = 0.03;  // change of friction over load, within which it counts as sliding
  constexpr double fewest_pairs = 20.0;
  const Eigen::VectorXd& unit = model_.elastic(point.values);
  const auto slides = [&](std::size_t i) {
    const auto x = static_cast<Eigen::Index>(i), y = static_cast<Eigen::Index>(i + data_.samples());
    const double force = data_.axes == 1 ? std::fabs(unit[x]) : std::hypot(unit[x], unit[y]);
    return std::fabs(force - data_.load[i]) < steady * data_.load[i];
  };
  double wander = 0.0, pairs = 0.0;
  for (std::size_t i = 1; i < data_.samples(); ++i) {
    if (!data_.columns.follows(i) || !slides(i) || !slides(i - 1)) continue;
    for (std::size_t k = i; k < data_.force.size(); k += data_.samples())
      wander += residuals[static_cast<Eigen::Index>(k)] * residuals[static_cast<Eigen::Index>(k) - 1];
    pairs += 1.0;
  }
  if (pairs < fewest_pairs || !(wander > 0.0)) return bristles_per_newton;
  const double shown = of_one * std::pow(point.values[fit_kinetic], 2) * data_.mean_load * pairs / wander;
  return std::min(bristles_per_newton, shown);
}

/// Returns the covariance of the parameters: the noise from sample to sample, and the chance by which the
/// bristles of this contact differ from their law, or the scatter of residuals if that is larger. The same
/// first lengths act in every loop, so that residuals show only part of the chance.
Eigen::MatrixXd Fitter::covariance_with_chance(const FitPoint& point, const Eigen::MatrixXd& j,
                                               const Eigen::VectorXd& r, double correlated) {
  const Eigen::MatrixXd shown = covariance(j, r, correlated);
  if (options_.rule == bristle::SnapRule::slide || !contains(point.free, fit_length)) return shown;
  const Eigen::Index pairs = r.size() - 1;
  const double noise = (r.tail(pairs) - r.head(pairs)).squaredNorm() / (2.0 * static_cast<double>(pairs));
  const double most_load = *std::max_element(data_.load.begin(), data_.load.end());
  Eigen::MatrixXd cov =
      noise * inverse_normal_matrix(j) +
      covariance_of_one_bristle(model_, point, j, most_load) / (bristles_shown(point, r) * most_load);
  raise_to(cov, shown);
  return cov;
}

FitResult Fitter::report(const FitPoint& point) {
  FitResult result;
  result.rule = options_.rule;
  result.law = options_.law;
  result.quantiles = options_.quantiles;
  result.past = point.past;
  assume(model_, point);
  result.material = make_material(point.values, options_, model_);
  const Eigen::VectorXd r = residuals(point);
  const Eigen::VectorXd curve = model_.force(point.values);
  result.curve.assign(curve.begin(), curve.end());
  result.residual_rms = std::sqrt(r.squaredNorm() / static_cast<double>(r.size()));
  const double squares = friction_measured(data_, point.values).squaredNorm();
  result.explained = 1.0 - r.squaredNorm() / squares;
  if (result.explained >= least_explained && point.free.empty())
    throw UserError(fmt::format("{}: the record determines no number of the material", data_.columns.name));
  if (!(result.explained >= least_explained))
    throw UserError(
        fmt::format("{}: the brush explains {:.0f} % of the force, less than {:.0f} %: this is not friction "
                    "of this motion (sign, units, columns?)",
                    data_.columns.name, 100.0 * std::max(result.explained, 0.0), 100.0 * least_explained));
  result.correlated_samples = correlated_samples(r);
  const Eigen::MatrixXd j = jacobian(model_, point);
  result.held_out_rms = std::sqrt(held_out_squares(j, r, data_.samples()) / static_cast<double>(r.size()));
  Eigen::MatrixXd cov = covariance_with_chance(point, j, r, result.correlated_samples);
  raise_to_parts(cov, j, r, data_.samples());
  const double count = static_cast<double>(samples()) / result.correlated_samples;
  const double quantile = student_quantile(count - static_cast<double>(point.free.size()));
  for (unsigned k = 0; k < fit_parameters; ++k) {
    const auto p = static_cast<FitParameter>(k);
    FitEstimate& estimate = result.estimates[k];
    estimate.value = point.values[k];
    estimate.why = why_[k];
    const auto at = std::find(point.free.begin(), point.free.end(), p);
    if (at == point.free.end()) {
      if (estimate.why.empty()) estimate.why = lacking(p);
      continue;
    }
    const auto i = static_cast<Eigen::Index>(at - point.free.begin());
    estimate.fitted = is_determined(point, j, cov, i);
    if (!estimate.fitted) {  // the thinned record promised more than the whole one shows
      estimate.why = lacking(p);
      continue;
    }
    const double scale = model_.scale(point.values, p);
    const double open = open_variance([&](const FitValues& values) {
      return FitModel::is_logarithmic(p) ? std::log(values[p]) : values[p] / scale;
    });
    const double width = quantile * std::sqrt(std::max(cov(i, i), 0.0) + open);
    if (FitModel::is_logarithmic(p)) {
      estimate.low = estimate.value * std::exp(-width);
      estimate.high = estimate.value * std::exp(width);
    } else {
      estimate.low = estimate.value - width * scale;
      estimate.high = estimate.value + width * scale;
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
  note(result);
  return result;
}

Found Fitter::hold_undetermined(const Found& start) {
  go_on(start);
  const FitPoint point = minimise(model_, start.point);
  refuse_without_friction(point);
  return found(keep_determined(point));
}

Found Fitter::refine(const Found& held) {
  go_on(held);
  return found(minimise(model_, held.point));
}

FitResult Fitter::finish(const Found& refined) {
  go_on(refined);
  return report(refined.point);
}

namespace {

/// Returns a remark if the residuals go with the acceleration, as they do where a mass between sensor and
/// contact was not given; an empty text if not.
std::string forgotten_mass(const FitData& data, const FittedBrush& brush,
                           const std::optional<FitValues>& cut) {
  if (data.axes == 2) return {};
  const FitData few = thinned(data, fit_samples);
  const Eigen::VectorXd left = measured_force(few) - force_of(brush, few, Detail::search);
  const std::vector<double> a = acceleration(few);
  const std::vector<bool> unused = cut ? around_reversals(few, *cut) : std::vector<bool>(few.samples());
  double with = 0.0, squares = 0.0, of_a = 0.0;
  for (std::size_t i = 0; i < few.samples(); ++i) {
    if (unused[i]) continue;
    const double r = left[static_cast<Eigen::Index>(i)];
    with += r * a[i];
    squares += r * r;
    of_a += a[i] * a[i];
  }
  if (!(with > 0.0) || with * with < share_of_inertia * squares * of_a) return {};
  return fmt::format(
      "{:.0f} % of the squared residuals go with the acceleration, as the inertia of {:.2g} kg does: if such "
      "a mass moves with the sensor, give it (--mass)",
      100.0 * with * with / (squares * of_a), with / of_a);
}

}  // namespace

FitResult fit_material(const FitData& data, const FitOptions& options) {
  try {
    Progress progress("fit", options.quiet);
    const auto show = [&](double share) { progress.update(share); };
    Choice choice = choose_brush(data, options, show);
    FittedBrush& chosen = choice.brush;
    progress.update(0.85);
    chosen.found = Fitter(choice.thin, chosen.options, Detail::search).hold_undetermined(chosen.found);
    progress.update(0.9);
    chosen.found = Fitter(choice.moving, chosen.options, Detail::refine).refine(chosen.found);
    progress.update(0.95);
    FitResult result = Fitter(choice.moving, chosen.options, Detail::finish).finish(chosen.found);
    FittedBrush last = chosen;
    last.found.point.past = result.past;
    for (std::size_t p = 0; p < fit_parameters; ++p) last.found.point.values[p] = result.estimates[p].value;
    if (result.curve.size() < data.force.size()) {
      const Eigen::VectorXd curve = force_of(last, data, Detail::finish);
      result.curve.assign(curve.begin(), curve.end());
    }
    if (choice.cut_by) result.left_out = around_reversals(data, *choice.cut_by);
    for (const std::string& note :
         {choice.note, options.mass > 0.0 ? "" : forgotten_mass(data, last, choice.cut_by),
          std::string(fit_stopped() ? stopped_early : "")})
      if (!note.empty()) result.notes.push_back(note);
    return result;
  } catch (const bristle::Error& error) {
    throw UserError(
        fmt::format("{}: the fit leaves what a material allows: {}", data.columns.name, error.what()));
  }
}

}  // namespace cli
