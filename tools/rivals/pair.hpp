// Vector in the tangent plane, and the force of a step: inputs and outputs of all friction models of this
// folder.
#pragma once

#include <cmath>

namespace rivals {

struct Pair {
  double x = 0.0, y = 0.0;
};

constexpr Pair operator+(Pair a, Pair b) noexcept { return {a.x + b.x, a.y + b.y}; }
constexpr Pair operator-(Pair a, Pair b) noexcept { return {a.x - b.x, a.y - b.y}; }
constexpr Pair operator-(Pair a) noexcept { return {-a.x, -a.y}; }
constexpr Pair operator*(double s, Pair a) noexcept { return {s * a.x, s * a.y}; }
constexpr double dot(Pair a, Pair b) noexcept { return a.x * b.x + a.y * b.y; }
inline double length(Pair a) noexcept { return std::hypot(a.x, a.y); }

/// Friction force on the moving body, N (sign as in bristle::Response): at the end of the step, and its mean.
struct Force {
  Pair end, mean;
};

/// Parameters of a pair of surfaces. Defaults: Canudas de Wit et al. 1995, pressed on with 2.5 N. Each model
/// uses those in its equations (tools/rivals/README.md).
struct Surface {
  double kinetic_coefficient = 0.4;     ///< Fc / N, sliding friction over load
  double static_coefficient = 0.6;      ///< Fs / N, friction over load at speed 0
  double stiffness = 1e5;               ///< N/m, sigma0: of the whole contact, for any load
  double damping = 316.22776601683796;  ///< N s/m, sigma1: damping of the bristles
  double viscous_friction = 0.4;        ///< N s/m, sigma2: force per speed
  double stribeck_velocity = 1e-3;      ///< m/s, vs: over it friction falls from Fs to Fc

  /// Returns the steady friction without its viscous part, N: Fc + (Fs - Fc) exp(-(v/vs)^2).
  double stribeck_force(double speed_m_per_s, double load_n) const noexcept {
    const double u = speed_m_per_s / stribeck_velocity;
    return load_n * (kinetic_coefficient + (static_coefficient - kinetic_coefficient) * std::exp(-u * u));
  }
};

}  // namespace rivals
