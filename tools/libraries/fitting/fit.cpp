#include "tools/libraries/fitting/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <bristle/error.hpp>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/brushes.hpp"
#include "tools/libraries/fitting/least_squares.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

using bristle::SnapLaw;

// Share of the force's sum of squares that a fit has to explain. Below it the record is refused: the force is
// not friction of this motion.
constexpr double least_explained = 0.3;
// Ratio of the ends of its 95 % interval beyond which the stiffness counts as undetermined.
constexpr double widest_ratio = 7.0;
// Share of the measured force that has to be friction of the brush; a record with less is refused.
constexpr double least_friction = 0.01;
// Numbers of samples to which a record is thinned to save time: to search for a brush, and to fit the chosen
// one.
constexpr std::size_t search_samples = 2000, fit_samples = 10000;
// Largest error on held-out blocks, over the error of a simpler brush, with which a brush is preferred to the
// simpler one.
constexpr double clearly_closer = 0.97;
// Largest error on held-out blocks, over the least error of all brushes, with which a brush is fitted to the
// whole record as well.
constexpr double nearly_closest = 1.1;
// Least number of samples in the fitted blocks, and in the held-out ones, with which a fit chooses between
// kinds of brush.
constexpr std::size_t fewest_to_choose = 40;
// Number of runs of a brush along the thinned record that a fit takes, as counted on measured records; the
// time to expect follows from it.
constexpr double usual_runs = 1200.0;
// Number of times that a fit is repeated without the samples at turns of the motion. Each fit shows better
// which samples to leave out.
constexpr int most_cuts = 2;
// Ratio of the smaller to the larger of two successive moves, below which the motion counts as turning
// between them.
constexpr double turning = 0.25;

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

/// Returns the measured force (N, by the body) less the fitted offset and drift of the sensor, which are no
/// friction.
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
        "speeds, ways and forces are those at the rim of the disc; a replay moves a point as the rim moves, "
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

/// Adds to the covariance the error by chance of the mean snap length: the bristles that touch are a random
/// sample of the law. The same bristles bend in every small loop, so residuals show little of this error. A
/// fit finds the stiffness without such an error, and so a spread that makes up for a wrong length. Takes the
/// usual number of bristles, or the one that the residuals show, since friction of few bristles wanders in
/// sliding.
void Fitter::add_chance_of_bristles(Eigen::MatrixXd& cov, const FitPoint& point,
                                    const Eigen::VectorXd& residuals) const {
  constexpr double step = 0.02;
  constexpr double of_one = 0.45;  // variance of one bristle's force in sliding, over its squared mean
  constexpr double most = 2.0;     // of a narrow law the loops show the spread itself
  const double spread = point.values[fit_spread];
  const Eigen::Index pairs = residuals.size() - 1;
  const double wander = residuals.head(pairs).dot(residuals.tail(pairs)) / static_cast<double>(pairs);
  const double shown =
      of_one * std::pow(point.values[fit_kinetic] * data_.mean_load, 2) / std::max(wander, 1e-300);
  const double bristles = std::min(bristles_per_newton * data_.mean_load, shown);
  FitValues narrower = point.values;
  narrower[fit_spread] *= std::exp(-step);
  // Change of the length's logarithm over that of the spread at which the stiffness stays the same.
  const double slope =
      std::log(model_.kinetic_deflection(point.values) / model_.kinetic_deflection(narrower)) / step;
  const double of_spread = std::min(spread / std::max(slope, 1e-3), most);
  Eigen::VectorXd error = Eigen::VectorXd::Zero(cov.rows());
  for (std::size_t k = 0; k < point.free.size(); ++k) {
    double& e = error[static_cast<Eigen::Index>(k)];
    if (point.free[k] == fit_length) e = slope * of_spread;
    if (point.free[k] == fit_spread) e = -of_spread;
  }
  cov += error * error.transpose() / bristles;
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
  Eigen::MatrixXd cov = covariance(j, r, result.correlated_samples);
  if (options_.rule != bristle::SnapRule::slide) add_chance_of_bristles(cov, point, r);
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
  result.evaluations = model_.evaluations();
  return result;
}

Found Fitter::hold_undetermined(const Found& start) {
  why_ = start.why;
  notes_ = start.notes;
  const FitPoint point = minimise(model_, start.point);
  refuse_without_friction(point);
  return found(keep_determined(point));
}

