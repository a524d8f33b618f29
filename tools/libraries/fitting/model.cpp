#include "tools/libraries/fitting/model.hpp"

#include <algorithm>
#include <cmath>

#include "tools/libraries/fitting/least_squares.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {

Eigen::VectorXd friction_measured(const FitData& data, const FitValues& p) {
  Eigen::VectorXd f(static_cast<Eigen::Index>(data.force.size()));
  const std::size_t n = data.samples();
  for (std::size_t i = 0; i < data.force.size(); ++i) {
    const FitParameter offset = i < n ? fit_offset : fit_offset_y, drift = i < n ? fit_drift : fit_drift_y;
    f[static_cast<Eigen::Index>(i)] =
        data.force[i] - p[offset] - p[drift] * (data.columns.t[i % n] - data.middle_time());
  }
  return f;
}

FitModel::FitModel(const FitData& data, const FitOptions& options, Detail detail)
    : data_(data),
      options_(options),
      detail_(detail),
      stage_force_(data.path.size(), 0.0),
      bent_path_(data.path),
      brush_(bent_path_, data.axes, data.columns.disc),
      rings_(rings_of(data.columns.disc, detail)),
      square_lever_(over_rings([](double) { return 1.0; })) {
  const std::size_t n = data.samples();
  for (std::size_t k = 0; k < n; ++k)
    speed_.push_back(data.axes == 1 ? std::fabs(data.velocity[k])
                                    : std::hypot(data.velocity[k], data.velocity[k + n]));
}

BrushShape FitModel::shape(const FitValues& p) const {
  return {options_.law, options_.rule, p[fit_spread], p[fit_residual], p[fit_renewal], options_.quantiles};
}

void FitModel::bend_path(const FitValues& p) {
  for (std::size_t i = 0; i < bent_path_.size(); ++i)
    bent_path_[i].x = data_.path[i].x - p[fit_softening] * stage_force_[i] * stage_force_[i];
}

Eigen::VectorXd FitModel::elastic_at(const FitValues& p) {
  bend_path(p);
  const std::vector<double> forces = brush_.find(shape(p), p[fit_length], past_, detail_);
  return Eigen::Map<const Eigen::VectorXd>(forces.data(), static_cast<Eigen::Index>(forces.size()));
}

const Eigen::VectorXd& FitModel::elastic(const FitValues& p) {
  bool same = true;
  for (unsigned q = fit_length; q <= fit_softening; ++q) same = same && p[q] == known_values_[q];
  if (!same) {
    known_ = elastic_at(p);
    known_values_ = p;
  }
  return known_;
}

bristle::Material FitModel::unit_material(const FitValues& p) const {
  return shape(p).material(p[fit_length]);
}

/// Returns the damping coefficient at a speed over that at rest; `u`: speed in Stribeck velocities.
double FitModel::decay(double u) const {
  return std::exp(options_.decay == bristle::DamperDecay::gaussian ? -u * u : -u);
}

/// Returns the force of the damper over load, speed and damping coefficient.
double FitModel::damper(double speed, double stribeck) const {
  if (!(stribeck > 0.0)) return 0.0;
  return over_rings([&](double lever) { return decay(lever * speed / stribeck); });
}

std::vector<double> FitModel::force_on_stage(const FitValues& p) {
  bend_path(p);
  std::vector<double> f = brush_.find(shape(p), p[fit_length], past_, detail_, true);
  for (std::size_t i = 0; i < f.size(); ++i) {
    const PathPoint &here = data_.path[i], &before = data_.path[i > 0 ? i - 1 : 0];
    const double time = std::max(here.t - before.t, 0.1 * data_.sample_time);
    const double v = here.begins ? 0.0 : (here.x - before.x) / time;
    f[i] = p[fit_kinetic] * f[i] + v * (square_lever_ * p[fit_viscous] +
                                        here.load * p[fit_damping] * damper(std::fabs(v), p[fit_stribeck]));
  }
  return f;
}

void FitModel::settle(const FitValues& p) {
  if (data_.axes == 2 || p == settled_) return;
  constexpr int most_rounds = 20;
  constexpr double small = 1e-3;
  // Each point takes a share of the difference, less where differences alternate: a stage that is softer than
  // the bristles would overshoot there.
  constexpr double least_share = 0.05, less = 0.5, more = 1.2;
  std::vector<double> share(stage_force_.size(), 1.0), before(stage_force_.size(), 0.0);
  double change = data_.force_scale;
  for (int round = 0; round < most_rounds && change > small * data_.force_scale && !fit_stopped(); ++round) {
    const std::vector<double> force = force_on_stage(p);
    change = 0.0;
    for (std::size_t i = 0; i < force.size(); ++i) {
      const double difference = force[i] - stage_force_[i];
      change = std::max(change, std::fabs(difference));
      share[i] = difference * before[i] < 0.0 ? std::max(less * share[i], least_share)
                                              : std::min(more * share[i], 1.0);
      before[i] = difference;
      stage_force_[i] += share[i] * difference;
    }
  }
  known_values_ = {};
  settled_ = p;
}

