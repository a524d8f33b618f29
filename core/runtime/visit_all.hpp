// Switches skipping off in a batch, for tests that compare lazy with eager stepping, and to measure what
// skipping saves.
#pragma once

#include "core/runtime/batch_access.hpp"
#include "core/runtime/batch_impl.hpp"

namespace bristle::detail {

/// Makes patches that are added to the batch from now on visit every bristle in every step: slower, the same
/// bits. Thread rule: as PatchBatch::add.
inline void visit_all(PatchBatch& batch) noexcept { BatchAccess::inside(batch).skips = false; }

}  // namespace bristle::detail
