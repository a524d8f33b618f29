// Estimates the memory of a scene before it is allocated.
#pragma once

#include <cstdint>

#include "tools/scene/scene.hpp"

namespace cli {

/// Returns the bytes of all patches and of what a run keeps for each, within some per cent, rounded up to
/// whole patches.
std::uint64_t estimate_memory(const Scene& scene);

/// Checks memory. Throws UserError if a scene needs more than Scene::limits allow or, without a limit, than
/// is free.
void check_memory(const Scene& scene);

}  // namespace cli
