#include "tools/libraries/fitting/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <bristle/error.hpp>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/fitter.hpp"
#include "tools/libraries/fitting/least_squares.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

using bristle::SnapLaw;
using bristle::SnapRule;

// Share of the force's sum of squares that a fit must explain; below it, the force is refused as not being
// friction of this motion.
constexpr double least_explained = 0.3;
// Share of the measured force that must be friction of the brush; below it, the record is refused.
constexpr double least_friction = 0.01;
constexpr std::size_t search_samples = 2000;
// Prefers the rule slide to redraw if its error on held-out parts is below this share of redraw's.
constexpr double clearly_closer = 0.97;

bristle::Material make_material(const FitValues& p, const FitOptions& options, const FitModel& model) {
  bristle::Material m = model.unit_material(p);
  m.damper_decay = options.decay;
  m.asperity_height_deviation = 1e-6;
  m.normal_stiffness = 1.0 / (bristles_per_newton * m.asperity_height_deviation);
  m.bristle_stiffness = model.elastic_coefficient(p) / (bristles_per_newton * model.kinetic_deflection(p));
  m.speed_strengthening = p[fit_strengthening];
  m.strengthening_speed = p[fit_strengthening_speed];
  m.bristle_damping = p[fit_damping] / bristles_per_newton;
  m.viscous_friction = p[fit_viscous];
  m.stribeck_velocity = p[fit_stribeck];
  m.validate();
  return m;
}

/// Returns the measured force (N, by the body) without the fitted offset and drift of the sensor.
Eigen::VectorXd friction_measured(const FitData& data, const FitValues& p) {
  Eigen::VectorXd f(static_cast<Eigen::Index>(data.force.size()));
  const double middle = data.start() + 0.5 * data.length();
  const std::size_t n = data.samples();
  for (std::size_t i = 0; i < data.force.size(); ++i) {
    const FitParameter offset = i < n ? fit_offset : fit_offset_y, drift = i < n ? fit_drift : fit_drift_y;
    f[static_cast<Eigen::Index>(i)] = data.force[i] - p[offset] - p[drift] * (data.columns.t[i % n] - middle);
  }
  return f;
}

bool has_time(const FitValues& p) { return p[fit_ageing] > 0.0 || p[fit_strengthening] > 0.0; }

/// Returns whether a parameter affects the estimates of stiffness, peak and directional friction.
bool shapes_friction(FitParameter p) {
  return p == fit_kinetic || FitModel::bends(p) || p == fit_strengthening || p == fit_strengthening_speed ||
         p == fit_asymmetry;
}

}  // namespace

void Fitter::refuse_without_friction(const FitPoint& point) {
  assume(model_, point);
  const double brush = model_.elastic_coefficient(point.values) * model_.elastic(point.values).norm();
  const double force = data_.force_scale * std::sqrt(static_cast<double>(samples()));
  if (brush >= least_friction * force) return;
  throw UserError(
      fmt::format("{}: {:.2g} % of the force is friction of a brush, less than {:g} %: the rest goes with "
                  "the speed, or is an offset (nothing to fit; sign, columns?)",
                  data_.columns.name, 100.0 * brush / force, 100.0 * least_friction));
}

