// Generalised Maxwell-slip (GMS): Maxwell-slip whose elements, once slipping, follow the Stribeck curve with
// a lag.
//
//   stick:  dF_i/dt = k_i v                          until |F_i| = a_i s(v)
//   slip:   dF_i/dt = C (a_i e - F_i / s(v))         until the motion reverses or stops
//   F = sum F_i + sigma2 v        s(v) = Fc + (Fs - Fc) exp(-(v/vs)^2),   sum a_i = 1
//
// F is friction, v the velocity, e its direction; F_i, k_i and a_i are force, stiffness and share of element
// i; s is the Stribeck curve from static friction Fs to kinetic friction Fc, with Stribeck velocity vs;
// sigma2 is the viscous coefficient, C the rate of approach.
//
// Source: Al-Bender, Lampaert, Swevers, The generalized Maxwell-slip model, IEEE TAC 50(11), 2005. Ten
// elements of equal stiffness, with a_i in proportion to 0.5, 1.5, ... as in maxwell_slip.hpp. At constant v
// over the step both phases are exact: a straight line to the limit, then an exponential with rate C/s. In
// the plane F_i is a vector and "reverses" means F_i . v < 0 (our extension).
#pragma once

#include <array>

#include "tools/libraries/rivals/pair.hpp"

namespace rivals {

struct GeneralisedMaxwellSlip {
  static constexpr int elements = 10;

  Surface surface;
  /// Rate at which slipping elements approach the Stribeck curve, C over Fc, 1/s.
  double attraction_rate = 100.0;
  std::array<Pair, elements> force{};  ///< friction of each element, against the motion, N
  std::array<bool, elements> slips{};

  Force step(Pair displacement, double dt_s, double load_n) noexcept;
};

}  // namespace rivals
