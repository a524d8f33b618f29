// The memory that a scene takes, told before it is taken.
#pragma once

#include <cstdint>

#include "tools/scene/scene.hpp"

namespace cli {

/// Bytes of all patches and of what a run keeps for each, within some per cent; rounded up to whole patches.
std::uint64_t estimate_memory(const Scene& scene);

/// Throws UserError where a scene needs more than Scene::limits give, or, without a limit, than is free.
void check_memory(const Scene& scene);

}  // namespace cli