Found Fitter::refine(const Found& held) {
  why_ = held.why;
  notes_ = held.notes;
  as_good_ = held.as_good;
  return found(minimise(model_, held.point));
}

FitResult Fitter::finish(const Found& refined) {
  why_ = refined.why;
  notes_ = refined.notes;
  as_good_ = refined.as_good;
  return report(refined.point);
}

namespace {

/// Fits a brush, which was found on a part of a record, to the whole record.
void fit_to_all(FittedBrush& brush, const FitData& data) {
  if (fit_stopped()) return;
  const bool free_law = brush.options.law == SnapLaw::table;
  if (free_law) brush.options.law = SnapLaw::lognormal;
  Fitter fitter(data, brush.options, Detail::search);
  brush.found = fitter.fit_again(brush.found);
  if (!free_law) return;
  brush.found = fitter.with_free_law(brush.found, brush.options.quantiles);
  brush.options.law = SnapLaw::table;
}

/// Returns the rms error (N) of a fitted brush on the fifths of a record, each predicted from the others.
double error_in_fifths(const FittedBrush& brush, const FitData& data) {
  FitModel model(data, brush.options, Detail::search);
  const Eigen::MatrixXd j = jacobian(model, brush.found.point);
  const Eigen::VectorXd left = model.force(brush.found.point.values) - measured_force(data);
  return std::sqrt(held_out_squares(j, left, data.samples()) / static_cast<double>(left.size()));
}

/// Fits the kinds of brush to half of the blocks of a record, then those whose error on the other half is
/// nearly the least to all of it. Returns the simplest of them, unless the error of another one on held-out
/// fifths is clearly less.
FittedBrush choose_brush(const FitData& thin, const FitOptions& options, Progress& progress,
                         std::string& note) {
  const std::vector<bool> fitted = fitted_blocks(thin.columns.t, {});
  const FitData train = part_of(thin, fitted), rest = part_of(thin, fitted, false);
  const bool chooses = std::min(train.samples(), rest.samples()) >= fewest_to_choose;
  std::vector<FittedBrush> brushes = fit_brushes(chooses ? train : thin, options, Detail::search,
                                                 [&](double share) { progress.update(0.7 * share); });
  int evaluations = 0;
  for (const FittedBrush& brush : brushes) evaluations += brush.found.evaluations;
  if (!chooses) {
    brushes.back().found.evaluations = evaluations;
    return brushes.back();
  }
  std::vector<double> errors;
  std::string text;
  for (const FittedBrush& brush : brushes) {
    errors.push_back(std::sqrt((force_of(brush, rest, Detail::search) - measured_force(rest)).squaredNorm() /
                               static_cast<double>(rest.force.size())));
    text += fmt::format("{}{} {:.3g}", text.empty() ? "" : ", ", brush.name, errors.back());
  }
  const double lowest = *std::min_element(errors.begin(), errors.end());
  FittedBrush* best = nullptr;
  double least = 0.0;
  for (std::size_t i = 0; i < brushes.size(); ++i) {
    if (errors[i] > nearly_closest * lowest) continue;
    fit_to_all(brushes[i], thin);
    const double error = error_in_fifths(brushes[i], thin);
    if (best != nullptr && error >= clearly_closer * least) continue;
    best = &brushes[i];
    least = error;
    progress.update(0.75);
  }
  if (brushes.size() > 1)
    note = fmt::format("{} is taken of the kinds of brush by their errors on blocks held out (N rms): {}",
                       best->name, text);
  best->found.evaluations = evaluations;
  return std::move(*best);
}

/// Returns the record without those samples at which the motion turns or rests for a single sample, and
/// without those around them that fall short of the fitted kinetic friction. Where presliding is shorter than
/// the moves between samples, friction there may be anything between its two limits, and would spoil the fit.
FitData without_turns(const FitData& data, const FitValues& fitted) {
  std::vector<double> x;
  for (const PathPoint& point : data.path)
    if (point.wanted) x.push_back(point.x);
  const std::size_t n = data.samples();
  const Eigen::VectorXd friction = friction_measured(data, fitted);
  const auto moved = [&](std::size_t i) { return x[i] - x[i - 1]; };
  std::vector<bool> turns(n, false), short_of(n, false);
  for (std::size_t i = 0; i < n; ++i) {
    const double before = i > 0 ? moved(i) : 1.0, after = i + 1 < n ? moved(i + 1) : before;
    const double least = turning * std::max(std::fabs(before), std::fabs(after));
    turns[i] = i == 0 || before * after <= 0.0 || std::min(std::fabs(before), std::fabs(after)) <= least;
    short_of[i] = std::fabs(friction[static_cast<Eigen::Index>(i)]) < fitted[fit_kinetic] * data.load[i];
  }
  std::vector<bool> left_out = turns;
  for (std::size_t i = 1; i < n; ++i)
    if (left_out[i - 1] && short_of[i]) left_out[i] = true;
  for (std::size_t i = n - 1; i > 0; --i)
    if (left_out[i] && short_of[i - 1]) left_out[i - 1] = true;
  std::vector<std::size_t> stay;
  double finest = data.finest_move;
  for (std::size_t i = 0; i < n; ++i) {
    if (left_out[i]) continue;
    stay.push_back(i);
    finest = std::min(finest, std::fabs(moved(i)));
  }
  FitData cut = with_samples(data, stay);
  cut.finest_move = finest;  // the shortest presliding length that the search tries is half of it
  return cut;
}

/// Measures how long (s) the paper's brush takes to run once along a record.
double seconds_of_a_run(const FitData& data) {
  const FitOptions plain;
  FitModel model(data, plain, Detail::search);
  FitValues values = fit_defaults;
  model.force(values);  // makes the table of the law
  values[fit_length] *= 1.1;
  const Stopwatch run;
  model.force(values);
  return run.seconds();
}

}  // namespace

