#include "tools/rivals/rival.hpp"

#include <stdexcept>
#include <string>

namespace rivals {

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
