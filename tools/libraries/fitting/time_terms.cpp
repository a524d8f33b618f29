// Fits ageing and strengthening with speed where a record shows them, and friction that differs with the
// direction of motion.
#include "tools/libraries/fitting/fitter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace cli {
namespace {

constexpr std::size_t most_starts = 3;
constexpr double rest_samples = 10.0;  // number of samples at one place that count as a rest

// Gain in twice the log likelihood that decides between two forms of a term; 4 would do if the finite number
// of bristles caused no scatter.
constexpr double told_apart = 12.0;
constexpr int tried_times = 4, tried_speeds = 5;

/// Returns a number of one significant digit near the geometric mean of two numbers.
double middle_of(double low, double high) {
  const double middle = std::sqrt(low * high);
  const double ten = std::pow(10.0, std::floor(std::log10(middle)));
  return ten * std::max(std::round(middle / ten), 1.0);
}

double between(double low, double high, double share) { return low * std::pow(high / low, share); }

bool has_time_terms(const FitPoint& point) {
  return contains(point.free, fit_ageing) || contains(point.free, fit_strengthening);
}

}  // namespace

FitFrame Fitter::time_frame(const FitPoint& core) const {
  FitFrame frame;
  const double length = core.values[fit_length];
  frame.speed = middle_of(data_.slow, data_.fast);
  frame.age = std::pow(10.0, std::round(std::log10(length / frame.speed)));
  frame.shortest_age = length / data_.fast;
  frame.longest_age = std::max(data_.longest_rest, length / data_.slow);
  return frame;
}

/// Returns starting points with the likeliest combinations of ageing, strengthening and lubricant, each at
/// its best time and speed by linear theory about the brush without them. Leaves out combinations whose gain
/// would not justify their parameters.
std::vector<FitPoint> Fitter::time_starts(const FitPoint& core, const FitPoint& base) {
  FitPoint about = core;
  about.frame = time_frame(core);
  assume(model_, about);
  const Eigen::VectorXd r = -residuals(about);
  const Eigen::MatrixXd j = jacobian(model_, about);
  const auto column_at = [&](FitParameter p, FitParameter scale, double value) {
    FitValues values = about.values;
    values[scale] = value;
    return model_.derivative(values, p);
  };
  struct Scaled {
    double scale;
    std::optional<Eigen::VectorXd> column;  // derivative of the force by the parameter; unset: term left
                                            // out
  };
  std::vector<Scaled> ageing{{0.0, {}}}, strengthening{{0.0, {}}}, lubricant{{0.0, {}}};
  if (options_.rule == bristle::SnapRule::redraw) {
    for (int i = 0; i < tried_times; ++i) {
      const double time =
          between(model_.lowest(fit_ageing_time), model_.highest(fit_ageing_time), (i + 0.3) / tried_times);
      ageing.push_back({time, column_at(fit_ageing, fit_ageing_time, time)});
    }
  }
  if (several_speeds()) {
    for (int i = 0; i < tried_speeds; ++i) {
      const double speed = between(model_.lowest(fit_strengthening_speed),
                                   model_.highest(fit_strengthening_speed), (i + 0.5) / tried_speeds);
      strengthening.push_back({speed, column_at(fit_strengthening, fit_strengthening_speed, speed)});
    }
    lubricant.push_back({0.0, model_.derivative(about.values, fit_viscous)});
  }
  const double base_count = samples_that_count(base);
  std::array<FitPoint, 8> best;
  std::array<double, 8> promise;
  promise.fill(0.0);
  for (const Scaled& a : ageing) {
    for (const Scaled& s : strengthening) {
      for (const Scaled& l : lubricant) {
        if (!a.column && !s.column) continue;
        Eigen::MatrixXd columns = j;
        FitPoint point = about;
        std::vector<FitParameter> added;
        const auto add = [&](const Scaled& term, FitParameter p) {
          if (!term.column) return;
          columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
          columns.rightCols(1) = *term.column;
          added.push_back(p);
        };
        add(a, fit_ageing);
        add(s, fit_strengthening);
        add(l, fit_viscous);
        const Projection found = project(columns, r);
        bool positive = true;
        for (std::size_t i = 0; i < added.size(); ++i) {
          const double value = found.coefficients[j.cols() + static_cast<Eigen::Index>(i)];
          positive = positive && value > 0.0;
          point.values[added[i]] = value * model_.scale(about.values, added[i]);
          point.free.push_back(added[i]);
        }
        if (!positive) continue;
        if (a.column) {
          point.values[fit_ageing] = std::clamp(point.values[fit_ageing], 0.003, 0.05);
          point.values[fit_ageing_time] = a.scale;
          point.free.push_back(fit_ageing_time);
        }
        if (s.column) {
          point.values[fit_strengthening_speed] = s.scale;
          point.free.push_back(fit_strengthening_speed);
        }
        // Demands of linear theory only half of the gain that justifies a combination's parameters, because
        // it underestimates some gains.
        const double count = static_cast<double>(samples()) / correlated_samples(found.left);
        const double most = std::max(count, base_count);
        const double gain =
            count * std::log(base.sum_of_squares / std::max(found.left.squaredNorm(), 1e-300)) -
            0.5 * (price(point.free.size(), most) - price(base.free.size(), most));
        const std::size_t kind = (a.column ? 4u : 0u) + (s.column ? 2u : 0u) + (l.column ? 1u : 0u);
        if (gain <= promise[kind]) continue;
        promise[kind] = gain;
        best[kind] = point;
      }
    }
  }
  std::vector<std::size_t> order;
  for (std::size_t kind = 0; kind < best.size(); ++kind)
    if (promise[kind] > 0.0) order.push_back(kind);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return promise[a] > promise[b]; });
  if (order.size() > most_starts) order.resize(most_starts);
  std::vector<FitPoint> starts;
  for (const std::size_t kind : order) starts.push_back(best[kind]);
  return starts;
}

