#include "tools/libraries/fitting/model.hpp"

#include "tools/libraries/scene/snap_law.hpp"

#include <algorithm>
#include <cmath>

namespace cli {

namespace {

/// Returns the factor by which the snap length of bristles of this age (s) exceeds that of new ones.
double growth(const bristle::Ageing& ageing, double age) {
  bristle::Material m;
  m.with_ageing(ageing);
  return m.ageing_factor(age);
}

}  // namespace

FitModel::FitModel(const FitData& data, const FitOptions& options, Detail detail)
    : data_(data),
      options_(options),
      detail_(detail),
      stage_force_(
          Eigen::Map<const Eigen::VectorXd>(data.force.data(), static_cast<Eigen::Index>(data.force.size()))),
      bent_path_(data.path),
      brush_(bent_path_, data.axes, data.columns.disc),
      rings_(rings_of(data.columns.disc, detail)),
      square_lever_(over_rings(2, [](double) { return 1.0; })) {
  const std::size_t n = data.samples();
  for (std::size_t k = 0; k < n; ++k)
    speed_.push_back(data.axes == 1 ? std::fabs(data.velocity[k])
                                    : std::hypot(data.velocity[k], data.velocity[k + n]));
}

/// Returns the ageing for which delta(a) = delta(A) (1 + b (ln(1 + a/tau) - ln(1 + A/tau))): a snap length
/// referred to the frame's age A, so that the data determine b nearly independently of tau.
bristle::Ageing FitModel::ageing(const FitValues& p) const {
  if (p[fit_ageing] == 0.0) return {};
  if (frame_.form == bristle::AgeingForm::saturating)
    return bristle::Ageing::saturating(p[fit_ageing], p[fit_ageing_time]);
  const double fresh = 1.0 - p[fit_ageing] * std::log1p(frame_.age / p[fit_ageing_time]);
  const double beta = fresh > 0.0 ? p[fit_ageing] / fresh : bristle::largest_ageing;
  return bristle::Ageing::logarithmic(std::min(beta, bristle::largest_ageing), p[fit_ageing_time]);
}

BrushShape FitModel::shape(const FitValues& p) const {
  BrushShape shape{options_.law, options_.rule, p[fit_spread], p[fit_residual], p[fit_renewal]};
  shape.quantiles = options_.quantiles;
  const bristle::Ageing a = ageing(p);
  shape.ageing_form = a.form;
  shape.ageing_strength = a.strength;
  shape.ageing_time = a.time;
  if (a.strength > 0.0) shape.growth = growth(a, frame_.age);
  return shape;
}

Eigen::VectorXd FitModel::elastic_at(const FitValues& p) {
  ++evaluations_;
  Past past = past_;
  past.speed = frame_.speed;
  bent_path_ = bends_stage(p) ? contact_path(p) : data_.path;
  const std::vector<double> forces = brush_.find(shape(p), p[fit_length], past, detail_, frame_.speed);
  return Eigen::Map<const Eigen::VectorXd>(forces.data(), static_cast<Eigen::Index>(forces.size()));
}

const Eigen::VectorXd& FitModel::elastic(const FitValues& p) {
  bool same = true;
  for (unsigned q = fit_length; q <= fit_ageing_time; ++q) same = same && p[q] == known_values_[q];
  for (const FitParameter q : {fit_compliance, fit_softening}) same = same && p[q] == known_values_[q];
  if (!same) {
    known_ = elastic_at(p);
    known_values_ = p;
  }
  return known_;
}

bristle::Material FitModel::unit_material(const FitValues& p) const {
  return shape(p).material(p[fit_length]);
}

double FitModel::kinetic_deflection(const FitValues& p) const {
  const bristle::Material material = unit_material(p);
  return frame_.speed > 0.0 ? material.kinetic_coefficient(frame_.speed) : material.kinetic_coefficient();
}

double FitModel::elastic_coefficient(const FitValues& p) const {
  if (p[fit_strengthening] == 0.0) return p[fit_kinetic];
  const double rest =
      p[fit_kinetic] - p[fit_strengthening] * std::asinh(frame_.speed / (2.0 * p[fit_strengthening_speed]));
  return std::max(rest, 1e-3 * p[fit_kinetic]);
}

/// Returns the damping coefficient at speed `u` (in Stribeck velocities), relative to that at rest.
double FitModel::decay(double u) const {
  return std::exp(options_.decay == bristle::DamperDecay::gaussian ? -u * u : -u);
}

/// Returns the damping force divided by load, speed and damping coefficient.
double FitModel::damper(double speed, double stribeck) const {
  if (!(stribeck > 0.0)) return 0.0;
  return over_rings(2, [&](double lever) { return decay(lever * speed / stribeck); });
}

Eigen::VectorXd FitModel::skewed(Eigen::VectorXd force, double asymmetry) const {
  if (asymmetry != 0.0) force.array() *= 1.0 + asymmetry * force.array().sign();
  return force;
}

double FitModel::strengthening(std::size_t row, double speed_scale) const {
  const std::size_t k = row % data_.samples();
  if (speed_[k] == 0.0) return 0.0;
  const double sum =
      over_rings(1, [&](double lever) { return std::asinh(lever * speed_[k] / (2.0 * speed_scale)); });
  return sum * data_.velocity[row] / speed_[k];
}

/// Returns the path of the contact: the measured position less the deflection of the stage by the friction F,
/// c F + q F^2, with compliance c and softening q. F is taken as linear in time between samples.
std::vector<PathPoint> FitModel::contact_path(const FitValues& p) const {
  std::vector<PathPoint> path = data_.path;
  const double c = p[fit_compliance];
  const std::size_t n = data_.samples();
  const std::vector<double>& t = data_.columns.t;
  std::size_t next = 0;  // index of the first sample at or after the point's time
  for (PathPoint& point : path) {
    const std::size_t k = std::min(next, n - 1);
    double share = 0.0;  // weight of the previous sample in interpolating the force
    if (!point.wanted && k > 0 && t[k] > t[k - 1])
      share = std::clamp((t[k] - point.t) / (t[k] - t[k - 1]), 0.0, 1.0);
    const auto at = [&](std::size_t axis) {
      const auto row = static_cast<Eigen::Index>(axis * n + k);
      return stage_force_[row] + (share > 0.0 ? share * (stage_force_[row - 1] - stage_force_[row]) : 0.0);
    };
    const double along = at(0);
    point.x -= (c + p[fit_softening] * along) * along;
    if (data_.axes == 2) point.y -= c * at(1);
    if (point.wanted) ++next;
  }
  return path;
}

Eigen::VectorXd FitModel::low_passed(Eigen::VectorXd force, double time) const {
  if (!(time > 0.0)) return force;
  const std::vector<double>& t = data_.columns.t;
  const std::size_t n = data_.samples();
  for (std::size_t axis = 0; axis < data_.axes; ++axis) {
    double before = 0.0, seen = 0.0;  // force, and sensor's output, at the previous sample
    for (std::size_t k = 0; k < n; ++k) {
      double& f = force[static_cast<Eigen::Index>(axis * n + k)];
      const double now = f;
      if (!data_.columns.follows(k)) {
        seen = now;
      } else {
        const double dt = t[k] - t[k - 1], lag = (now - before) / dt * time;
        seen = now - lag + (seen - before + lag) * std::exp(-dt / time);
      }
      before = now;
      f = seen;
    }
  }
  return force;
}

Eigen::VectorXd FitModel::force_on_stage(const FitValues& p) {
  Eigen::VectorXd f = elastic_coefficient(p) * elastic(p);
  const std::size_t n = data_.samples();
  if (p[fit_strengthening] != 0.0) {
    for (Eigen::Index i = 0; i < f.size(); ++i) {
      const auto row = static_cast<std::size_t>(i);
      f[i] += data_.load[row % n] * p[fit_strengthening] * strengthening(row, p[fit_strengthening_speed]);
    }
  }
  f = skewed(std::move(f), p[fit_asymmetry]);
  for (Eigen::Index i = 0; i < f.size(); ++i) {
    const auto row = static_cast<std::size_t>(i);
    const std::size_t k = row % n;
    const double v = data_.velocity[row], load = data_.load[k];
    if (load > 0.0)
      f[i] +=
          v * (square_lever_ * p[fit_viscous] + load * p[fit_damping] * damper(speed_[k], p[fit_stribeck]));
  }
  return f;
}

void FitModel::settle_stage(const FitValues& p) {
  if (!bends_stage(p)) return;
  constexpr int most_rounds = 100;
  constexpr double share = 0.5;  // relaxation factor of the iteration for the stage's force, which then
                                 // converges for stages up to three times as soft as the bristles
  Eigen::VectorXd force = Eigen::VectorXd::Zero(stage_force_.size());
  for (int round = 0; round < most_rounds; ++round) {
    set_stage_force(force);
    const Eigen::VectorXd change = force_on_stage(p) - force;
    force += share * change;
    if (change.cwiseAbs().maxCoeff() < 1e-4 * data_.force_scale) break;
  }
  set_stage_force(std::move(force));
}

Eigen::VectorXd FitModel::force(const FitValues& p) {
  Eigen::VectorXd f = low_passed(force_on_stage(p), p[fit_delay]);
  const std::size_t n = data_.samples();
  const double middle = data_.start() + 0.5 * data_.length();
  for (Eigen::Index i = 0; i < f.size(); ++i) {
    const auto row = static_cast<std::size_t>(i);
    const FitParameter offset = row < n ? fit_offset : fit_offset_y,
                       drift = row < n ? fit_drift : fit_drift_y;
    f[i] += p[offset] + p[drift] * (data_.columns.t[row % n] - middle);
  }
  return f;
}

/// Differentiates the force by differences of a parameter or of its logarithm. Steps are far above rounding,
/// and the force is smooth over them; with the rule keep it has waves, which need other steps.
Eigen::VectorXd FitModel::bent_derivative(const FitValues& p, FitParameter parameter, bool central) {
  const bool keep = options_.rule == bristle::SnapRule::keep;
  const double smooth = !keep ? 0.02 : parameter == fit_spread ? 0.05 : 0.01;
  const bool faint = parameter == fit_ageing && frame_.form == bristle::AgeingForm::logarithmic;
  const double step = parameter == fit_renewal       ? smooth * (1.0 + p[fit_renewal])
                      : parameter == fit_ageing_time ? 0.2
                      : faint                        ? 0.1 * smooth
                      : parameter == fit_softening   ? 0.002
                                                     : smooth;
  const auto moved = [&](double by) {
    FitValues values = p;
    values[parameter] =
        is_logarithmic(parameter) ? p[parameter] * std::exp(by) : p[parameter] + by * scale(p, parameter);
    return values;
  };
  const auto elastic_force = [&](double by) {
    const FitValues values = moved(by);
    return skewed(elastic_coefficient(values) * (by == 0.0 ? elastic(values) : elastic_at(values)),
                  p[fit_asymmetry]);
  };
  const bool at_top = parameter != fit_length && moved(step)[parameter] > highest(parameter);
  const bool at_bottom = !is_logarithmic(parameter) && moved(-step)[parameter] < lowest(parameter);
  if (at_bottom) return (elastic_force(step) - elastic_force(0.0)) / step;
  if (!central || at_top) return (elastic_force(0.0) - elastic_force(-step)) / step;
  return (elastic_force(step) - elastic_force(-step)) / (2.0 * step);
}

Eigen::VectorXd FitModel::derivative(const FitValues& p, FitParameter parameter, bool central) {
  if (parameter == fit_delay) {
    constexpr double step = 0.02;
    const Eigen::VectorXd f = force_on_stage(p);
    return (low_passed(f, p[fit_delay] * std::exp(step)) - low_passed(f, p[fit_delay] * std::exp(-step))) /
           (2.0 * step);
  }
  Eigen::VectorXd d = derivative_before_sensor(p, parameter, central);
  return parameter >= fit_offset ? d : low_passed(std::move(d), p[fit_delay]);
}

Eigen::VectorXd FitModel::derivative_before_sensor(const FitValues& p, FitParameter parameter, bool central) {
  const std::size_t n = data_.samples();
  const double unit = scale(p, parameter);
  if (parameter == fit_kinetic) return skewed(unit * elastic(p), p[fit_asymmetry]);
  if (bends(parameter) || parameter == fit_compliance || parameter == fit_softening)
    return bent_derivative(p, parameter, central);
  const auto dry_force = [&] {
    FitValues dry = p;
    for (const FitParameter q : {fit_asymmetry, fit_viscous, fit_damping}) dry[q] = 0.0;
    return force_on_stage(dry);
  };
  if (parameter == fit_asymmetry) return unit * dry_force().cwiseAbs();
  Eigen::VectorXd d = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(data_.force.size()));
  const double middle = data_.start() + 0.5 * data_.length();
  if (parameter == fit_strengthening || parameter == fit_strengthening_speed) {
    const double speed = p[fit_strengthening_speed], reference = frame_.speed / (2.0 * speed);
    const bool slope = parameter == fit_strengthening_speed;
    const auto of = [&](double u) { return slope ? -u / std::sqrt(1.0 + u * u) : std::asinh(u); };
    const double factor = slope ? p[fit_strengthening] : unit;
    for (Eigen::Index i = 0; i < d.size(); ++i) {
      const auto row = static_cast<std::size_t>(i);
      const double v = speed_[row % n];
      if (v > 0.0) {
        const double sum = over_rings(1, [&](double lever) { return of(lever * v / (2.0 * speed)); });
        d[i] = factor * data_.load[row % n] * sum * data_.velocity[row] / v;
      }
    }
    d -= factor * of(reference) * elastic(p);
    if (p[fit_asymmetry] != 0.0) d.array() *= 1.0 + p[fit_asymmetry] * dry_force().array().sign();
    return d;
  }
  for (Eigen::Index i = 0; i < d.size(); ++i) {
    const auto row = static_cast<std::size_t>(i);
    const std::size_t k = row % n;
    const bool of_x = row < n;
    const double v = data_.velocity[row], load = data_.load[k], speed = speed_[k];
    switch (parameter) {
      case fit_viscous:
        d[i] = load > 0.0 ? unit * square_lever_ * v : 0.0;
        break;
      case fit_damping:
        d[i] = unit * load * v * damper(speed, p[fit_stribeck]);
        break;
      case fit_stribeck: {
        d[i] = load * p[fit_damping] * v * over_rings(2, [&](double lever) {
                 const double u = lever * speed / p[fit_stribeck];
                 return decay(u) * (options_.decay == bristle::DamperDecay::gaussian ? 2.0 * u * u : u);
               });
        break;
      }
      case fit_offset:
      case fit_offset_y:
        d[i] = of_x == (parameter == fit_offset) ? unit : 0.0;
        break;
      default:
        d[i] = of_x == (parameter == fit_drift) ? unit * (data_.columns.t[k] - middle) : 0.0;
    }
  }
  return d;
}

