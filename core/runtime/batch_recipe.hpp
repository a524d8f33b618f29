// A batch with the same patches under the same ids as another one: what Python's pickles and copies are made
// of. Not installed; exported, because the Python module may load the shared library.
#pragma once

#include <cstdint>
#include <vector>

#include "bristle/patch_batch.hpp"

namespace bristle {

/// A patch as it was made, not its state.
struct PatchRecipe {
  std::uint32_t slot = 0;
  std::uint32_t material = 0;  ///< index into BatchRecipe::materials
  PatchOptions options;        ///< with the seed that it was added with
  double full_weight = 0.0;  ///< physical bristles per representative, of the material that it was added with
};

/// Data from which a batch with the same ids, present and future, can be made.
struct BatchRecipe {
  std::vector<std::uint32_t> generations;  ///< of each slot, the last one given
  std::vector<std::uint32_t> free_slots;   ///< in the order in which they were given back
  std::vector<Material> materials;
  std::vector<PatchRecipe> patches;  ///< by slot
};

/// Reads the recipe of a batch. No other thread may use the batch meanwhile.
BRISTLE_API BatchRecipe find_recipe(const PatchBatch& batch);
/// Adds the patches of a recipe to a new batch, out of contact: a saved state of the batch that the recipe is
/// of can then be restored. Throws bristle::Error where it is none of a batch.
BRISTLE_API void fill_batch(PatchBatch& empty, const BatchRecipe& recipe);
/// Outputs that the steps of a patch compute; Outputs::end where there is no such patch. For the stepping
/// thread.
BRISTLE_API Outputs find_outputs(const PatchBatch& batch, PatchId id) noexcept;

}  // namespace bristle
