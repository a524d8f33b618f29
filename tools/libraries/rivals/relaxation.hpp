// Solves dz/dt = (target - z) rate exactly over a step, the equation of several models of this folder.
#pragma once

#include <cmath>

#include "tools/libraries/rivals/pair.hpp"

namespace rivals {

struct Relaxed {
  Pair end, mean;  ///< relaxed z at the end of the step, and mean of z over the step
};

/// Relaxes z towards the target for rate times duration `q`, >= 0. The result lies between z and target for
/// any q, so a step of any length is stable.
inline Relaxed relax(Pair z, Pair target, double q) noexcept {
  const double lost = -std::expm1(-q);  // 1 - exp(-q), share of the path to target
  // Average of exp(-rate t) over the duration of the step, from which the mean of z follows.
  const double mean_left = q > 1e-8 ? lost / q : 1.0 - 0.5 * q;
  const Pair away = z - target;
  return {z - lost * away, target + mean_left * away};
}

/// Returns how far z can move along the unit vector `along` before it leaves the disc |z| <= limit. If its
/// path misses the disc, returns the distance to the point closest to it.
inline double path_to_limit(Pair z, Pair along, double limit) noexcept {
  const double s = dot(z, along);
  const double aside = z.x * along.y - z.y * along.x;
  return std::fmax(std::sqrt(std::fmax(limit * limit - aside * aside, 0.0)) - s, 0.0);
}

}  // namespace rivals