double FitModel::scale(const FitValues& p, FitParameter parameter) const {
  if (is_logarithmic(parameter)) return p[parameter];
  if (parameter == fit_residual || parameter == fit_renewal || parameter == fit_ageing ||
      parameter == fit_asymmetry)
    return 1.0;
  const double force = data_.force_scale;
  if (parameter == fit_strengthening) return force / data_.mean_load;
  if (parameter == fit_viscous) return force / std::max(data_.fast, 1e-12);
  // Scale of a damper whose highest force equals the data's.
  if (parameter == fit_damping) return force / (data_.mean_load * p[fit_stribeck]) * 2.7;
  if (parameter == fit_softening) return data_.range / (force * force);
  return parameter == fit_drift || parameter == fit_drift_y ? force / data_.length() : force;
}

FitModel::Range FitModel::range(FitParameter parameter) const {
  const double force = data_.force_scale;
  switch (parameter) {
    case fit_kinetic:
      return {1e-5 * force / data_.mean_load, 1e4 * force / data_.mean_load};
    case fit_length: {
      const double low = std::max({0.5 * data_.quantum, 0.5 * data_.finest_move, 1e-5 * data_.range, 1e-11});
      return {low, std::min(std::max(10.0 * data_.range, 10.0 * low), 100.0)};
    }
    case fit_spread:
      // Begins above 0.05, the least spread of an infinite brush, since derivatives look below.
      return {0.0525, largest_spread(options_.law, options_.rule)};
    case fit_residual:
      return {0.0, widest_residual};
    case fit_renewal:
      return {0.0, most_renewed};
    case fit_ageing:
      return {0.0, frame_.form == bristle::AgeingForm::saturating ? bristle::largest_ageing : 0.2};
    case fit_ageing_time: {
      const double low = std::clamp(0.01 * frame_.shortest_age, 1e-7, 1e6);
      return {low, std::clamp(frame_.longest_age, 10.0 * low, 1e8)};
    }
    case fit_strengthening_speed: {
      const double low = std::clamp(1e-3 * data_.slow, 1e-12, 1.0);
      return {low, std::max(data_.fast, 10.0 * low)};
    }
    case fit_stribeck: {
      const double low = std::max(0.1 * data_.slow, 1e-9);
      return {low, std::max(10.0 * data_.fast, 100.0 * low)};
    }
    case fit_compliance:  // with the largest compliance the stage takes up the whole motion
      return {1e-5 * (data_.range / force), data_.range / force};
    case fit_softening:
      return {-(data_.range / (force * force)), data_.range / (force * force)};
    case fit_delay:
      return {0.02 * data_.sample_time,
              std::max(std::min(200.0 * data_.sample_time, 0.05 * data_.length()), data_.sample_time)};
    default:
      return {1e-6, 1e6};
  }
}

}  // namespace cli