/// Explains why the record does not show the peak of friction at first loading; returns "" if it
/// does.
std::string Fitter::why_no_peak(const FitPoint& point, const FitResult& result) {
  if (data_.columns.disc) return "a disc does not show it: its rings pass their peaks one after the other";
  assume(model_, point);
  const Eigen::VectorXd& unit = model_.elastic(point.values);
  const Eigen::VectorXd friction = friction_measured(data_, point.values);
  const double elastic = model_.elastic_coefficient(point.values);
  const std::size_t n = data_.samples();
  double highest = 0.0, reached = 0.0;  // highest friction over load: measured, and of the
                                        // fit
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

/// Computes peak coefficient and stiffness, with intervals, from the fitted parameters.
void Fitter::derive(const FitPoint& point, const Eigen::MatrixXd& cov, double quantile, FitResult& result) {
  const auto moved = [&](FitParameter p, double by) {
    FitValues values = point.values;
    values[p] = FitModel::is_logarithmic(p) ? values[p] * std::exp(by) : values[p] + by;
    if (p == fit_kinetic || FitModel::bends(p))
      values[p] = std::clamp(values[p], p == fit_kinetic ? 0.0 : model_.lowest(p), model_.highest(p));
    return values;
  };
  // Differentiates the log of an estimate by the parameters, by differences in units of FitModel::scale.
  const auto interval = [&](FitEstimate& estimate, const auto& function) {
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(cov.rows());
    for (std::size_t i = 0; i < point.free.size(); ++i) {
      const FitParameter p = point.free[i];
      if (!shapes_friction(p)) continue;
      const double step = p == fit_ageing || p == fit_strengthening ? 0.1 * point.values[p] : 0.02;
      const FitValues up = moved(p, step), down = moved(p, -step);
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
  interval(result.peak, [&](const FitValues& p) {
    const bristle::Material m = make_material(p, options_, model_);
    return p[fit_ageing] > 0.0 ? m.peak_coefficient(point.frame.age) : m.peak_coefficient();
  });
  interval(result.stiffness,
           [&](const FitValues& p) { return model_.elastic_coefficient(p) / model_.kinetic_deflection(p); });
  interval(result.forward, [&](const FitValues& p) { return p[fit_kinetic] * (1.0 + p[fit_asymmetry]); });
  interval(result.backward, [&](const FitValues& p) { return p[fit_kinetic] * (1.0 - p[fit_asymmetry]); });
  // Counts the peak as fitted if the kinetic coefficient and, unless the law has none, the spread are.
  result.peak.fitted =
      contains(point.free, fit_kinetic) && (contains(point.free, fit_spread) || !has_spread(options_.law));
  if (!result.peak.fitted) {
    result.peak.why = "follows from kinetic and spread";
  } else {
    result.peak.why = why_no_peak(point, result);
    result.peak.fitted = result.peak.why.empty();
  }
  for (FitEstimate* way : {&result.forward, &result.backward}) {
    way->fitted = contains(point.free, fit_asymmetry) && contains(point.free, fit_kinetic);
    if (!way->fitted) way->why = "kinetic, as far as the data tell";
  }
  result.stiffness.fitted = contains(point.free, fit_length);
  if (!result.stiffness.fitted) result.stiffness.why = "follows from presliding_length";
}

/// Adds remarks to the result: the speed, age and direction for which its numbers hold.
void Fitter::note(const FitPoint& point, FitResult& result) const {
  const FitFrame& frame = result.frame;
  if (frame.speed > 0.0)
    result.notes.push_back(
        fmt::format("kinetic is the dry friction in sliding at {:.3g} mm/s", 1e3 * frame.speed));
  if (point.values[fit_ageing] > 0.0) {
    result.notes.push_back(fmt::format(
        "presliding length and peak are those of bristles that have held for {:.3g} s", frame.age));
    const bool logarithmic = frame.form == bristle::AgeingForm::logarithmic;
    result.notes.push_back(fmt::format(
        "ageing is {}{}",
        logarithmic ? "logarithmic: growth per e-fold of time" : "saturating: growth in all",
        frame.form_assumed ? "; this form is assumed, the data do not tell it from the other" : ""));
    if (point.past.rested > 0.0)
      result.notes.push_back(
          fmt::format("the contact had rested for some {:.3g} s before the first sample", point.past.rested));
  }
  if (!stage_note_.empty() && (contains(point.free, fit_delay) || contains(point.free, fit_compliance)))
    result.notes.push_back(stage_note_);
  if (point.values[fit_delay] > 0.0)
    result.notes.push_back(
        "the delay is that of a first-order low-pass; a dead time of the same length looks much like it");
  if (bends_stage(point.values))
    result.notes.push_back(
        "the presliding length is the bristles' own; a replay moves the contact by the measured position, "
        "without the stage's bending");
  if (data_.columns.disc)
    result.notes.push_back(
        "speeds, ways and forces are those at the rim of the disc; a replay moves a point as the rim moves, "
        "which in sliding has 3/2 of the disc's torque over its radius; the disc itself is Outline::disc of "
        "the library");
  if (data_.axes == 2)
    result.notes.push_back("two axes: both forces fitted as one isotropic contact that moves in the plane");
  const FitEstimate& offset = result.estimates[fit_offset];
  if (data_.axes == 1 && offset.fitted && !several_loads() && offset.low * offset.high > 0.0) {
    const double share = offset.value / (result.estimates[fit_kinetic].value * data_.mean_load);
    result.notes.push_back(fmt::format(
        "the force differs with the direction: an offset of the sensor of {:.3g} N, or friction over load "
        "of {:.4g} towards +x and {:.4g} towards -x; one load does not tell them apart",
        offset.value, result.estimates[fit_kinetic].value * (1.0 + share),
        result.estimates[fit_kinetic].value * (1.0 - share)));
  }
  if (contains(point.free, fit_asymmetry))
    result.notes.push_back("a bristle has no direction: the material has the mean friction of both");
}

FitResult Fitter::report(const FitPoint& point) {
  FitResult result;
  result.rule = options_.rule;
  result.law = options_.law;
  result.quantiles = options_.quantiles;
  result.past = point.past;
  result.frame = has_time(point.values) ? point.frame : FitFrame{};
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
  const PopulationError population = bristle_error(point, j, r);
  result.fluctuating_bristles =
      population.seen ? population.bristles / data_.mean_load : std::numeric_limits<double>::infinity();
  Eigen::MatrixXd cov = covariance(j, r, result.correlated_samples, population);
  raise_to_parts(cov, j, r, data_.samples());
  const Eigen::MatrixXd scaled = j * j.colwise().norm().cwiseInverse().asDiagonal();
  const Eigen::VectorXd singular = singular_values(scaled);
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
    if (p == fit_residual || p == fit_renewal || p == fit_ageing || p == fit_strengthening)
      estimate.low = std::max(estimate.low, 0.0);
    if (p == fit_residual) estimate.high = std::min(estimate.high, 1.0);
  }
  FitEstimate& length = result.estimates[fit_length];
  if (length.fitted && !contains(point.free, fit_kinetic)) {
    length.fitted = false;
    length.why = "what the stiffness asks for with this kinetic coefficient";
  }
  derive(point, cov, quantile, result);
  note(point, result);
  result.evaluations = model_.evaluations();
  return result;
}

namespace {

/// Returns the fitted force (N, by the body) at all samples of a record.
std::vector<double> curve_at(const FitData& data, const FitOptions& options, const FitResult& result) {
  FitModel model(data, options, Detail::finish);
  model.set_past(result.past);
  model.set_frame(result.frame);
  FitValues values{};
  for (std::size_t p = 0; p < fit_parameters; ++p) values[p] = result.estimates[p].value;
  model.settle_stage(values);
  const Eigen::VectorXd curve = model.force(values);
  return {curve.begin(), curve.end()};
}

}  // namespace

namespace {

/// Returns the options of a fit with the given snap rule. Throws UserError where they contradict the rule.
FitOptions with_rule(const FitData& data, const FitOptions& options, SnapRule rule) {
  FitOptions held = options;
  held.rule = rule;
  if (options.law == SnapLaw::single)
    throw UserError("--law: allowed are lognormal, normal, uniform, exponential, free");
  if (options.law == SnapLaw::table && (rule != SnapRule::slide || data.axes == 2))
    throw UserError(data.columns.name + ": --law free is for --rule slide, and for one axis");
  if (rule == SnapRule::redraw) return held;
  if (options.residual.value_or(0.0) != 0.0 || options.renewal.value_or(0.0) != 0.0)
    throw UserError("--residual and --renewal: other values than 0 need --rule redraw");
  held.residual = held.renewal = 0.0;
  if (data.axes == 2 && rule == SnapRule::keep)
    throw UserError(
        data.columns.name +
        ": two axes (x, y, fx, fy) need --rule redraw or slide; for --rule keep leave out y and fy");
  return held;
}

/// Fits with the rules redraw and slide. Returns options and fitted point of the one that predicts better.
std::pair<FitOptions, Found> search_rules(const FitData& data, const FitData& thin, const FitOptions& options,
                                          Progress& progress, std::string& note) {
  const bool free_law = options.law == SnapLaw::table;
  const SnapRule first = options.choose_rule && free_law ? SnapRule::slide : options.rule;
  FitOptions held = with_rule(data, options, first);
  if (free_law) held.law = SnapLaw::lognormal;  // starts the free law from a lognormal one
  Found found = Fitter(thin, held, Detail::search, progress).search();
  if (!options.choose_rule || free_law || options.residual || options.renewal) return {held, found};
  const FitOptions other = with_rule(data, options, SnapRule::slide);
  Found slid = Fitter(thin, other, Detail::search, progress).search();
  // Chooses the rule slide more readily if redraw fits best near its largest residual length: bristles that
  // hardly spring back nearly slide.
  const bool nearly_slides = found.point.values[fit_residual] > 0.9 * widest_residual;
  const bool slides =
      slid.held_out < (nearly_slides ? 1.0 / clearly_closer : clearly_closer) * found.held_out;
  note = fmt::format("rule {} is chosen: where not fitted, redraw leaves {:.3g} N rms and slide {:.3g} N",
                     slides ? "slide" : "redraw", found.held_out, slid.held_out);
  Found& chosen = slides ? slid : found;
  chosen.evaluations = found.evaluations + slid.evaluations;
  return {slides ? other : held, chosen};
}

}  // namespace

FitResult fit_material(const FitData& data, const FitOptions& options) {
  try {
    Progress progress("fit", options.quiet);
    // Searches on a record thinned in number and in long rests, which is enough to find the brush's shape.
    const FitData whole = options.for_prediction ? data : without_rests(data);
    const FitData moving =
        options.rule == SnapRule::keep && !options.for_prediction ? without_origin(whole) : whole;
    const FitData thin = thinned(moving, search_samples);
    std::string note;
    auto [held, found] = search_rules(data, thin, options, progress, note);
    progress.update(0.9);
    const int searched = found.evaluations;
    if (options.law == SnapLaw::table) {
      found = Fitter(moving, held, Detail::finish, progress).with_free_law(found, held.quantiles);
      held.law = SnapLaw::table;
    }
    FitResult result = Fitter(moving, held, Detail::finish, progress).finish(found);
    if (!note.empty()) result.notes.push_back(note);
    result.evaluations += searched;
    if (moving.samples() < data.samples()) result.curve = curve_at(data, held, result);
    return result;
  } catch (const bristle::Error& error) {
    throw UserError(
        fmt::format("{}: the fit leaves what a material allows: {}", data.columns.name, error.what()));
  }
}

}  // namespace cli
