// Friction cones of two coefficients, as in physics engines: friction opposes the slip at once, without
// presliding. Both are regularised as in coulomb.hpp.
#pragma once

#include <algorithm>

#include "tools/libraries/rivals/pair.hpp"

namespace rivals {

struct Cone {
  Pair coefficient{0.4, 0.4};    ///< friction coefficients along x and along y
  double creep_velocity = 1e-5;  ///< speed from which on friction has its full value, m/s

  Pair scaled(Pair a) const noexcept { return {coefficient.x * a.x, coefficient.y * a.y}; }
};

/// MuJoCo's elliptic cone, F_x^2 / mu_x^2 + F_y^2 / mu_y^2 <= N^2 (its documentation, Computation, friction
/// cones), where N is the load. The force at slip velocity v is that of the ellipse that dissipates most,
/// F = -N M^2 v / |M v| with M = diag(mu_x, mu_y).
struct EllipticCone : Cone {
  Force step(Pair displacement, double dt_s, double load_n) const noexcept {
    const Pair v = (1.0 / dt_s) * displacement, scaled_v = scaled(v);
    const double floor = creep_velocity * std::min(coefficient.x, coefficient.y);
    const Pair force = -(load_n / std::max(length(scaled_v), floor)) * scaled(scaled_v);
    return {force, force};
  }
};

/// Bullet's anisotropic friction (btSequentialImpulseConstraintSolver). It scales the direction of the slip
/// by axis and applies friction along it up to its limit, F = -N M v / |v|, another point of the ellipse of
/// EllipticCone.
struct ScaledCone : Cone {
  Force step(Pair displacement, double dt_s, double load_n) const noexcept {
    const Pair v = (1.0 / dt_s) * displacement;
    const Pair force = -(load_n / std::max(length(v), creep_velocity)) * scaled(v);
    return {force, force};
  }
};

}  // namespace rivals
