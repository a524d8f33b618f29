// Ways into a batch that programs do not have: for contact models that make_patch.cpp does not know (tests of
// the seam), and for another batch with the same patches under the same ids (Python's pickles and copies).
#pragma once

#include <cstdint>
#include <vector>

#include "bristle/patch_batch.hpp"
#include "core/patches/patch.hpp"

namespace bristle::detail {

/// A patch as it was made, not its state.
struct PatchRecipe {
  std::uint32_t slot = 0;
  std::uint32_t material = 0;  ///< index into BatchRecipe::materials
  PatchOptions options;        ///< with the seed that it was added with
  double full_weight = 0.0;    ///< PatchRecord::full_weight: of the material that it was added with
};

/// What makes a batch with the same ids, those given in future included.
struct BatchRecipe {
  std::vector<std::uint32_t> generations;  ///< of each slot, the last one given
  std::vector<std::uint32_t> free_slots;   ///< in the order in which they were given back
  std::vector<Material> materials;
  std::vector<PatchRecipe> patches;  ///< by slot
};

struct BatchAccess {
  /// Adds a patch that was made already, out of contact; the batch owns its record from now on. Same thread
  /// rule as PatchBatch::add. Throws std::bad_alloc.
  static PatchId add(PatchBatch& batch, const Patch& made);

  /// What the steps of a patch compute; Outputs::end where there is no such patch. For the stepping thread.
  BRISTLE_API static Outputs outputs(const PatchBatch& batch, PatchId id) noexcept;

  /// No other thread may use the batch meanwhile.
  BRISTLE_API static BatchRecipe recipe(const PatchBatch& batch);
  /// Adds the patches of a recipe to a new batch, out of contact: a saved state of the batch that the recipe
  /// is of can then be restored. Throws bristle::Error where it is none of a batch.
  BRISTLE_API static void fill(PatchBatch& empty, const BatchRecipe& recipe);
};

}  // namespace bristle::detail
