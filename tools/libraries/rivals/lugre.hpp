// LuGre: a model with one bristle that is dragged along, and whose steady state follows the Stribeck curve.
//
//   dz/dt = v - |v| z / zss(v)      zss = g(v) / sigma0,   g = Fc + (Fs - Fc) exp(-(v/vs)^2)
//   F     = sigma0 z + sigma1 dz/dt + sigma2 v
//
// F is friction, z the deflection, zss that in steady sliding, v the velocity; sigma0, sigma1 and sigma2 are
// stiffness, damping and viscous coefficient; g is the Stribeck curve from static friction Fs to kinetic
// friction Fc, with Stribeck velocity vs.
//
// Source: Canudas de Wit, Olsson, Astrom, Lischinsky, A new model for control of systems with friction, IEEE
// TAC 40(3), 1995. In the plane z is a vector and |v| the speed (Velenis, Tsiotras, Canudas de Wit, 2005,
// isotropic case). At constant v the equation is linear in z, so a step is an exact exponential, stable at
// every length (explicit Euler needs |v| dt < 2 zss), and the mean of dz/dt is exactly (z1 - z0)/dt. The
// model drifts under a varying force below break-away; it shows friction lag, and a break-away force that
// falls with the force rate.
//
// `StepRule::euler` is cheaper by an exponential, unstable where |v| dt >= 2 zss; its mean is that of both
// ends.
#pragma once

#include <cmath>
#include <cstdint>

#include "tools/libraries/rivals/relaxation.hpp"

namespace rivals {

struct LuGre {
  enum class StepRule : std::uint8_t { exact, euler };

  Surface surface;
  Pair z;  ///< deflection of the bristle, m
  StepRule rule = StepRule::exact;

  Force step(Pair displacement, double dt_s, double load_n) noexcept {
    if (!(load_n > 0.0)) {
      z = {};
      return {};
    }
    const Pair v = (1.0 / dt_s) * displacement;
    const double path = std::sqrt(dot(displacement, displacement)), speed = path / dt_s;
    const double zss = surface.stribeck_force(speed, load_n) / surface.stiffness;
    Relaxed r{z, z};
    if (rule == StepRule::euler) {
      r.end = z + displacement - (path / zss) * z;
      r.mean = 0.5 * (z + r.end);
    } else if (path > 0.0) {
      r = relax(z, (zss / path) * displacement, path / zss);
    }
    const Pair mean_rate = (1.0 / dt_s) * (r.end - z);
    const Pair end_rate = v - (speed / zss) * r.end;
    z = r.end;
    return {surface.bristle_force(r.end, end_rate, v), surface.bristle_force(r.mean, mean_rate, v)};
  }
};

}  // namespace rivals
