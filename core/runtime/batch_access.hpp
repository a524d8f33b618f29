// Access to a batch for contact models that make_patch.cpp does not know (tests of the seam), and for
// batch_recipe.hpp.
#pragma once

#include "bristle/patch_batch.hpp"
#include "core/patches/patch.hpp"
#include "core/runtime/batch_recipe.hpp"

namespace bristle::detail {

struct BatchAccess {
  /// Adds a patch that was made already, out of contact; the batch owns its record from now on. Same thread
  /// rule as PatchBatch::add. Throws std::bad_alloc.
  static PatchId add(PatchBatch& batch, const Patch& made);

  /// For who steps patches of a batch before a step of it: takes what was added and removed since. Pointers
  /// from `find` hold until the step. Trials are forgotten.
  static void begin_step(PatchBatch& batch) noexcept;
  static Patch* find(PatchBatch& batch, PatchId id) noexcept;

  // The functions of batch_recipe.hpp.
  static Outputs outputs(const PatchBatch& batch, PatchId id) noexcept;
  static BatchRecipe recipe(const PatchBatch& batch);
  static void fill(PatchBatch& empty, const BatchRecipe& recipe);
};

}  // namespace bristle::detail
