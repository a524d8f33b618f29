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
class BRISTLE_API KeyedBeds {
 public:
  /// Makes a pool of options.capacity beds, which it adds to the batch. Throws bristle::Error.
  KeyedBeds(BedBatch& beds, const BedMaterial& material, const BedShape& shape, const BedOptions& bed,
            const KeyedOptions& options = {});
  ~KeyedBeds();  ///< removes the pool's beds from the batch
  KeyedBeds(KeyedBeds&&) noexcept;
  KeyedBeds& operator=(KeyedBeds&&) noexcept;

  /// @name Calls that work as in KeyedPatches.
  ///@{
  BedId find_or_add(std::uint64_t key) noexcept;
  BedId find(std::uint64_t key) const noexcept;
  void reserve(std::uint32_t beds);
  bool remove(std::uint64_t key) noexcept;
  void clear() noexcept;
  std::uint32_t end_step() noexcept;
  std::uint32_t size() const noexcept;
  std::uint64_t refused() const noexcept;
  ///@}

  /// Returns the number of bytes that save_state writes, constant: the record of which contact has which bed.
  /// Save the batch beside it and restore both. A bed does not know its key, so nothing checks that pool and
  /// batch belong together. Otherwise as in KeyedPatches.
  std::size_t state_size() const noexcept;
  std::size_t save_state(Span<std::byte> to) const noexcept;
  void restore_state(Span<const std::byte> from);

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace bristle
