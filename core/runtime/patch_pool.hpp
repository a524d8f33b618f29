// Memory of the patches of a batch: a slot for each, in chunks that never move, so that pointers to patches
// stay valid while others are added.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <utility>

#include "core/common/assert.hpp"
#include "core/patches/patch.hpp"
#include "core/runtime/slot_list.hpp"

namespace bristle::detail {

/// Copies those fields of a slot that must stay when its patch is rebuilt or gets another material.
inline void keep_slot_fields(Patch& made, const Patch& before) noexcept {
  made.generation = before.generation;
  made.last_step = before.last_step;
  made.skips = before.skips;
}

/// Estimated cost of the next step of a slot's patch. It lies apart from the patch, so that work is divided
/// among threads without reading patches.
struct Outlook {
  /// Value of `bristles` for a contact in a lane. Such a contact costs nothing by itself, because its block
  /// is counted.
  static constexpr std::uint32_t in_lane = ~std::uint32_t{0};

  double normal_load = -1.0;   ///< load of the last step, N
  std::uint32_t bristles = 0;  ///< Patch::in_contact() under this load
  std::uint32_t last_counted =
      0;  ///< low bits of the number of the last step that named the slot; detects repeated ids
};

struct LaneBlock;

/// Block and lane of a slot's contact, if it is in a lane. A step needs no more to write the contact's
/// motion.
struct LaneAddress {
  LaneBlock* block = nullptr;  ///< null if the patch is in no lane
  std::uint32_t generation = 0, lane = 0;
};

struct PatchChunk {
  explicit PatchChunk(std::uint32_t slots)
      : patches(new Patch[slots]), outlooks(new Outlook[slots]), lanes(new LaneAddress[slots]) {}
  std::unique_ptr<Patch[]> patches;
  std::unique_ptr<Outlook[]> outlooks;
  std::unique_ptr<LaneAddress[]> lanes;
};

/// All slots of a batch, in chunks of 64, 64, 128, 256, ... slots. The adding thread makes a chunk and the
/// stepping thread links it; no patch is copied when the pool grows.
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
  /// Returns the number of slots of the chunk with this number.
  static constexpr std::uint32_t slots_of(int chunk) noexcept {
    return chunk == 0 ? first_slots : first_slots << (chunk - 1);
  }

  std::uint32_t capacity() const noexcept { return capacity_; }
  void put(int chunk, std::unique_ptr<PatchChunk> slots) noexcept {
    patches_[static_cast<std::size_t>(chunk)] = slots->patches.get();
    lanes_[static_cast<std::size_t>(chunk)] = slots->lanes.get();
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
  LaneAddress& lane(std::uint32_t slot) const noexcept {
    BRISTLE_ASSERT(slot < capacity_);
    const int chunk = chunk_of(slot);
    return lanes_[static_cast<std::size_t>(chunk)][slot - first_of(chunk)];
  }
  /// Looks up the patch of an id; null if no patch has it, because it was never given or its patch was
  /// removed.
  Patch* find(PatchId id) const noexcept {
    // Number of the slot. For PatchId{} it is the largest number, which no slot has.
    const std::uint32_t slot = slot_of(id);
    if (slot >= capacity_) return nullptr;
    Patch& p = patch(slot);
    return p.generation == generation_of(id) && p.generation != 0 ? &p : nullptr;
  }

 private:
  std::array<std::unique_ptr<PatchChunk>, most_chunks> chunks_;
  // Pointers to the arrays of each chunk, copied out of the chunks to save one look-up per patch.
  std::array<Patch*, most_chunks> patches_{};
  std::array<LaneAddress*, most_chunks> lanes_{};
  std::uint32_t capacity_ = 0;
};

}  // namespace bristle::detail
