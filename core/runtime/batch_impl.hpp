// The inside of a batch. By the thread rule (patch_batch.hpp) one thread adds and removes patches
// (batch_changes.cpp), another one steps them (patch_batch.cpp, scheduler.cpp); each has data of its own
// below.
#pragma once

#include <memory>
#include <vector>

#include "bristle/patch_batch.hpp"
#include "core/patches/lanes/lane_block.hpp"
#include "core/runtime/command_list.hpp"
#include "core/runtime/scheduler.hpp"
#include "core/runtime/stepping_side.hpp"

namespace bristle {

struct BRISTLE_PRIVATE PatchBatch::Impl {
  explicit Impl(const BatchOptions& options);
  ~Impl();

  const detail::KernelTable& kernels;
  bool skips = true;  ///< whether patches that are added skip bristles that cannot snap
  detail::CommandList commands;

  // --- the adding thread's side
  detail::SteppingSide adding_side;
  struct Record {
    PatchOptions options;
    double full_weight = 0.0;
    bool alive = false;
    std::uint32_t group = 0;  ///< PatchRecord::group
    const detail::ContactModel* model = nullptr;
  };
  detail::SlotList slots;
  /// Facts about the patches, by slot, for the adding thread. It must not read the patches themselves
  /// (`pool`), because the stepping thread may be changing them.
  std::vector<Record> records;
  /// Prepared materials, the most recently used first. Patches of equal materials share one, which saves
  /// memory and set-up.
  std::vector<std::shared_ptr<const detail::CompiledMaterial>> materials;
  int chunks = 1;
  std::size_t scratch_bytes = 0;
  std::size_t group_room = 0;    ///< number of contacts for which Scheduler::group_room is made
  std::uint32_t last_group = 0;  ///< number of the last group that was added or got another material
  const std::shared_ptr<detail::LanePool> lanes = std::make_shared<detail::LanePool>();
  bool publishes_later = false;  ///< whether commands are published only when BatchAccess::Changes ends

  // Functions that only the thread that adds patches may call. All but send() throw std::bad_alloc.

  /// Looks up the record of a patch that is not part of a group. Throws Error if there is none.
  Record& record_of(PatchId id);
  /// Looks up the record of the first patch of a group. Throws Error if there is no such group.
  const Record& record_of(const PatchGroup& group);
  std::shared_ptr<const detail::CompiledMaterial> compiled(const Material& material);
  PatchId add(const detail::Patch& made);
  /// Adds the patch that `command` brings to a slot, and allocates scratch memory if the patch needs more
  /// than the batch has.
  PatchId add_to(const detail::SlotList::Slot& slot, std::unique_ptr<detail::Command> command);
  void grow_pool();  ///< adds the next chunk of slots to the pool of patches
  /// Builds the patch that replaces a patch when its material changes. Throws Error if the old and the
  /// new material need different kinds of patches.
  detail::Patch make_replacement(std::shared_ptr<const detail::CompiledMaterial> material,
                                 const Record& record) const;
  /// Assigns a lane of a block to the patch that `command` brings, if its contact model has lanes. If the
  /// patch needs more scratch memory than `has_scratch` bytes, allocates it and sets `has_scratch` to its
  /// size.
  void prepare(detail::Command& command, std::size_t& has_scratch);
  using Commands = std::vector<std::unique_ptr<detail::Command>>;
  /// Makes one command of this kind for each contact of a group. make(i) returns the patch of contact i.
  template <class Make>
  Commands make_group(detail::Command::Kind kind, std::size_t contacts, const Make& make);
  /// Sends a command to the stepping thread, which cannot fail. Notes the size of the scratch memory that the
  /// command brings only here, since earlier steps may throw.
  void send(std::unique_ptr<detail::Command> command) noexcept;

  // --- the stepping thread's side
  mutable detail::SteppingSide stepping_side;
  bool is_in_call = false;  ///< whether a Call has already applied the waiting changes for the present call
  detail::Scheduler scheduler;
  detail::PatchPool& pool = scheduler.pool;
  detail::Scratch scratch;  ///< memory for a copy of any patch's record, as large as the largest
  /// Time of the batch, in its units. It advances in every step, also for patches that the step does not
  /// name, so that they age (PatchRecord::clock).
  detail::Int128 clock = 0;
  std::size_t patches = 0;

  /// Copy of a patch that was put under a trial load by find_force(). It is kept until the batch changes,
  /// because a solver tries many motions under one load.
  struct Trial {
    const detail::Patch* of = nullptr;
    double normal_load = 0.0;
    double contact_loss = 0.0;
    detail::Patch patch;
  };
  Trial trial;

  /// Marks a call of the stepping thread. Applies the changes that the adding thread has sent at its start,
  /// and none in calls within the call.
  class Call {
   public:
    explicit Call(Impl& impl) noexcept : impl_(impl), is_outermost_(impl.enter()) {}
    ~Call() { impl_.leave(is_outermost_); }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
    Impl* operator->() const noexcept { return &impl_; }

   private:
    Impl& impl_;
    const bool is_outermost_;
  };
  bool enter() noexcept {
    stepping_side.enter();
    if (is_in_call) return false;
    const std::uint64_t last = commands.pushed();
    while (detail::Command* command = commands.take(last)) apply(*command);
    return is_in_call = true;
  }
  void leave(bool is_outermost) noexcept {
    if (is_outermost) is_in_call = false;
    stepping_side.leave();
  }
  /// Applies a command of the adding thread. Neither allocates nor frees, because a step may call it.
  void apply(detail::Command& command) noexcept;

  /// Steps the batch, with `items` as in Scheduler::step. The caller has a Call, because waiting changes
  /// may replace patches.
  StepReport step(double dt_s, const detail::StepItems& items) noexcept;
  Response find_force(double dt_s, const Motion& motion) noexcept;
  bool reset(PatchId id, std::uint32_t seed, std::uint64_t key) noexcept;
  std::size_t state_size() const noexcept;
  /// Checks all patches for impossible values, in builds with asserts. Checks after each of the first steps
  /// and only from time to time later, because a check costs more than a step.
  bool is_sound() noexcept;

  /// Looks up the patch of an id; null if there is none. A patch in a lane has part of its state in its
  /// block; settle() moves that part to the patch's record before the patch is returned.
  detail::Patch* find(PatchId id) const noexcept {
    detail::Patch* const p = pool.find(id);
    if (p != nullptr && p->in_lane) settle(*p);
    return p;
  }
  /// Calls `visit(slot, patch)` for each patch of the batch, in the order of slots, with its whole state in
  /// its record.
  template <class Visit>
  void for_each_patch(Visit&& visit) const {
    for (std::uint32_t slot = 0; slot < pool.capacity(); ++slot) {
      detail::Patch& p = pool.patch(slot);
      if (p.generation == 0) continue;
      if (p.in_lane) settle(p);
      visit(slot, p);
    }
  }
};

}  // namespace bristle
