// Blocks of sixteen contacts, one in each lane, and the lists of free lanes. Contacts of equal material and
// options share blocks, whatever the order in which they were added; each is a patch of its own
// (Patch::in_lane). A contact model with contacts in lanes derives its block from LaneBlock: slide_block.hpp
// and brush_block.hpp.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
#include <unordered_map>
#include <vector>

#include "core/lane_table.hpp"
#include "core/patches/columns.hpp"
#include "core/patches/contact_model.hpp"

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

  void set(std::uint32_t lane, const double (&by)[2], double normal_load, double dt_s) noexcept {
    for (int axis = 0; axis < 2; ++axis) displacement[axis].lane[lane] = by[axis];
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
  LaneMotions motions;  ///< motions written for the present step, until the block is run
  Patch* patch[lane_count] = {};
  LaneColumn<double> light{};  ///< load, N, up to which the contact is certainly not overloaded
  LaneColumn<double> full{};   ///< number of physical bristles beyond which the contact is overloaded

  void (*clear)(LaneBlock&, std::uint32_t lane) noexcept = nullptr;  ///< resets a lane for a new contact
  /// Moves LaneRecord::times_from, after a step of a patch that ages, so that times of the lane keep their
  /// digits. Null: the lane counts from the start of the patch's own time.
  void (*follow_time)(const Patch&) noexcept = nullptr;
  const LaneTable* kernels = nullptr;

  // Properties that the contacts share
  std::shared_ptr<const CompiledMaterial> material;
  double lengths_per_metre = 0.0;
  /// Largest stiffness and limit of any direction, over the material's (LayMap).
  double stiffest = 1.0, strongest = 1.0;
  std::uint32_t springs = 0;  ///< number of springs, or of cohorts, of a contact
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

/// Record of a patch whose state is in a lane of a block: names the block and the lane, and has what a block
/// for such a patch is made from.
struct LaneRecord : PatchRecord {
  LaneBlock* block = nullptr;  ///< block of the contact; null until LanePool::take()
  std::uint32_t lane = 0;
  const KernelTable* kernels = nullptr;
  /// Time from which the lane counts times, in 2^-64 s after PatchRecord::epoch.
  Int128 times_from = 0;

  /// Returns the number of springs, or of cohorts.
  std::uint32_t springs() const noexcept { return options.bristles; }

  template <class Self, class Visit>
  static void columns(Self&, Visit&&) {}  // lists no columns of its own, because all are the block's
};
inline LaneRecord& lane_of(const Patch& p) noexcept { return static_cast<LaneRecord&>(*p.record); }

/// Returns the time of the lane at the start of the step in progress, s.
inline double lane_time(const Patch& p) noexcept {
  const LaneRecord& r = lane_of(p);
  return r.clock == nullptr ? 0.0
                            : static_cast<double>(*r.clock - r.epoch - r.times_from) / clock_units_per_second;
}

/// All blocks of lanes of a batch, for the adding thread, which takes free lanes from them. A block is freed
/// with its last contact.
class LanePool : public std::enable_shared_from_this<LanePool> {
 public:
  using Block = std::shared_ptr<LaneBlock>;

  /// Takes a free lane for a patch in a block of its kind, or in a new block from `make`. The lane is free
  /// again when the record is released. Throws std::bad_alloc.
  void take(LaneRecord& record, std::uint64_t kind, Block (*make)(const LaneRecord&));

 private:
  struct Lease;
  void give_back(LaneBlock& block, std::uint32_t lane) noexcept;

  struct Kind {
    std::vector<LaneBlock*> open;  ///< blocks with free lanes, by kind
    std::size_t blocks = 0;
  };
  std::unordered_map<LaneBlock*, Block> blocks_;
  std::unordered_map<std::uint64_t, Kind> kinds_;
};

/// Allocates a block for contacts like `like` and, behind it, its columns, filled with zeros.
/// `Block::list(block, like, visit)` calls visit(pointer, number of entries) for each column.
template <class Block>
std::shared_ptr<Block> allocate_block(const LaneRecord& like) {
  Block sizes;
  std::size_t bytes = aligned(sizeof(Block));
  Block::list(sizes, like,
              [&bytes](const auto* column, std::size_t count) { bytes += aligned(count * sizeof *column); });
  auto* memory = static_cast<std::byte*>(::operator new (bytes, std::align_val_t{column_alignment}));
  std::memset(memory, 0, bytes);
  auto* block = new (memory) Block;
  std::shared_ptr<Block> owner(block, [](Block* freed) {
    freed->~Block();
    ::operator delete (static_cast<void*>(freed), std::align_val_t{column_alignment});
  });
  std::byte* at = memory + aligned(sizeof(Block));
  Block::list(*block, like, [&at](auto*& column, std::size_t count) {
    column = reinterpret_cast<std::remove_reference_t<decltype(column)>>(at);
    at += aligned(count * sizeof *column);
  });
  return owner;
}

/// Steps the contacts of a block by the kernel of its contact model (LaneBlock::run).
template <class Block>
void run_kernel(const LaneBlock& block, const LaneInput& in, const LaneOutput& out) noexcept {
  const auto& b = static_cast<const Block&>(block);
  b.kernel(b.law, b.columns, in, out);
}

/// Fills in those members of a block that are alike in all contact models.
void fill_block(LaneBlock& block, const LaneRecord& like);

/// Fills in those constants of a law that follow from material and lay alone.
template <class Law>
void fill_law(Law& law, const CompiledMaterial& m, const LayMap& lay) noexcept {
  const Turn& turn = lay.along;
  law.metres_per_length = m.metres_per_length;
  law.stiffness_per_newton =
      m.material.bristles_in_contact(1.0) * m.material.bristle_stiffness * m.metres_per_length;
  law.to[0][0] = m.lengths_per_metre * turn.cosine;
  law.to[0][1] = m.lengths_per_metre * turn.sine;
  law.to[1][0] = m.lengths_per_metre * lay.stretch * -turn.sine;
  law.to[1][1] = m.lengths_per_metre * lay.stretch * turn.cosine;
  law.from[0][0] = turn.cosine;
  law.from[0][1] = -turn.sine * lay.limit;
  law.from[1][0] = turn.sine;
  law.from[1][1] = turn.cosine * lay.limit;
  law.energy = lay.energy;
  law.ageing_rate = 1.0 / m.material.ageing_time;
  law.ageing_strength = m.material.ageing_strength;
  law.ageing_form = m.material.ageing_form == AgeingForm::saturating ? 1 : 0;
}

/// Takes a lane for the patch in a block of like contacts: material, contact model, number of springs or
/// cohorts, axes, outputs and lay are equal. Contacts of a group share blocks only with each other.
void assign_lane(Patch& patch, LanePool& pool, LanePool::Block (*make)(const LaneRecord&));

/// Makes a patch in a lane, out of contact; it has no lane yet. `made`: a record whose options are set, the
/// number of springs or cohorts included. `weight`: bristles for each of these; 0: what the options ask for.
Patch make_lane_patch(std::shared_ptr<const CompiledMaterial> material, LaneRecord& made,
                      const KernelTable& kernels, double weight, const ContactModel& model);
/// ContactModel::reset and ContactModel::signature of patches in lanes.
void reset_lane(Patch& patch, std::uint32_t seed, std::uint64_t key) noexcept;
std::uint64_t signature_of_lane(const Patch& patch) noexcept;

/// Lists what every patch in a lane saves before the numbers of its lane: the force at the end of the last
/// step, which the lane gives only to rounding, and whether the patch rests.
template <class Elastic, class Rests, class Visit>
void rest_fields(Elastic& elastic, Rests& rests, Visit&& visit) noexcept {
  for (auto& force : elastic) visit(force);
  visit(rests);
}
void save_rest(const Patch& patch, ByteWriter& write) noexcept;
void restore_rest(Patch& patch, std::uint32_t seed, ByteReader& read) noexcept;
/// Checks what save_rest() wrote, with `largest` the largest elastic force of any direction, N, and the
/// overload of `contact`. Returns null, or the name of a value that no patch can have.
const char* find_rest_fault(const Patch& patch, const Patch& contact, double largest,
                            ByteReader& read) noexcept;

/// Sets the load of a patch in a lane, and the numbers that depend on load and material alone.
void set_load(Patch& patch, double normal_load_n) noexcept;

/// Resets the numbers of a lane for a new contact.
void clear_lane(LaneBlock& block, std::uint32_t lane) noexcept;
/// Resets a patch's lane for a new contact, because it may have numbers of an earlier one.
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
