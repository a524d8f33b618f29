// A vector in the tangent plane, the parameters of a surface, and the force of a step: what all friction
// models of this folder take and give.
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

/// Friction force on the moving body, N, with the sign of bristle::Response: at the end of the step, and
/// averaged over it.
struct Force {
  Pair end, mean;
};

/// Parameters of a pair of surfaces. Each model uses those in its equations
/// (tools/libraries/rivals/README.md). Defaults are those of Canudas de Wit et al. 1995, pressed on with 2.5
/// N.
struct Surface {
  double kinetic_coefficient = 0.4;     ///< coefficient of kinetic friction, Fc / N
  double static_coefficient = 0.6;      ///< coefficient of static friction (speed 0), Fs / N
  double stiffness = 1e5;               ///< stiffness of the whole contact at any load, sigma0, N/m
  double damping = 316.22776601683796;  ///< damping of the bristles, sigma1, N s/m
  double viscous_friction = 0.4;        ///< viscous coefficient, force per speed, sigma2, N s/m
  double stribeck_velocity = 1e-3;      ///< Stribeck velocity, over which friction falls from Fs to Fc, m/s

  /// Returns the steady friction without its viscous part, N: Fc + (Fs - Fc) exp(-(v/vs)^2).
  double stribeck_force(double speed_m_per_s, double load_n) const noexcept {
    if (static_coefficient == kinetic_coefficient) return load_n * kinetic_coefficient;
    const double u = speed_m_per_s / stribeck_velocity;
    return load_n * (kinetic_coefficient + (static_coefficient - kinetic_coefficient) * std::exp(-u * u));
  }
  /// Returns the force of a bristle with damper and lubricant, N: bent by z (m), with its bend changing at
  /// `rate` (m/s), at the velocity v (m/s).
  Pair bristle_force(Pair z, Pair rate, Pair v) const noexcept {
    return -(stiffness * z + damping * rate + viscous_friction * v);
  }
};

}  // namespace rivals
