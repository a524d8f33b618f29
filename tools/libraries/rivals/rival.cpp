#include "tools/libraries/rivals/rival.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "tools/libraries/rivals/relaxation.hpp"

namespace rivals {

Force Coulomb::step(Pair displacement, double dt_s, double load_n) noexcept {
  if (!(load_n > 0.0)) return {};
  const Pair v = (1.0 / dt_s) * displacement;
  const double per_speed = load_n * surface.kinetic_coefficient / std::max(length(v), creep_velocity);
  const Pair force = -(per_speed + surface.viscous_friction) * v;
  return {force, force};
}

Force Dahl::step(Pair displacement, double /*dt_s*/, double load_n) noexcept {
  if (!(load_n > 0.0)) {
    z = {};
    return {};
  }
  const double path = length(displacement);
  Relaxed r{z, z};
  if (path > 0.0) {
    const double zc = surface.kinetic_coefficient * load_n / surface.stiffness;
    r = relax(z, (zc / path) * displacement, path / zc);
  }
  z = r.end;
  return {-surface.stiffness * r.end, -surface.stiffness * r.mean};
}

Rival make_rival(std::string_view name, const Surface& surface) {
  if (name == "coulomb") return Coulomb{.surface = surface};
  if (name == "dahl") return Dahl{.surface = surface, .z = {}};
  if (name == "lugre") return LuGre{.surface = surface, .z = {}};
  if (name == "elasto_plastic") return ElastoPlastic{.surface = surface, .z = {}};
  if (name == "maxwell_slip") return MaxwellSlip{.surface = surface};
  if (name == "gms") return GeneralisedMaxwellSlip{.surface = surface};
  if (name == "rate_state") return RateState{.surface = surface, .z = {}};
  throw std::invalid_argument("no rival model is called " + std::string(name));
}

}  // namespace rivals
