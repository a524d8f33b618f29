// Maxwell-slip: springs in parallel, each dragging a block with Coulomb friction of its own.
//
//   |z_i| < D_i: dz_i = dx;   at |z_i| = D_i the block slips and the spring keeps its length D_i
//   F = sum k_i z_i
//
// F is friction, x the path; z_i, k_i and D_i are stretch, stiffness and slip length of spring i, a is its
// angle to the motion.
//
// Source: Iwan, A distributed-element model for hysteresis, J. Appl. Mech. 33, 1966; Lampaert, Swevers,
// Al-Bender, IEEE TAC 47(4), 2002. By default ten elements of equal stiffness, with D_i spread evenly up to 2
// mu N / sigma0, so that the first stiffness is sigma0 and all slip at mu N. The force depends on the path
// alone, and a step is exact: a straight line to the limit, then in the plane the tractrix of a spring that
// drags its block, on which tan(a/2) falls by exp(-distance/D). A limit that shrinks with the load makes the
// block slip at once. The model has no static peak and does not depend on speed.
#pragma once

#include <array>

#include "tools/libraries/rivals/pair.hpp"

namespace rivals {

struct MaxwellSlip {
  static constexpr int elements = 10;

  Surface surface;
  /// Share of each spring in the whole stiffness, and the length at which it slips, over mu N / sigma0.
  std::array<double, elements> stiffness_share{0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1};
  std::array<double, elements> slip_length{0.1, 0.3, 0.5, 0.7, 0.9, 1.1, 1.3, 1.5, 1.7, 1.9};
  std::array<Pair, elements> z{};  ///< stretch of each element's spring, m

  Force step(Pair displacement, double dt_s, double load_n) noexcept;
};

}  // namespace rivals
