// Finds which outputs a patch computes, for the Python module. Not an installed header; exported all the
// same, because the module may be linked to the shared library.
#pragma once

#include "bristle/patch_batch.hpp"

namespace bristle {

/// Returns the outputs that a patch was added with (PatchOptions); Outputs::end if there is no such patch.
/// For the stepping thread.
BRISTLE_API Outputs find_outputs(const PatchBatch& batch, PatchId id) noexcept;

}  // namespace bristle