Eigen::VectorXd FitModel::low_passed(Eigen::VectorXd force, double time) const {
  if (!(time > 0.0)) return force;
  const std::vector<double>& t = data_.columns.t;
  const std::size_t n = data_.samples();
  for (std::size_t axis = 0; axis < data_.axes; ++axis) {
    double before = 0.0, seen = 0.0;  // force, and sensor's output, at the sample before
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

Eigen::VectorXd FitModel::friction(const FitValues& p) {
  Eigen::VectorXd f = p[fit_kinetic] * elastic(p);
  const std::size_t n = data_.samples();
  for (Eigen::Index i = 0; i < f.size(); ++i) {
    const auto row = static_cast<std::size_t>(i);
    const std::size_t k = row % n;
    const double load = data_.load[k], v = data_.velocity[row];
    if (load > 0.0)
      f[i] +=
          v * (square_lever_ * p[fit_viscous] + load * p[fit_damping] * damper(speed_[k], p[fit_stribeck]));
  }
  return f;
}

Eigen::VectorXd FitModel::force(const FitValues& p) {
  Eigen::VectorXd f = low_passed(friction(p), p[fit_delay]);
  const std::size_t n = data_.samples();
  const double middle = data_.middle_time();
  for (Eigen::Index i = 0; i < f.size(); ++i) {
    const auto row = static_cast<std::size_t>(i);
    const FitParameter offset = row < n ? fit_offset : fit_offset_y,
                       drift = row < n ? fit_drift : fit_drift_y;
    f[i] += p[offset] + p[drift] * (data_.columns.t[row % n] - middle);
  }
  return f;
}

/// Differentiates the force by a parameter or by its logarithm, by differences. The steps are far above
/// rounding, and the force is smooth over them.
Eigen::VectorXd FitModel::bent_derivative(const FitValues& p, FitParameter parameter, bool central) {
  constexpr double smooth = 0.02;
  const double step = parameter == fit_renewal     ? smooth * (1.0 + p[fit_renewal])
                      : parameter == fit_softening ? 0.002
                                                   : smooth;
  const auto moved = [&](double by) {
    FitValues values = p;
    values[parameter] =
        is_logarithmic(parameter) ? p[parameter] * std::exp(by) : p[parameter] + by * scale(p, parameter);
    return values;
  };
  const auto elastic_force = [&](double by) -> Eigen::VectorXd {
    return p[fit_kinetic] * (by == 0.0 ? elastic(p) : elastic_at(moved(by)));
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
    const Eigen::VectorXd f = friction(p);
    return (low_passed(f, p[fit_delay] * std::exp(step)) - low_passed(f, p[fit_delay] * std::exp(-step))) /
           (2.0 * step);
  }
  Eigen::VectorXd d = derivative_before_sensor(p, parameter, central);
  return parameter >= fit_offset ? d : low_passed(std::move(d), p[fit_delay]);
}

Eigen::VectorXd FitModel::derivative_before_sensor(const FitValues& p, FitParameter parameter, bool central) {
  const std::size_t n = data_.samples();
  const double unit = scale(p, parameter);
  if (parameter == fit_kinetic) return unit * elastic(p);
  if (bends(parameter)) return bent_derivative(p, parameter, central);
  Eigen::VectorXd d = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(data_.force.size()));
  const double middle = data_.middle_time();
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
        d[i] = load * p[fit_damping] * v * over_rings([&](double lever) {
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
  if (parameter == fit_residual || parameter == fit_renewal) return 1.0;
  const double force = data_.force_scale;
  if (parameter == fit_viscous) return force / std::max(data_.fast, 1e-12);
  // Scales the damping coefficient so that the damper's highest force, which is at the Stribeck velocity,
  // equals the force of the data.
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
      // Begins above 0.05, the least spread of an infinite brush, because derivatives need a smaller spread
      // as well.
      return {0.0525, largest_spread(options_.law, options_.rule)};
    case fit_residual:
      return {0.0, widest_residual};
    case fit_renewal:
      return {0.0, most_renewed};
    case fit_stribeck: {
      const double low = std::max(0.1 * data_.slow, 1e-9);
      return {low, std::max(10.0 * data_.fast, 100.0 * low)};
    }
    case fit_softening:
      return {-(data_.range / (force * force)), data_.range / (force * force)};
    case fit_delay:
      // Limits the sensor's delay to 12 samples. A sensor that averages over more samples would not be read
      // at every one, so a longer delay has another cause.
      return {0.02 * data_.sample_time, 12.0 * data_.sample_time};
    default:
      return {1e-6, 1e6};
  }
}

}  // namespace cli
