// Estimates the memory of a scene before it is allocated.
#pragma once

#include <cstdint>

#include "tools/scene/scene.hpp"

namespace cli {

/// Returns the bytes that all patches and the results of a run need, within some per cent.
std::uint64_t estimate_memory(const Scene& scene);

/// Checks that a scene fits into memory. Throws UserError if it needs more than Scene::limits allow or,
/// without a limit, more than is free.
void check_memory(const Scene& scene);

}  // namespace cli
