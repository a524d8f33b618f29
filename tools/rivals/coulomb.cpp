#include "tools/rivals/coulomb.hpp"

#include <algorithm>

namespace rivals {

Force Coulomb::step(Pair displacement, double dt_s, double load_n) noexcept {
  if (!(load_n > 0.0)) return {};
  const Pair v = (1.0 / dt_s) * displacement;
  const double per_speed = load_n * surface.kinetic_coefficient / std::max(length(v), creep_velocity);
  const Pair force = -(per_speed + surface.viscous_friction) * v;
  return {force, force};
}

}  // namespace rivals
