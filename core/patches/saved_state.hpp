// The saved state of a batch and of its patches, as far as all contact models share it. The format of the
// bytes: core/patches/SAVED_STATE.md.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/common/hashing.hpp"
#include "core/patches/patch.hpp"

namespace bristle::detail {

/// Adds bytes to a checksum: eight at a time, the rest one by one.
void add_bytes(Hasher& hasher, Span<const std::byte> bytes) noexcept;

/// Head of the saved state of a batch; the patches follow in slot order.
struct SavedBatch {
  std::uint64_t bytes = 0;  ///< bytes of the whole saved state
  std::uint64_t patches = 0;
};
constexpr std::size_t saved_batch_size = 40;

/// Head of one saved patch; its contact and its model's state follow.
struct SavedPatch {
  std::uint32_t slot = 0, generation = 0;
  std::uint64_t signature = 0;  ///< hash of contact model, options and material, which must be that of the
                                ///< patch restored to
  std::uint64_t bytes = 0;      ///< size of this patch, head included
  std::uint64_t key = 0;        ///< key of the patch at present; a reset may have changed key and seed
  std::uint32_t seed = 0;
};
constexpr std::size_t saved_patch_size = 36;

/// Writes the head, with length and checksum, before patches that are already written. `state`: all bytes,
/// head included.
void seal_batch(const SavedBatch& head, Span<std::byte> state) noexcept;
/// Checks magic number, version, length and checksum. Throws bristle::Error.
SavedBatch open_batch(Span<const std::byte> state);

/// Returns the hash of the model's state, including the rounding remainder of short displacements if there is
/// one.
std::uint64_t hash_of(const Patch& patch) noexcept;

std::uint64_t signature_of(const Patch& patch) noexcept;
/// Returns the number of bytes of a saved patch. They depend on its options and material alone, so a large
/// enough buffer remains so.
std::size_t saved_size_of(const Patch& patch) noexcept;
void save_patch(const Patch& patch, std::uint32_t slot, std::byte* to) noexcept;
SavedPatch read_saved_patch(const std::byte* from) noexcept;
/// Checks saved_size_of(patch) bytes. Returns null, or the name of a value that no patch like this can have.
/// A checksum does not prove who wrote the bytes.
const char* find_fault_of(const Patch& patch, const std::byte* from) noexcept;
/// Checks the present patch as find_fault_of() checks bytes (mass and order of cohorts, counts, bounds of
/// bristles, blocks and sums). Returns null, or the name of a value that no patch can have. `room`:
/// saved_size_of(patch) bytes.
const char* find_present_fault(const Patch& patch, std::byte* room) noexcept;
/// Restores a patch from bytes in which find_fault_of() found nothing.
void restore_patch(Patch& patch, const std::byte* from) noexcept;

}  // namespace bristle::detail
