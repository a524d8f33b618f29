// The way into a batch for contact models that make_patch.cpp does not know: tests of the seam.
#pragma once

#include "bristle/patch_batch.hpp"
#include "core/patches/patch.hpp"

namespace bristle::detail {

struct BatchAccess {
  /// Adds a patch that was made already, out of contact; the batch owns its record from now on. Same thread
  /// rule as PatchBatch::add. Throws std::bad_alloc.
  static PatchId add(PatchBatch& batch, const Patch& made);
};

}  // namespace bristle::detail
