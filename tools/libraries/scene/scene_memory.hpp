// Estimates the memory that a scene needs, so that a scene that is too large is refused before anything is
// allocated.
#pragma once

#include <cstdint>

#include "tools/libraries/scene/scene.hpp"

namespace cli {

/// Returns the bytes that a scene's patches and its run's results need, right within some per cent.
std::uint64_t estimate_memory(const Scene& scene);

/// Checks that a scene fits into memory. Throws UserError if it needs more than Scene::limits allows or,
/// without that limit, more than is free.
void check_memory(const Scene& scene);

}  // namespace cli
