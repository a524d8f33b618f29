// Friction of a brush with known parameters (brute_force.hpp), as an experiment would record it, with the
// disturbances of sensors. One axis; forces by the body, positive along the motion.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "tests/brute_force.hpp"

namespace bristle_test {

struct SyntheticFriction {
  // Parameters of the material. `kinetic`: kinetic friction over load.
  double kinetic = 0.35;
  double length = 15e-6;   // mean snap length, m
  double spread = 0.4;     // coefficient of variation of the snap length, lognormal
  double viscous = 0.0;    // viscous friction, N s/m
  double damping = 0.0;    // damping per newton of load, s/m
  double stribeck = 1e-3;  // Stribeck velocity, m/s
  bool redraw = true;
  std::size_t bristles = 1800;

  // Number of rings of equal area that make a turning disc, recorded by x and force at its rim; 0: no disc.
  std::size_t annuli = 0;
  double delay = 0.0;  // time constant of a first-order low-pass of the force, s
  // Disturbances of the sensors:
  double noise = 0.0;    // noise of the force, N
  double encoder = 0.0;  // resolution of the encoder, m

  // Drift of the force as a function of time (s), N.
  std::function<double(double)> drift = [](double) { return 0.0; };
  int every = 1;  // records one sample of this many

  // Motion and load over time: functions from s to m, and from s to N.
  double duration = 10.0, rate = 200.0;
  std::function<double(double)> motion;
  std::function<double(double)> load = [](double) { return 2.0; };
  // Load, N, at which all bristles touch, for a load that changes. The last bristles to enter are the first
  // to leave.
  double most_load = 0.0;
};

struct RecordedFriction {
  std::vector<double> t, x, load, force;
  /// Returns the record as CSV with angle and torque, those of a disc of this radius (m).
  std::string disc_csv(double radius) const {
    std::string text = "t,angle,load,torque\n";
    char line[160];
    for (std::size_t i = 0; i < t.size(); ++i) {
      std::snprintf(line, sizeof line, "%.17g,%.17g,%.17g,%.17g\n", t[i], x[i] / radius, load[i],
                    force[i] * radius);
      text += line;
    }
    return text;
  }
  /// Writes the record as a CSV text; `sign` = -1 gives the force on the body.
  std::string csv(double sign = 1.0) const {
    std::string text = "t,x,load,force\n";
    char line[160];
    for (std::size_t i = 0; i < t.size(); ++i) {
      std::snprintf(line, sizeof line, "%.17g,%.17g,%.17g,%.17g\n", t[i], x[i], load[i], sign * force[i]);
      text += line;
    }
    return text;
  }
};

/// Returns the position at time t: three seconds of growing loops up to 12 um, then strokes of growing length
/// and speed, to 0.4 mm and 1.3 mm/s.
inline double loops_and_strokes(double t) {
  if (t < 3.0) return 12e-6 * t / 3.0 * std::sin(2.0 * M_PI * 1.5 * t);
  return 0.4e-3 * std::sin(2.0 * M_PI * 0.5 * (t - 3.0)) * std::pow(std::min((t - 3.0) / 6.0, 1.0), 1.5);
}

inline RecordedFriction record(const SyntheticFriction& s, std::uint64_t seed) {
  BruteForcePatch plain(s.annuli > 0 ? 0 : s.bristles, lognormal_quantile(s.length, s.spread), s.redraw,
                        seed);
  std::vector<BruteForcePatch> annuli;
  for (std::size_t k = 0; k < s.annuli; ++k)
    annuli.emplace_back(s.bristles / s.annuli, lognormal_quantile(s.length, s.spread), s.redraw,
                        seed + 7919 * (k + 1));
  const double bend = s.length * 0.5 * (s.redraw ? 1.0 + s.spread * s.spread : 1.0);
  std::mt19937_64 generator(seed + 1);
  std::normal_distribution<double> normal;
  RecordedFriction out;
  const auto count = static_cast<int>(s.duration * s.rate);
  double x = s.motion(0.0), shown = 0.0, force_before = 0.0;
  for (int i = 0; i < count; ++i) {
    const double t = i / s.rate, next = s.motion(t);
    double deflection = 0.0;
    // Mean square of a disc's radii over the rim's: factor of the parts of friction that grow with speed.
    double speed_arm = 1.0;
    if (s.annuli > 0) {
      speed_arm = 0.5;
      for (std::size_t k = 0; k < s.annuli; ++k) {
        const double n = static_cast<double>(s.annuli), lever = std::sqrt((static_cast<double>(k) + 0.5) / n);
        deflection += lever * annuli[k].step(lever * (next - x), 0.0).end_x / n;
      }
    } else {
      deflection = plain.step(next - x, 0.0).end_x;
      if (s.most_load > 0.0) {
        std::vector<BruteBristle>& all = plain.bristles();
        const auto in_contact =
            static_cast<std::size_t>(s.load(t) / s.most_load * static_cast<double>(all.size()));
        deflection = 0.0;
        for (std::size_t k = 0; k < all.size(); ++k) {
          if (k >= in_contact) all[k].zx = 0.0;
          deflection += all[k].zx / static_cast<double>(in_contact);
        }
      }
    }
    x = next;
    const double h = 1e-4 / s.rate;
    const double v = (s.motion(t + h) - s.motion(t - h)) / (2.0 * h);
    const double load = s.load(t);
    double force = s.kinetic * load * deflection / bend;
    force += s.viscous * speed_arm * v;
    if (s.damping > 0.0) force += load * s.damping * v * std::exp(-std::abs(v) / s.stribeck);
    // Passes the force through a low-pass, force' = (friction - force) / delay, with friction linear between
    // steps.
    if (s.delay > 0.0) {
      const double lag = s.delay * (force - force_before) * s.rate;
      shown =
          i == 0 ? force : force - lag + (shown - force_before + lag) * std::exp(-1.0 / (s.rate * s.delay));
      force_before = force;
      force = shown;
    }
    force += s.drift(t) + s.noise * normal(generator);
    if (i % s.every != 0) continue;
    out.t.push_back(t);
    out.x.push_back(s.encoder > 0.0 ? s.encoder * std::round(x / s.encoder) : x);
    out.load.push_back(load);
    out.force.push_back(force);
  }
  return out;
}

}  // namespace bristle_test
