#include "tools/rivals/dahl.hpp"

#include "tools/rivals/relaxation.hpp"

namespace rivals {

Force Dahl::step(Pair displacement, double /*dt_s*/, double load_n) noexcept {
  if (!(load_n > 0.0)) {
    z = {};
    return {};
  }
  const double way = length(displacement);
  Relaxed r{z, z};
  if (way > 0.0) {
    const double zc = surface.kinetic_coefficient * load_n / surface.stiffness;
    r = relax(z, (zc / way) * displacement, way / zc);
  }
  z = r.end;
  return {-surface.stiffness * r.end, -surface.stiffness * r.mean};
}

}  // namespace rivals
