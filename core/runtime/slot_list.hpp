// Ids of the objects of a batch (patches, outlines, beds), and the slots that the ids name.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bristle/patch.hpp"

#include "core/common/assert.hpp"

namespace bristle::detail {

// Convert between an id and its slot and generation. Each object that takes a slot gets a new generation,
// counted from 1, so the id of a removed one is recognised.
template <class Id>
constexpr std::uint32_t slot_of(Id id) noexcept {
  return static_cast<std::uint32_t>(id.value) - 1;
}
template <class Id>
constexpr std::uint32_t generation_of(Id id) noexcept {
  return static_cast<std::uint32_t>(id.value >> 32);
}
template <class Id = PatchId>
constexpr Id make_id(std::uint32_t slot, std::uint32_t generation) noexcept {
  return {std::uint64_t{generation} << 32 | (std::uint64_t{slot} + 1)};
}

/// Returns why no object has this id: no_capacity for the id that a full pool returns (KeyedPatches),
/// unknown_id for an id that was never added or is removed.
constexpr Status why_missing(std::uint64_t id) noexcept {
  return id == PatchId::no_capacity().value ? Status::no_capacity : Status::unknown_id;
}

/// Objects by their slots, for the thread that steps them. A slot whose object has generation 0 is free.
template <class T>
struct SlotTable {
  std::vector<T> at;

  /// Looks up the object of an id; null if it was never added, or was removed.
  template <class Id>
  T* find(Id id) noexcept {
    const std::uint32_t slot = slot_of(id);
    if (slot >= at.size() || at[slot].generation == 0) return nullptr;
    return at[slot].generation == generation_of(id) ? &at[slot] : nullptr;
  }
  std::uint32_t slot(const T& object) const noexcept {
    return static_cast<std::uint32_t>(&object - at.data());
  }
  /// Calls visit(object) for each object, in the order of slots.
  template <class Visit>
  void for_each(Visit&& visit) {
    for (T& object : at)
      if (object.generation != 0) visit(object);
  }
};

/// Generations of all slots, and the list of free slots. Only the thread that adds and removes uses it.
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
  /// Sets the generation of a slot, which counts the objects that took it. Tests of the last generation need
  /// this.
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
