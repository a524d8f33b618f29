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
#pragma once

#include "tools/libraries/rivals/pair.hpp"

namespace rivals {

struct LuGre {
  Surface surface;
  Pair z;  ///< deflection of the bristle, m

  Force step(Pair displacement, double dt_s, double load_n) noexcept;
};

}  // namespace rivals
