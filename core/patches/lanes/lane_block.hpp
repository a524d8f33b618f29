// Blocks of sixteen contacts, one in each lane, and the lists of free lanes. Contacts of equal material and
// options share blocks, whatever the order in which they were added; each is a patch of its own
// (Patch::in_lane). A contact model with contacts in lanes derives its block from LaneBlock; slide_block.hpp
// is one.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <unordered_map>
#include <vector>

#include "core/lane_table.hpp"
#include "core/patches/columns.hpp"

namespace bristle::detail {

/// Forces, stiffness and energies of sixteen contacts, written by a step of their block.
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

/// The motions of a block's contacts in one step, as columns that the kernel reads.
struct LaneMotions {
  std::uint32_t named = 0;              ///< bits of the lanes with a motion
  std::uint32_t item[lane_count] = {};  ///< number of each lane's motion in the step
  double duration = 0.0;
  LaneColumn<double> displacement[2]{}, load{}, start{};

  void place(std::uint32_t lane, const double (&way)[2], double normal_load, double dt_s) noexcept {
    for (int axis = 0; axis < 2; ++axis) displacement[axis].lane[lane] = way[axis];
    load.lane[lane] = normal_load;
    duration = dt_s;
    named |= 1u << lane;
  }
  LaneInput input(bool stores) const noexcept {
    return {{displacement[0].lane, displacement[1].lane}, load.lane, start.lane, duration, named, stores};
  }
};

/// Whether a contact is overloaded. `excess` is the number of bristles that its load asks for over the number
/// that it has; a rounding error above 1 does not count.
inline bool is_overloaded(double excess) noexcept { return excess >= 1.0 + 1e-14; }

/// Sixteen contacts in the lanes of a block. Only the stepping thread and its workers touch a block, except
/// for its list of free lanes.
///
/// Load and force of a contact's last step are stored in its patch. lend() moves them to columns of the
/// block, so that steps need not touch the patch; settle() moves them back. The numbers that every step reads
/// come first and are prefetched.
struct LaneBlock {
  std::uint32_t lent = 0;     ///< bits of the lanes whose load and force are lent to the block
  std::uint32_t rests = 0;    ///< bits of the lanes whose contacts a step without motion leaves at rest
  std::uint32_t seen = 0;     ///< bits of the lanes that step number `step` has named
  std::uint32_t work = 0;     ///< cost of a step of the block, in bristles (Sharing)
  std::uint64_t step = 0;     ///< number of the last step that named a lane
  std::uint32_t asked = 0;    ///< bits of the lanes that a step of a group moves, until it runs the block
  std::uint32_t first = 0;    ///< index in that group of the contact in the first lane
  LaneBlock* next = nullptr;  ///< next block in the list of blocks that the step runs
  void (*run)(const LaneBlock&, const LaneInput&, const LaneOutput&) noexcept = nullptr;
  double lightest = std::numeric_limits<double>::infinity();  ///< least number in `light`
  const void* columns_at = nullptr;                           ///< columns of the model
  LaneColumn<double> load{};                                  ///< normal load of the last step, N
  LaneColumn<double> force[2]{};  ///< elastic force on the body at the end of the last step, N
  LaneState state{};
  LaneMotions motions;  ///< motions placed for the present step, until the block is run
  Patch* patch[lane_count] = {};
  LaneColumn<double> light{};  ///< load, N, up to which the contact is certainly not overloaded
  LaneColumn<double> full{};   ///< number of physical bristles beyond which the contact is overloaded

  void (*clear)(LaneBlock&, std::uint32_t lane) noexcept = nullptr;  ///< resets a lane for a new contact
  const LaneTable* kernels = nullptr;

  // Properties that the contacts share
  std::shared_ptr<const CompiledMaterial> material;
  double lengths_per_metre = 0.0;
  /// Largest stiffness and limit of any direction, over the material's (LayMap).
  double stiffest = 1.0, strongest = 1.0;
  std::uint32_t springs = 0;  ///< number of springs of a contact
  int axes = 2;
  Outputs outputs = Outputs::end;
  bool ages = false;   ///< whether the contacts age (Patch::ages); such contacts are never lent
  bool damps = false;  ///< Patch::damps

  // Data of the adding thread, which finds free lanes by them.
  std::uint64_t kind = 0;  ///< hash of what the contacts of the block share
  std::uint32_t free = (1u << lane_count) - 1;

