// Dahl's model: a spring whose stiffness fades as the force nears Coulomb friction.
//
//   dF/dx = sigma0 (1 - F/Fc sgn v)        with z = F / sigma0:   dz = dx - |dx| z / zc,   zc = mu N / sigma0
//
// F is friction, x the path, v the speed, z the deflection, sigma0 the stiffness, Fc = mu N Coulomb friction,
// e the direction of motion.
//
// Source: Dahl, A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1, 1968 (exponent 1). The
// force depends on the path alone, so a step of length H is exact: z relaxes towards zc e by exp(-H/zc). In
// the plane z is a vector. The model drifts under a varying force and has no static peak.
#pragma once

#include "tools/libraries/rivals/pair.hpp"

namespace rivals {

struct Dahl {
  Surface surface;
  Pair z;  ///< deflection of the spring, m

  Force step(Pair displacement, double dt_s, double load_n) noexcept;
};

}  // namespace rivals
