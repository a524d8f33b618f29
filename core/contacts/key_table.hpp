// A hash table of fixed size from 64-bit keys to small numbers (open addressing, linear probing), for pools
// by key. Erasing a key moves later entries up and leaves no mark, so searches do not slow down however many
// keys came and went.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/common/assert.hpp"

namespace bristle::detail {

/// Spreads keys evenly over the table by SplitMix64's finaliser, a bijection whose every output bit depends
/// on every input bit.
constexpr std::uint64_t mix_key(std::uint64_t x) noexcept {
  x += 0x9E3779B97F4A7C15u;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

class KeyTable {
 public:
  static constexpr std::uint32_t none = 0xFFFFFFFFu;

  /// Makes a table for up to `keys` keys. They leave it at most half full, so that searches are short.
  explicit KeyTable(std::size_t keys) {
    std::size_t size = 16;
    while (size < 2 * keys) size *= 2;
    slots_.resize(size);
    mask_ = size - 1;
  }

  std::uint32_t find(std::uint64_t key) const noexcept { return slots_[index_of(key)].value; }

  /// Inserts the pair of a key that is not in the table and a `value`, which must not be `none`.
  void insert(std::uint64_t key, std::uint32_t value) noexcept {
    Slot& slot = slots_[index_of(key)];
    BRISTLE_ASSERT(value != none);
    BRISTLE_ASSERT(slot.value == none);
    BRISTLE_ASSERT(2 * (keys_ + 1) <= slots_.size());
    slot = {key, value};
    ++keys_;
  }

  /// Erases a key; does nothing if it is not in the table.
  void erase(std::uint64_t key) noexcept {
    std::size_t hole = index_of(key);
    if (slots_[hole].value == none) return;
    for (std::size_t at = next(hole); slots_[at].value != none; at = next(at)) {
      // Moves an entry into the hole before it if the hole lies between the entry's first slot and its
      // present one. Otherwise a search would stop at the hole and miss the entry.
      const std::size_t home = home_of(slots_[at].key);
      if (((at - home) & mask_) < ((at - hole) & mask_)) continue;
      slots_[hole] = slots_[at];
      hole = at;
    }
    slots_[hole].value = none;
    --keys_;
  }

 private:
  struct Slot {
    std::uint64_t key = 0;
    std::uint32_t value = none;
  };

  std::size_t home_of(std::uint64_t key) const noexcept {
    return static_cast<std::size_t>(mix_key(key)) & mask_;
  }
  std::size_t next(std::size_t index) const noexcept { return (index + 1) & mask_; }
  /// Searches the slot in which the key is stored. If the key is not in the table, returns the empty slot
  /// into which it would be inserted.
  std::size_t index_of(std::uint64_t key) const noexcept {
    std::size_t at = home_of(key);
    while (slots_[at].value != none && slots_[at].key != key) at = next(at);
    return at;
  }

  std::vector<Slot> slots_;
  std::size_t mask_;
  std::size_t keys_ = 0;
};

}  // namespace bristle::detail
