// The saved state of a batch of patches, as far as it is the same for all contact models.
// core/patches/SAVED_STATE.md has the format of the bytes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/patches/patch.hpp"

namespace bristle::detail {

/// Head of one saved patch. The fields that all contact models share follow it, then the model's own.
struct SavedPatch {
  std::uint32_t slot = 0, generation = 0;
  /// Hash of contact model, options and material. A state is restored only to a patch with the same hash.
  std::uint64_t signature = 0;
  std::uint64_t bytes = 0;  ///< size of the saved patch, with this head
  std::uint64_t key = 0;    ///< present key of the patch, the one that its last reset gave
  std::uint32_t seed = 0;
};
constexpr std::size_t saved_patch_size = 36;

/// Returns a hash of the patch's state: that of the contact model and, if the patch has them, its lay and the
/// rounding remainder of short displacements.
std::uint64_t hash_of(const Patch& patch) noexcept;

std::uint64_t signature_of(const Patch& patch) noexcept;
/// Returns the number of bytes of a saved patch. It depends on options and material alone, so a buffer that
/// was large enough once stays large enough.
std::size_t saved_size_of(const Patch& patch) noexcept;
void save_patch(const Patch& patch, std::uint32_t slot, std::byte* to) noexcept;
SavedPatch read_saved_patch(const std::byte* from) noexcept;
/// Checks the values in a saved patch. Returns null, or the name of a value that no patch with these options
/// can have. The checksum is no proof that bristle wrote the bytes, and a wrong value could crash a later
/// step.
const char* find_fault_of(const Patch& patch, const std::byte* from) noexcept;
/// Checks the present state of a patch, for asserts, by saving it and calling find_fault_of(): ranges of
/// values, counts, shares of cohorts. Returns null, or the name of a value that no patch can have. `room`:
/// memory of saved_size_of(patch) bytes.
const char* find_present_fault(const Patch& patch, std::byte* room) noexcept;
/// Restores a patch from bytes in which find_fault_of() has found nothing.
void restore_patch(Patch& patch, const std::byte* from) noexcept;

}  // namespace bristle::detail
