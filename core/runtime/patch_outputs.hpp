// The outputs that a patch computes, for the Python module. Not installed; exported, because the module may
// load the shared library.
#pragma once

#include "bristle/patch_batch.hpp"

namespace bristle {

/// Returns the outputs that the steps of a patch compute; Outputs::end if there is no such patch. For the
/// stepping thread.
BRISTLE_API Outputs find_outputs(const PatchBatch& batch, PatchId id) noexcept;

}  // namespace bristle
