#include "tools/fitting/model.hpp"

#include "tools/scene/snap_law.hpp"

#include <algorithm>
#include <cmath>

namespace cli {

BrushShape FitModel::shape(const FitValues& p) const {
  return {options_.law, options_.rule, p[fit_spread], p[fit_residual], p[fit_renewal]};
}

Eigen::VectorXd FitModel::elastic_at(const FitValues& p) {
  ++evaluations_;
  const std::vector<double> forces = brush_.find(shape(p), p[fit_length], past_, detail_);
  return Eigen::Map<const Eigen::VectorXd>(forces.data(), static_cast<Eigen::Index>(forces.size()));
}

const Eigen::VectorXd& FitModel::elastic(const FitValues& p) {
  const auto same = [&](FitParameter q) { return p[q] == known_values_[q]; };
  if (!(same(fit_length) && same(fit_spread) && same(fit_residual) && same(fit_renewal))) {
    known_ = elastic_at(p);
    known_values_ = p;
  }
  return known_;
}

bristle::Material FitModel::unit_material(const FitValues& p) const {
  return shape(p).material(p[fit_length]);
}

double FitModel::kinetic_deflection(const FitValues& p) const {
  return unit_material(p).kinetic_coefficient();
}

double FitModel::decay(double speed, double stribeck) const {
  if (!(stribeck > 0.0)) return 0.0;
  const double u = speed / stribeck;
  return std::exp(options_.decay == bristle::DamperDecay::gaussian ? -u * u : -u);
}

Eigen::VectorXd FitModel::force(const FitValues& p) {
  Eigen::VectorXd f = p[fit_kinetic] * elastic(p);
  const double middle = data_.start() + 0.5 * data_.length();
  for (Eigen::Index i = 0; i < f.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double v = data_.velocity[k], load = data_.load[k];
    if (load > 0.0)
      f[i] += v * (p[fit_viscous] + load * p[fit_damping] * decay(std::fabs(v), p[fit_stribeck]));
    f[i] += p[fit_offset] + p[fit_drift] * (data_.columns.t[k] - middle);
  }
  return f;
}

Eigen::VectorXd FitModel::derivative(const FitValues& p, FitParameter parameter, bool central) {
  const auto n = static_cast<Eigen::Index>(data_.columns.t.size());
  const double unit = scale(p, parameter);
  if (parameter == fit_kinetic) return unit * elastic(p);
  if (bends(parameter)) {
    // Difference of the logarithm or of the number. The force is smooth over such a step, and far from
    // rounding; that of kept lengths has waves.
    const double smooth = options_.rule == bristle::SnapRule::keep ? 0.01 : 0.02;
    const double step = parameter == fit_renewal ? smooth * (1.0 + p[fit_renewal]) : smooth;
    const auto moved = [&](double by) {
      FitValues values = p;
      values[parameter] = is_logarithmic(parameter) ? p[parameter] * std::exp(by) : p[parameter] + by;
      return values;
    };
    const bool at_top = parameter != fit_length && moved(step)[parameter] > highest(parameter);
    const bool at_bottom = !is_logarithmic(parameter) && moved(-step)[parameter] < lowest(parameter);
    if (at_bottom) return p[fit_kinetic] * (elastic_at(moved(step)) - elastic(p)) / step;
    if (!central || at_top) return p[fit_kinetic] * (elastic(p) - elastic_at(moved(-step))) / step;
    return p[fit_kinetic] * (elastic_at(moved(step)) - elastic_at(moved(-step))) / (2.0 * step);
  }
  Eigen::VectorXd d = Eigen::VectorXd::Zero(n);
  const double middle = data_.start() + 0.5 * data_.length();
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double v = data_.velocity[k], load = data_.load[k], speed = std::fabs(v);
    switch (parameter) {
      case fit_viscous:
        d[i] = load > 0.0 ? unit * v : 0.0;
        break;
      case fit_damping:
        d[i] = unit * load * v * decay(speed, p[fit_stribeck]);
        break;
      case fit_stribeck: {
        const double u = speed / p[fit_stribeck];
        const double slope = options_.decay == bristle::DamperDecay::gaussian ? 2.0 * u * u : u;
        d[i] = load * p[fit_damping] * v * decay(speed, p[fit_stribeck]) * slope;
        break;
      }
      case fit_offset:
        d[i] = unit;
        break;
      default:
        d[i] = unit * (data_.columns.t[k] - middle);
    }
  }
  return d;
}

double FitModel::scale(const FitValues& p, FitParameter parameter) const {
  if (is_logarithmic(parameter)) return p[parameter];
  const double force = data_.force_scale;
  switch (parameter) {
    case fit_residual:
    case fit_renewal:
      return 1.0;
    case fit_viscous:
      return force / std::max(data_.fast, 1e-12);
    case fit_damping:  // of a damper whose highest force is that of the data
      return force / (data_.mean_load * p[fit_stribeck]) * 2.7;
    case fit_drift:
      return force / data_.length();
    default:
      return force;
  }
}

double FitModel::lowest(FitParameter parameter) const {
  switch (parameter) {
    case fit_length:
      return std::max({0.5 * data_.quantum, 0.02 * data_.finest_move, 1e-5 * data_.range, 1e-11});
    case fit_spread:
      return 0.0525;  // the infinite brush takes 0.05, and derivatives look a little beyond
    case fit_residual:
    case fit_renewal:
      return 0.0;
    case fit_stribeck:
      return std::max(0.1 * data_.slow, 1e-9);
    case fit_kinetic:
      return 1e-5 * data_.force_scale / data_.mean_load;
    default:
      return 1e-6;
  }
}

double FitModel::highest(FitParameter parameter) const {
  switch (parameter) {
    case fit_length:
      return std::min(std::max(10.0 * data_.range, 10.0 * lowest(fit_length)), 100.0);
    case fit_spread:
      return largest_spread(options_.law, options_.rule);
    case fit_residual:
      return widest_residual;
    case fit_renewal:
      return most_renewed;
    case fit_stribeck:
      return std::max(10.0 * data_.fast, 100.0 * lowest(fit_stribeck));
    case fit_kinetic:
      return 1e4 * data_.force_scale / data_.mean_load;
    default:
      return 1e6;
  }
}

}  // namespace cli
