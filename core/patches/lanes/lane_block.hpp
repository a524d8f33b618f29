// Blocks of sixteen contacts, one in each lane, and their places. Contacts of equal material and options
// share blocks, whatever the order in which they were added; each is a patch of its own (Patch::in_lane). A
// contact model with contacts in lanes derives its block from LaneBlock; slide_block.hpp is one.
#pragma once

#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "core/lane_table.hpp"
#include "core/patches/columns.hpp"

namespace bristle::detail {

/// Answers of a step of sixteen contacts.
struct LaneAnswers {
  LaneColumn<double> end[2], mean[2], stiffness, dissipated, contact_loss, slid;

  LaneOutput columns() noexcept {
    return {{end[0].lane, end[1].lane},
            {mean[0].lane, mean[1].lane},
            stiffness.lane,
            dissipated.lane,
            contact_loss.lane,
            slid.lane};
  }
};

/// The motions of a block's contacts in one step.
struct LaneMotions {
  LaneColumn<double> displacement[2]{}, load{}, start{};
  double duration = 0.0;
  std::uint32_t named = 0;              ///< bits of the lanes with a motion
  std::uint32_t item[lane_count] = {};  ///< number of each lane's motion in the step

  LaneInput input(bool stores) const noexcept {
    return {{displacement[0].lane, displacement[1].lane}, load.lane, start.lane, duration, named, stores};
  }
};

/// Sixteen contacts. Only the stepping thread and its workers touch a block, but for the free lanes.
struct LaneBlock {
  LaneState state{};
  LaneMotions motions;        ///< motions that a step has placed, until it runs the block
  LaneBlock* next = nullptr;  ///< next block of the step
  Patch* patch[lane_count] = {};
  std::uint32_t work = 0;  ///< cost of a step, in bristles (Sharing)

  void (*run)(const LaneBlock&, const LaneInput&, const LaneOutput&) noexcept = nullptr;
  void (*clear)(LaneBlock&, std::uint32_t lane) noexcept = nullptr;  ///< makes a lane's contact a new one

  // The adding thread's side
  std::uint64_t kind = 0;  ///< hash of what the contacts of the block share
  std::uint32_t free = (1u << lane_count) - 1;
};

/// Record of a patch whose state is in a lane.
struct LaneRecord : PatchRecord {
  LaneBlock* block = nullptr;  ///< null until LanePlaces::take()
  std::uint32_t lane = 0;

  template <class Self, class Visit>
  static void columns(Self&, Visit&&) {}  // all columns are the block's
};
inline LaneRecord& lane_of(const Patch& p) noexcept { return static_cast<LaneRecord&>(*p.record); }

/// The blocks of a batch, on the side of the thread that adds patches. A block is freed with its last
/// contact.
class LanePlaces : public std::enable_shared_from_this<LanePlaces> {
 public:
  using Block = std::shared_ptr<LaneBlock>;

  /// Takes a free lane for a patch in a block of its kind, or in a new one, which `make` makes. The lane is
  /// free again when the record is released. Throws std::bad_alloc.
  void take(LaneRecord& record, std::uint64_t kind, Block (*make)(const LaneRecord&));

 private:
  struct Place;
  void give_back(LaneBlock& block, std::uint32_t lane) noexcept;

  struct Kind {
    std::vector<LaneBlock*> open;  ///< blocks with free lanes
    std::size_t blocks = 0;
  };
  std::unordered_map<LaneBlock*, Block> blocks_;
  std::unordered_map<std::uint64_t, Kind> kinds_;
};

/// Sets the load of a patch in a lane, and what follows from load and material alone.
void set_load(Patch& patch, double normal_load_n) noexcept;

/// Takes the patch's lane, which may have held another contact before, for a new contact.
inline void enter_lane(Patch& p) noexcept {
  const LaneRecord& r = lane_of(p);
  r.block->patch[r.lane] = &p;
  r.block->clear(*r.block, r.lane);
}

}  // namespace bristle::detail
