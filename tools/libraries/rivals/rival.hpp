// The interface of all rivals, the friction models that are compared with the brush.
#pragma once

#include <string_view>
#include <variant>

#include "tools/libraries/rivals/coulomb.hpp"
#include "tools/libraries/rivals/dahl.hpp"
#include "tools/libraries/rivals/elasto_plastic.hpp"
#include "tools/libraries/rivals/generalised_maxwell_slip.hpp"
#include "tools/libraries/rivals/lugre.hpp"
#include "tools/libraries/rivals/maxwell_slip.hpp"
#include "tools/libraries/rivals/rate_state.hpp"

namespace rivals {

/// Friction model with its parameters and state: plain data, so that a copy can try a step.
using Rival =
    std::variant<Coulomb, Dahl, LuGre, ElastoPlastic, MaxwellSlip, GeneralisedMaxwellSlip, RateState>;

/// Moves the body by `displacement` (m) in dt_s > 0 at constant velocity under load_n >= 0 (N). Returns the
/// force on the moving body. Without load there is no force, and the state is reset. Never allocates or
/// throws.
inline Force step(Rival& rival, Pair displacement, double dt_s, double load_n) noexcept {
  return std::visit([&](auto& model) { return model.step(displacement, dt_s, load_n); }, rival);
}

/// Returns the force that step() would give and leaves the state as it is; for implicit solvers.
inline Force find_force(const Rival& rival, Pair displacement, double dt_s, double load_n) noexcept {
  return std::visit([&](auto model) { return model.step(displacement, dt_s, load_n); }, rival);
}

inline constexpr std::string_view rival_names[] = {"coulomb",      "dahl", "lugre",     "elasto_plastic",
                                                   "maxwell_slip", "gms",  "rate_state"};

/// Makes the friction model of this name, at rest and without deflection. Throws std::invalid_argument if
/// there is none.
Rival make_rival(std::string_view name, const Surface& surface);

}  // namespace rivals