FitResult fit_material(const FitData& data, const FitOptions& options) {
  try {
    Progress progress("fit", options.quiet);
    // Thins the record, in number and in long rests: fewer samples suffice to find the brush's shape.
    FitData moving = thinned(without_rests(data), fit_samples), thin = thinned(moving, search_samples);
    announce("fit", options.quiet, [&] { return usual_runs * seconds_of_a_run(thin); });
    std::string note;
    FittedBrush chosen = choose_brush(thin, options, progress, note);
    const FitData whole_thin = thin, whole_moving = moving;
    for (int pass = 0; pass < most_cuts; ++pass) {
      const FitPoint& found = chosen.found.point;
      if (contains(found.free, fit_length) || data.axes == 2 || data.reversals == 0) break;
      FitData cut = without_turns(whole_thin, found.values);
      if (2 * cut.samples() < whole_thin.samples()) break;
      thin = std::move(cut);
      moving = without_turns(whole_moving, found.values);
      // Takes the shortest presliding length from the finer record, so that both records are fitted alike.
      thin.finest_move = moving.finest_move = std::min(thin.finest_move, moving.finest_move);
      chosen = choose_brush(thin, options, progress, note);
      chosen.found.notes = {
          "presliding is shorter than the moves between samples: those around turns are left out, where "
          "friction may be anything between its limits"};
    }
    progress.update(0.85);
    int evaluations = chosen.found.evaluations;
    chosen.found = Fitter(thin, chosen.options, Detail::search).hold_undetermined(chosen.found);
    evaluations += chosen.found.evaluations;
    progress.update(0.9);
    chosen.found = Fitter(moving, chosen.options, Detail::refine).refine(chosen.found);
    evaluations += chosen.found.evaluations;
    progress.update(0.95);
    FitResult result = Fitter(moving, chosen.options, Detail::finish).finish(chosen.found);
    if (!note.empty()) result.notes.push_back(note);
    if (fit_stopped()) result.notes.push_back("stopped early: the best that was found until then");
    result.evaluations += evaluations;
    if (result.curve.size() < data.force.size()) {
      FittedBrush last = chosen;
      last.found.point.past = result.past;
      for (std::size_t p = 0; p < fit_parameters; ++p) last.found.point.values[p] = result.estimates[p].value;
      const Eigen::VectorXd curve = force_of(last, data, Detail::finish);
      result.curve.assign(curve.begin(), curve.end());
    }
    return result;
  } catch (const bristle::Error& error) {
    throw UserError(
        fmt::format("{}: the fit leaves what a material allows: {}", data.columns.name, error.what()));
  }
}

}  // namespace cli
