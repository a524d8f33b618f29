// Memory of the patches of a batch: a slot for each, in chunks that never move, so that pointers to patches
// stay valid while others are added.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/common/assert.hpp"
#include "core/patches/patch.hpp"

namespace bristle::detail {

// Returns the slot of an id. A PatchId consists of slot and generation. Each patch that a slot holds has a
// generation of its own, counted from 1, so an old id is recognised.
constexpr std::uint32_t slot_of(PatchId id) noexcept { return static_cast<std::uint32_t>(id.value) - 1; }
constexpr std::uint32_t generation_of(PatchId id) noexcept {
  return static_cast<std::uint32_t>(id.value >> 32);
}
constexpr PatchId make_id(std::uint32_t slot, std::uint32_t generation) noexcept {
  return {std::uint64_t{generation} << 32 | (std::uint64_t{slot} + 1)};
}

/// Copies those fields of a slot that must stay when its patch is rebuilt or gets another material.
inline void keep_place(Patch& made, const Patch& before) noexcept {
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

/// Block and lane that hold a slot's contact, if it is in a lane. A step needs no more to write the contact's
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
/// stepping thread puts it in place; no patch is copied when the pool grows.
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

/// Generations of all slots, and the list of free slots. Only the thread that adds and removes patches uses
/// it.
class SlotList {
 public:
  struct Slot {
    std::uint32_t number, generation;
  };
  static constexpr std::uint32_t last_generation = ~std::uint32_t{0};

  /// Takes the slot that was freed last, with a new generation, or a new slot if none is free. Throws
  /// std::bad_alloc.
  Slot take() {
    if (free_.empty()) {
      generations_.push_back(1);
      free_.reserve(generations_.capacity());  // reserves memory here, so that give_back() cannot fail
      return {static_cast<std::uint32_t>(generations_.size() - 1), 1};
    }
    const std::uint32_t slot = free_.back();
    free_.pop_back();
    return {slot, ++generations_[slot]};
  }
  /// Frees a slot for another patch. A slot that has used its last generation stays unused, so that no id is
  /// given twice.
  void give_back(std::uint32_t slot) noexcept {
    BRISTLE_ASSERT(slot < generations_.size() && free_.size() < free_.capacity());
    if (generations_[slot] != last_generation) free_.push_back(slot);
  }

  /// Takes `count` slots side by side, all with one new generation, and returns the first: part of a run that
  /// give_back_run() freed, or new slots. Throws std::bad_alloc.
  Slot take_run(std::uint32_t count) {
    runs_.reserve(runs_.size() + ++runs_taken_);  // reserves memory here, so that give_back_run() cannot fail
    for (auto run = runs_.begin(); run != runs_.end(); ++run) {
      if (run->count < count) continue;
      const auto first = generations_.begin() + run->first;
      const std::uint32_t generation = *std::max_element(first, first + count);
      if (generation == last_generation) continue;
      std::fill_n(first, count, generation + 1);
      const Slot taken{run->first, generation + 1};
      *run = {run->first + count, run->count - count};
      if (run->count == 0) runs_.erase(run);
      return taken;
    }
    const std::uint32_t first = size();
    generations_.resize(generations_.size() + count, 1);
    free_.reserve(generations_.capacity());
    return {first, 1};
  }
  /// Frees slots side by side for another take_run(). Merges neighbouring free runs.
  void give_back_run(std::uint32_t first, std::uint32_t count) noexcept {
    --runs_taken_;
    const auto next = std::find_if(runs_.begin(), runs_.end(), [=](const Run& r) { return r.first > first; });
    auto run = runs_.insert(next, {first, count});
    const auto join = [this](auto before) {
      const auto after = before + 1;
      if (after == runs_.end() || before->first + before->count != after->first) return;
      before->count += after->count;
      runs_.erase(after);
    };
    join(run);
    if (run != runs_.begin()) join(run - 1);
  }
  std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(generations_.size()); }
  std::uint32_t generation(std::uint32_t slot) const noexcept { return generations_[slot]; }
  /// Sets the generation of a slot, as if it had held that many patches. Tests of the last generation need
  /// it.
  void set_generation(std::uint32_t slot, std::uint32_t generation) noexcept {
    generations_[slot] = generation;
  }

 private:
  std::vector<std::uint32_t> generations_;
  std::vector<std::uint32_t> free_;
  struct Run {
    std::uint32_t first, count;
  };
  std::vector<Run> runs_;  ///< free runs of slots, in order
  std::size_t runs_taken_ = 0;
};

}  // namespace bristle::detail