/// Tries rest times of 0.1 to 1e5 s before a record whose bristles age and start straight. Keeps the best one
/// if it fits clearly better.
FitPoint Fitter::try_rests(FitPoint point) {
  if (!contains(point.free, fit_ageing) || point.past.start != StartState::straight) return point;
  FitPoint best = point;
  for (const double rested : {0.1, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5}) {
    FitPoint other = point;
    other.past.rested = rested;
    other.sum_of_squares = residuals(other).squaredNorm();
    if (better(other, best)) best = other;
  }
  if (best.past == point.past) return point;
  best = minimise(model_, best);
  const double gain = samples_that_count(best) * std::log(point.sum_of_squares / best.sum_of_squares);
  return gain > 10.0 ? best : point;
}

/// Replaces logarithmic by saturating ageing if that fits clearly better.
FitPoint Fitter::try_saturating(FitPoint point) {
  if (!contains(point.free, fit_ageing)) return point;
  FitPoint best;
  best.sum_of_squares = std::numeric_limits<double>::infinity();
  for (const double share : {0.5, 0.75}) {
    FitPoint other = point;
    other.frame.form = bristle::AgeingForm::saturating;
    if (!contains(other.free, fit_ageing_time)) other.free.push_back(fit_ageing_time);
    assume(model_, other);
    other.values[fit_ageing] = std::clamp(5.0 * point.values[fit_ageing], 0.02, 0.5);
    other.values[fit_ageing_time] =
        between(model_.lowest(fit_ageing_time), model_.highest(fit_ageing_time), share);
    other = minimise(model_, other);
    if (better(other, best)) best = other;
  }
  const double gain = samples_that_count(better(best, point) ? best : point) *
                      std::log(point.sum_of_squares / std::max(best.sum_of_squares, 1e-300));
  FitPoint chosen = gain > told_apart ? best : point;
  chosen.frame.form_assumed = std::fabs(gain) <= told_apart;
  return chosen;
}

/// Adds ageing and strengthening with speed where they lower the residuals enough to justify them. `core` is
/// the fit without lubricant and damper; `base` has those of the two that were justified.
FitPoint Fitter::add_time_terms(const FitPoint& core, const FitPoint& base) {
  const FitParameter terms[] = {fit_ageing, fit_ageing_time, fit_strengthening, fit_strengthening_speed};
  const auto explain = [&](const std::string& why) {
    for (const FitParameter p : terms) why_[p] = why;
  };
  const bool rests =
      data_.longest_rest > std::max(rest_samples * data_.sample_time, core.values[fit_length] / data_.fast);
  if (options_.no_time) {
    explain("not looked for");
    return base;
  }
  if (!several_speeds() && !rests) {
    explain("the record has one speed and no rest: ageing and strengthening cannot be told");
    return base;
  }
  explain("not seen: it does not pay for itself");
  FitPoint best = base;
  for (const FitPoint& start : time_starts(core, base)) {
    const FitPoint point = try_rests(minimise(model_, start));
    if (point.values[fit_viscous] < 0.0 || point.values[fit_strengthening] < 0.0) continue;
    if (justified(point, best)) best = point;
  }
  if (has_time_terms(best)) {
    for (const FitParameter p : {fit_viscous, fit_damping, fit_stribeck})
      why_[p] = contains(best.free, p) ? std::string() : "not seen beside ageing and strengthening";
    best = try_saturating(best);
  }
  if (!several_speeds()) why_[fit_strengthening] = why_[fit_strengthening_speed] = "one speed only";
  if (options_.rule != bristle::SnapRule::redraw)
    why_[fit_ageing] = why_[fit_ageing_time] = "fitted with the rule redraw only";
  return best;
}

/// Adds friction that differs with direction to a fit, if the record has several loads: under a single load
/// it equals an offset of the sensor.
FitPoint Fitter::add_asymmetry(const FitPoint& point) {
  if (data_.axes == 2) {
    why_[fit_asymmetry] = "a record in the plane is fitted as one isotropic contact";
    return point;
  }
  if (!two_ways()) {
    why_[fit_asymmetry] = "the motion has one direction only";
    return point;
  }
  if (!several_loads()) {
    why_[fit_asymmetry] = "one load only: the same as an offset of the sensor";
    return point;
  }
  FitPoint skewed = point;
  skewed.free.push_back(fit_asymmetry);
  skewed = minimise(model_, skewed);
  if (justified(skewed, point)) return skewed;
  why_[fit_asymmetry] = "not seen: it does not pay for itself";
  return point;
}

}  // namespace cli
