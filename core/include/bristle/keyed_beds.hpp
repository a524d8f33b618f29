// Beds found by key, for engines that list their contacts again in every step: what keyed_patches.hpp does
// for patches. The contact point of a ball or a wheel comes and goes as it rolls, so let the key name the
// pair of bodies, or match points in a frame that does not turn with them.
#pragma once

#include "bristle/bed.hpp"
#include "bristle/keyed_patches.hpp"

namespace bristle {

/// A pool of beds of one kind, found by key. The bed of a new key is as BedBatch::reset leaves it: unbent,
/// out of contact. KeyedOptions::seed_from_key has no effect.
///
/// Thread rule: one side (PatchBatch). The batch must outlive the pool and must not be moved. Nothing
/// allocates but making it, destroying it, reserve and restore_state.
class BRISTLE_API KeyedBeds : public KeyedPool {
 public:
  /// Makes a pool of options.capacity beds, which it adds to the batch. Throws bristle::Error.
  KeyedBeds(BedBatch& beds, const BedMaterial& material, const BedShape& shape, const BedOptions& bed,
            const KeyedOptions& options = {});

  // Work as in KeyedPatches.
  BedId find_or_add(std::uint64_t key) noexcept;
  BedId find(std::uint64_t key) const noexcept;
};

}  // namespace bristle
