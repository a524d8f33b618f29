// Switches skipping off in a batch: for tests that compare steps with and without it, and to measure what
// skipping saves.
#pragma once

#include "core/runtime/batch_access.hpp"
#include "core/runtime/batch_impl.hpp"

namespace bristle::detail {

/// Makes patches that are added to the batch from now on visit every bristle in every step: slower, with the
/// same bits. Thread rule: as PatchBatch::add.
inline void visit_all(PatchBatch& batch) noexcept { BatchAccess::inside(batch).skips = false; }

}  // namespace bristle::detail
