// Rate and state: friction that depends on the speed and on a state, which ages at rest and wears off in
// sliding. The model is a quasi-static slider without mass, pulled through the contact's spring.
//
//   |F| / N  = a asinh( V / (2 v0) exp((mu0 + b psi) / a) ),   psi = ln(v0 theta / Dc)
//   dtheta/dt = 1 - V theta / Dc        (the ageing law: theta = Dc / V in steady sliding, = time at rest)
//   dz/dt     = v - V e,   F = sigma0 z,   e = z / |z|        (V: speed of the slider, along its spring)
//
// N is the load, v the velocity of the body, z the stretch of the spring, sigma0 its stiffness, theta the
// state, Dc the distance over which the state wears off.
//
// Sources: Dieterich, JGR 84(B5), 1979; Ruina, JGR 88(B12), 1983; the asinh, which gives V = 0 at F = 0 and
// allows reversal: Rice and Ben-Zion, PNAS 93, 1996; stability of a slider: Rice and Ruina, J. Appl. Mech.
// 50, 1983. For V far above v0 exp(-mu0/a) the asinh is a logarithm, and the law the usual one, mu0 + a
// ln(V/v0) + b ln(v0 theta/Dc). The plane is an extension, in which the slider follows its spring. A step
// solves the equations by Rodas4 (Hairer and Wanner, Solving ODEs II, IV.7: six linearly implicit stages,
// order 4, stiffly accurate) in pieces whose error estimate is below `tolerance` in |F| / (a N) and psi. A
// spring softer than (b - a) N / Dc makes even a prescribed motion stick and slip.
#pragma once

#include "tools/libraries/rivals/pair.hpp"

namespace rivals {

struct RateState {
  /// Parameters of the surface, of which the model uses only kinetic_coefficient (mu0) and stiffness
  /// (sigma0).
  Surface surface;
  double direct_effect = 0.02;    ///< direct effect a > 0: immediate change of F / N per e-fold of speed
  double state_effect = 0.04;     ///< evolution effect b >= 0: change of F / N per e-fold of the state theta
  double state_length = 2e-5;     ///< distance Dc over which the state wears off, m
  double reference_speed = 1e-3;  ///< speed v0 at which steady friction is mu0 N, m/s
  Pair z;                         ///< deflection of the spring, m

  /// State psi = ln(v0 theta / Dc). A new contact starts in the state of steady sliding at the speed v0.
  double psi = 0.0;

  static constexpr double tolerance = 1e-7;

  Force step(Pair displacement, double dt_s, double load_n) noexcept;
};

}  // namespace rivals
