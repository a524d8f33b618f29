// Coulomb friction, regularised: a force against the motion, with a steep ramp through zero speed.
//
//   F = N mu v / max(|v|, v_creep) + sigma2 v
//
// F is friction, N the load, mu the kinetic coefficient, v the speed, sigma2 the viscous coefficient.
//
// Source: Coulomb, Theorie des machines simples, 1785; the ramp is the usual regularisation (Olsson et al.,
// Friction models and friction compensation, Eur. J. Control 4, 1998). The model has no state, so its force
// does not depend on the step length. Under a force F < mu N a body creeps at v_creep F / (mu N), for ever.
// The ramp is a damper of mu N / v_creep: couple it implicitly (by `mean` at the end of a trial step).
#pragma once

#include "tools/libraries/rivals/pair.hpp"

namespace rivals {

struct Coulomb {
  Surface surface;
  double creep_velocity = 1e-5;  ///< speed from which on friction has its full value, m/s

  Force step(Pair displacement, double dt_s, double load_n) noexcept;
};

}  // namespace rivals
