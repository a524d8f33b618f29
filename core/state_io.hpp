// State of a patch as bytes and as a hash.
#pragma once

#include <cstddef>
#include <cstdint>

#include "patch_state.hpp"

namespace bristle::detail {

/// Hash of what the future of a patch depends on, in bristle order: deflections, block displacements,
/// snap lengths, draw states, counts, material. No cache, no sums, no padding.
std::uint64_t hash_patch(const PatchState& patch) noexcept;

/// Head of one patch in a saved state; the columns follow.
struct SavedPatch {
  std::uint32_t slot, generation;
  std::uint64_t signature;  ///< of options, weight and material: what must agree
  std::uint64_t storage_bytes;
  std::uint64_t key;  ///< with the seed: a reset may have changed both
  std::uint32_t seed;
  PatchContact contact;
};

std::uint64_t signature(const PatchState& patch) noexcept;
void save_patch(const PatchState& patch, std::uint32_t slot, std::uint32_t generation,
                std::byte* to) noexcept;
std::size_t saved_size(const PatchState& patch) noexcept;
/// `from` was checked against the patch.
void restore_patch(PatchState& patch, const std::byte* from) noexcept;

}  // namespace bristle::detail