  /// Returns the columns of the block that the step runs next, for prefetching; null for the last block.
  const void* ahead() const noexcept { return next != nullptr ? next->columns_at : nullptr; }
  /// Returns the status of a contact under this load: Status::overload if it is overloaded, otherwise
  /// Status::ok.
  Status overload_status(std::uint32_t lane, double load_n) const noexcept {
    if (load_n <= light.lane[lane]) return Status::ok;
    const double bristles = material->material.bristles_in_contact(load_n);
    return is_overloaded(bristles / full.lane[lane]) ? Status::overload : Status::ok;
  }
  /// Records the lanes that a step names, and returns those that the same step has named before.
  std::uint32_t see(std::uint32_t lanes, std::uint64_t step_number) noexcept {
    if (step != step_number) seen = 0;
    step = step_number;
    const std::uint32_t before = seen & lanes;
    seen |= lanes;
    return before;
  }
  bool damps_at_all() const noexcept { return damps || material->material.viscous_friction != 0.0; }
  /// Returns the stiffness of a contact, N/m, as Response::stiffness reports it.
  double stiffness(std::uint32_t lane) const noexcept {
    return state.stiffness.lane[lane] * lengths_per_metre * stiffest;
  }
};

/// Record of a patch whose state is in a lane of a block: names the block and the lane.
struct LaneRecord : PatchRecord {
  LaneBlock* block = nullptr;  ///< block of the contact; null until LanePlaces::take()
  std::uint32_t lane = 0;

  template <class Self, class Visit>
  static void columns(Self&, Visit&&) {}  // lists no columns of its own, because all are the block's
};
inline LaneRecord& lane_of(const Patch& p) noexcept { return static_cast<LaneRecord&>(*p.record); }

/// All blocks of lanes of a batch, for the adding thread, which takes free lanes from them. A block is freed
/// with its last contact.
class LanePlaces : public std::enable_shared_from_this<LanePlaces> {
 public:
  using Block = std::shared_ptr<LaneBlock>;

  /// Takes a free lane for a patch in a block of its kind, or in a new block from `make`. The lane is free
  /// again when the record is released. Throws std::bad_alloc.
  void take(LaneRecord& record, std::uint64_t kind, Block (*make)(const LaneRecord&));

 private:
  struct Place;
  void give_back(LaneBlock& block, std::uint32_t lane) noexcept;

  struct Kind {
    std::vector<LaneBlock*> open;  ///< blocks with free lanes, by kind
    std::size_t blocks = 0;
  };
  std::unordered_map<LaneBlock*, Block> blocks_;
  std::unordered_map<std::uint64_t, Kind> kinds_;
};

/// Sets the load of a patch in a lane, and the numbers that depend on load and material alone.
void set_load(Patch& patch, double normal_load_n) noexcept;

/// Resets a patch's lane for a new contact, because it may hold numbers of an earlier one.
void enter_lane(Patch& patch) noexcept;

/// Moves load and force of a patch's last step to its block, so that steps need not touch the patch. Refuses,
/// and returns false, if a response needs more of the patch: it ages, or has energies of a change of material
/// to report.
bool lend(const Patch& patch) noexcept;
/// Moves load and force, if they are lent to the block, back to the patch in the lane.
void settle(Patch& patch) noexcept;

/// Whether a contact whose load and force are stored in its block (lend()) stays at rest under a motion, so
/// that its last response can be repeated.
inline bool stays_at_rest(const LaneBlock& b, std::uint32_t lane, const Motion& motion) noexcept {
  return (b.rests >> lane & 1u) != 0 && leaves_at_rest(motion, b.load.lane[lane]);
}
/// Writes the response of a contact whose load and force are stored in its block (lend()), from the answers
/// of the block's step.
void answer_lane(const LaneBlock& block, std::uint32_t lane, const Motion& motion, double dt_s,
                 const LaneAnswers& answers, Response& out) noexcept;
/// Writes the response of a contact at rest whose load and force are stored in its block (lend()): its last
/// force.
void answer_resting_lane(const LaneBlock& block, std::uint32_t lane, Response& out) noexcept;
/// Stores load and force of a step in the block, where the contact's next step reads them. The caller adds
/// the lane to LaneBlock::rests.
inline void note_step(LaneBlock& b, std::uint32_t lane, double load, const LaneAnswers& answers) noexcept {
  b.load.lane[lane] = load;
  for (int axis = 0; axis < b.axes; ++axis) b.force[axis].lane[lane] = answers.end[axis].lane[lane];
}

}  // namespace bristle::detail
