// LuGre: one bristle that is dragged along, with a steady state on the Stribeck curve.
//
//   dz/dt = v - |v| z / zss(v)      zss = g(v) / sigma0,   g = Fc + (Fs - Fc) exp(-(v/vs)^2)
//   F     = sigma0 z + sigma1 dz/dt + sigma2 v
//
// Source: Canudas de Wit, Olsson, Astrom, Lischinsky, A new model for control of systems with friction, IEEE
// TAC 40(3), 1995. In the plane z is a vector and |v| the speed (Velenis, Tsiotras, Canudas de Wit, 2005,
// isotropic case). At constant v over the step the equation is linear in z: exact exponential, stable at
// every step length (explicit Euler needs |v| dt < 2 zss). The mean of dz/dt over the step is (z1 - z0)/dt,
// exactly. Drifts under a varying force below break-away; shows lag and a break-away that falls with the
// force rate.
#pragma once

#include "tools/rivals/pair.hpp"

namespace rivals {

struct LuGre {
  Surface surface;
  Pair z;  ///< m, deflection

  Force step(Pair displacement, double dt_s, double load_n) noexcept;
};

}  // namespace rivals
