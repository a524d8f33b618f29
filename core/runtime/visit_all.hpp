// Switches off the skipping of bristles that cannot snap: for tests that compare steps with and without it,
// and to measure what it saves.
#pragma once

#include "core/runtime/batch_access.hpp"
#include "core/runtime/batch_impl.hpp"

namespace bristle::detail {

/// Makes patches that are added from now on visit every bristle in every step. Slower, but bit for bit the
/// same results. Thread rule: as PatchBatch::add.
inline void visit_all(PatchBatch& batch) noexcept { BatchAccess::inside(batch).skips = false; }

}  // namespace bristle::detail
