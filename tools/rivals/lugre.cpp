#include "tools/rivals/lugre.hpp"

#include "tools/rivals/relaxation.hpp"

namespace rivals {

Force LuGre::step(Pair displacement, double dt_s, double load_n) noexcept {
  if (!(load_n > 0.0)) {
    z = {};
    return {};
  }
  const Pair v = (1.0 / dt_s) * displacement;
  const double way = length(displacement);
  const double zss = surface.stribeck_force(way / dt_s, load_n) / surface.stiffness;
  Relaxed r{z, z};
  if (way > 0.0) r = relax(z, (zss / way) * displacement, way / zss);
  const Pair mean_rate = (1.0 / dt_s) * (r.end - z);
  const Pair end_rate = v - (way / dt_s / zss) * r.end;
  z = r.end;
  const Surface& s = surface;
  return {-(s.stiffness * r.end + s.damping * end_rate + s.viscous_friction * v),
          -(s.stiffness * r.mean + s.damping * mean_rate + s.viscous_friction * v)};
}

}  // namespace rivals
