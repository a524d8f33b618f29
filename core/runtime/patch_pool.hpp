// Memory of the patches of a batch: slots side by side, in chunks that never move.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/common/assert.hpp"
#include "core/patches/patch.hpp"

namespace bristle::detail {

// Returns the slot of an id. A PatchId is slot and generation; each patch that a slot holds has a generation
// of its own, counted from 1.
constexpr std::uint32_t slot_of(PatchId id) noexcept { return static_cast<std::uint32_t>(id.value) - 1; }
constexpr std::uint32_t generation_of(PatchId id) noexcept {
  return static_cast<std::uint32_t>(id.value >> 32);
}
constexpr PatchId make_id(std::uint32_t slot, std::uint32_t generation) noexcept {
  return {std::uint64_t{generation} << 32 | (std::uint64_t{slot} + 1)};
}

/// Copies the fields of a slot that stay when its patch is rebuilt or gets another material.
inline void keep_place(Patch& made, const Patch& before) noexcept {
  made.generation = before.generation;
  made.last_step = before.last_step;
  made.skips = before.skips;
}

/// Estimated cost of the next step of a slot's patch, by which work is shared out without reading patches.
struct Outlook {
  /// Value of `bristles` for a contact in a lane: its block has the cost.
  static constexpr std::uint32_t in_lane = ~std::uint32_t{0};

  double normal_load = -1.0;   ///< N, load of the last step
  std::uint32_t bristles = 0;  ///< Patch::in_contact() under this load
  std::uint32_t last_counted =
      0;  ///< low bits of the number of the last step that named the slot; detects repeated ids
};

struct PatchChunk {
  explicit PatchChunk(std::uint32_t slots) : patches(new Patch[slots]), outlooks(new Outlook[slots]) {}
  std::unique_ptr<Patch[]> patches;
  std::unique_ptr<Outlook[]> outlooks;
};

/// Chunks of 64, 64, 128, 256, ... slots. A chunk is made by the thread that adds patches and put in place by
/// the stepping thread: nothing is copied.
class PatchPool {
 public:
  static constexpr std::uint32_t first_slots = 64;
  static constexpr int most_chunks = 27;

  static constexpr int chunk_of(std::uint32_t slot) noexcept {
    return slot < first_slots ? 0 : static_cast<int>(std::bit_width(slot)) - 6;
  }
  static constexpr std::uint32_t first_of(int chunk) noexcept {
    return chunk == 0 ? 0 : first_slots << (chunk - 1);
  }
  /// Returns the number of slots of a chunk.
  static constexpr std::uint32_t slots_of(int chunk) noexcept {
    return chunk == 0 ? first_slots : first_slots << (chunk - 1);
  }

  std::uint32_t capacity() const noexcept { return capacity_; }
  void put(int chunk, std::unique_ptr<PatchChunk> slots) noexcept {
    patches_[static_cast<std::size_t>(chunk)] = slots->patches.get();
    chunks_[static_cast<std::size_t>(chunk)] = std::move(slots);
    capacity_ = first_of(chunk) + slots_of(chunk);
  }
  Patch& patch(std::uint32_t slot) const noexcept {
    BRISTLE_ASSERT(slot < capacity_);
    const int chunk = chunk_of(slot);
    return patches_[static_cast<std::size_t>(chunk)][slot - first_of(chunk)];
  }
  Outlook& outlook(std::uint32_t slot) const noexcept {
    const int chunk = chunk_of(slot);
    return chunks_[static_cast<std::size_t>(chunk)]->outlooks[slot - first_of(chunk)];
  }
  /// Returns the patch of an id, null if there is none.
  Patch* find(PatchId id) const noexcept {
    const std::uint32_t slot = slot_of(id);  // number of the slot; for PatchId{} the largest number, which
                                             // no slot has
    if (slot >= capacity_) return nullptr;
    Patch& p = patch(slot);
    return p.generation == generation_of(id) && p.generation != 0 ? &p : nullptr;
  }

 private:
  std::array<std::unique_ptr<PatchChunk>, most_chunks> chunks_;
  std::array<Patch*, most_chunks> patches_{};  ///< patches of each chunk, copied here to save one look-up
  std::uint32_t capacity_ = 0;
};

/// Generations of all slots, and the free slots, on the side of the thread that adds patches.
class SlotList {
 public:
  struct Slot {
    std::uint32_t number, generation;
  };
  static constexpr std::uint32_t last_generation = ~std::uint32_t{0};

  /// Returns the slot freed last, under a new generation, or else a fresh slot. Throws std::bad_alloc.
  Slot take() {
    if (free_.empty()) {
      generations_.push_back(1);
      free_.reserve(generations_.capacity());  // reserved here, so that give_back() cannot fail
      return {static_cast<std::uint32_t>(generations_.size() - 1), 1};
    }
    const std::uint32_t slot = free_.back();
    free_.pop_back();
    return {slot, ++generations_[slot]};
  }
  /// Frees a slot, unless it has used its last generation: no id is given twice.
  void give_back(std::uint32_t slot) noexcept {
    BRISTLE_ASSERT(slot < generations_.size() && free_.size() < free_.capacity());
    if (generations_[slot] != last_generation) free_.push_back(slot);
  }
  std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(generations_.size()); }
  std::uint32_t generation(std::uint32_t slot) const noexcept { return generations_[slot]; }
  /// Sets the generation of a slot, as if it had held so many patches. For tests.
  void set_generation(std::uint32_t slot, std::uint32_t generation) noexcept {
    generations_[slot] = generation;
  }

 private:
  std::vector<std::uint32_t> generations_;
  std::vector<std::uint32_t> free_;
};

}  // namespace bristle::detail
