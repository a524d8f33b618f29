// All rival models behind one plain interface.
#pragma once

#include <string_view>
#include <variant>

#include "tools/rivals/coulomb.hpp"
#include "tools/rivals/dahl.hpp"
#include "tools/rivals/elasto_plastic.hpp"
#include "tools/rivals/generalised_maxwell_slip.hpp"
#include "tools/rivals/lugre.hpp"
#include "tools/rivals/maxwell_slip.hpp"
#include "tools/rivals/rate_state.hpp"

namespace rivals {

/// A model with its parameters and its state: plain data, copied to try a step.
using Rival =
    std::variant<Coulomb, Dahl, LuGre, ElastoPlastic, MaxwellSlip, GeneralisedMaxwellSlip, RateState>;

/// Moves the body by `displacement` (m) in dt_s > 0 at constant velocity under load_n >= 0 (N).
/// Force on the moving body. No load, no force, and no memory. Never allocates or throws.
inline Force step(Rival& rival, Pair displacement, double dt_s, double load_n) noexcept {
  return std::visit([&](auto& model) { return model.step(displacement, dt_s, load_n); }, rival);
}

/// Returns the force that step() would give, state unchanged: for implicit solvers.
inline Force find_force(const Rival& rival, Pair displacement, double dt_s, double load_n) noexcept {
  return std::visit([&](auto model) { return model.step(displacement, dt_s, load_n); }, rival);
}

inline constexpr std::string_view rival_names[] = {"coulomb",      "dahl", "lugre",     "elasto_plastic",
                                                   "maxwell_slip", "gms",  "rate_state"};

/// At rest, nothing bent. Throws std::invalid_argument where there is no such name.
Rival make_rival(std::string_view name, const Surface& surface);

}  // namespace rivals
