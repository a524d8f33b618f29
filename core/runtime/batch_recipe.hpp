// A recipe to make a batch with the patches and ids of another one, for Python's pickles and copies. Not
// installed; exported, because the Python module may load the shared library.
#pragma once

#include <cstdint>
#include <vector>

#include "bristle/patch_batch.hpp"

namespace bristle {

/// Options with which a patch was added, and its present material, without its state.
struct PatchRecipe {
  std::uint32_t slot = 0;
  std::uint32_t material = 0;  ///< index of the patch's material in BatchRecipe::materials
  PatchOptions options;        ///< options of the patch, with its seed when it was added
  double full_weight = 0.0;    ///< physical bristles per representative, by the material when the patch was
                               ///< added
};

/// Data from which a batch with equal ids, present and future, can be made.
struct BatchRecipe {
  std::vector<std::uint32_t> generations;  ///< last generation of each slot
  std::vector<std::uint32_t> free_slots;   ///< free slots in the order in which they were freed
  std::vector<Material> materials;
  std::vector<PatchRecipe> patches;  ///< recipes of the patches, in the order of their slots
};

/// Reads the recipe of a batch. No other thread may use the batch meanwhile.
BRISTLE_API BatchRecipe find_recipe(const PatchBatch& batch);
/// Adds the patches of a recipe to a new batch, out of contact, so that a saved state of the original batch
/// can be restored. Throws bristle::Error for a recipe that fits no batch.
BRISTLE_API void fill_batch(PatchBatch& empty, const BatchRecipe& recipe);
/// Returns the outputs that the steps of a patch compute; Outputs::end if there is no such patch. For the
/// stepping thread.
BRISTLE_API Outputs find_outputs(const PatchBatch& batch, PatchId id) noexcept;

}  // namespace bristle
