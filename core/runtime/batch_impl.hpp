// The inside of a batch: by the thread rule (patch_batch.hpp) one thread adds and removes patches
// (batch_changes.cpp), another one steps them (patch_batch.cpp, scheduler.cpp).
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
  /// Patch data, indexed by slot, as the thread that adds and removes patches sees them.
  std::vector<Record> records;
  /// Prepared materials, the most recently used first, so that patches of one material share it.
  std::vector<std::shared_ptr<const detail::CompiledMaterial>> materials;
  int chunks = 1;
  std::size_t scratch_bytes = 0;
  std::size_t group_room = 0;    ///< number of contacts for which Scheduler::group_room is made
  std::uint32_t last_group = 0;  ///< number of the last group that was added or got another material
  const std::shared_ptr<detail::LanePlaces> lanes = std::make_shared<detail::LanePlaces>();
  bool publishes_later = false;  ///< whether commands are published only when BatchAccess::Changes ends

  // Functions for the thread that adds patches. All but send() throw std::bad_alloc.

  /// Returns the record of a patch that is in no group. Throws Error if there is none.
  Record& record_of(PatchId id);
  /// Returns the record of the first patch of a group. Throws Error if there is no such group.
  const Record& record_of(const PatchGroup& group);
  std::shared_ptr<const detail::CompiledMaterial> compiled(const Material& material);
  PatchId add(const detail::Patch& made);
  /// Adds the patch that `command` holds, with scratch memory if the patch needs it.
  PatchId add_to(const detail::SlotList::Slot& slot, std::unique_ptr<detail::Command> command);
  void grow_pool();  ///< adds the next chunk of slots to the pool of patches
  /// Makes the patch that replaces a patch when its material changes. Throws Error if the materials need
  /// patches of different kinds.
  detail::Patch make_replacement(std::shared_ptr<const detail::CompiledMaterial> material,
                                 const Record& record) const;
  /// Assigns a lane to the patch that `command` holds, if its model has lanes. Allocates scratch memory if
  /// the patch needs more than `has_scratch` bytes, which then becomes the new size.
  void prepare(detail::Command& command, std::size_t& has_scratch);
  using Commands = std::vector<std::unique_ptr<detail::Command>>;
  /// Makes a command of a kind for each contact of a group, with the patch that make(i) returns.
  template <class Make>
  Commands make_group(detail::Command::Kind kind, std::size_t contacts, const Make& make);
  /// Pushes a command. No failure can follow, so the size of its scratch memory is noted only here.
  void send(std::unique_ptr<detail::Command> command) noexcept;

  // --- the stepping thread's side
  mutable detail::SteppingSide stepping_side;
  bool is_in_turn = false;  ///< whether a Turn has already applied the waiting changes for the present call
  detail::Scheduler scheduler;
  detail::PatchPool& pool = scheduler.pool;
  detail::Scratch scratch;  ///< memory for a copy of any patch's record, as large as the largest
  /// Clock of the batch. It advances in every step, whichever patches the step names (PatchRecord::clock).
  detail::Int128 clock = 0;
  std::size_t patches = 0;

  /// Copy of a patch under a trial load, kept until the batch changes, because a solver tries many motions
  /// under one load.
  struct Trial {
    const detail::Patch* of = nullptr;
    double normal_load = 0.0;
    double contact_loss = 0.0;
    detail::Patch patch;
  };
  Trial trial;

  /// Marks a call of the thread that steps. Applies the waiting changes at its start; calls within it apply
  /// none.
  class Turn {
   public:
    explicit Turn(Impl& impl) noexcept : impl_(impl), is_outermost_(impl.enter()) {}
    ~Turn() { impl_.leave(is_outermost_); }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    Impl* operator->() const noexcept { return &impl_; }

   private:
    Impl& impl_;
    const bool is_outermost_;
  };
  bool enter() noexcept {
    stepping_side.enter();
    if (is_in_turn) return false;
    const std::uint64_t last = commands.pushed();
    while (detail::Command* command = commands.take(last)) apply(*command);
    return is_in_turn = true;
  }
  void leave(bool is_outermost) noexcept {
    if (is_outermost) is_in_turn = false;
    stepping_side.leave();
  }
  /// Applies a change of the adding thread. Neither allocates nor frees.
  void apply(detail::Command& command) noexcept;

  /// Steps the batch. The caller holds a Turn, because waiting changes may replace patches. `items`: as in
  /// Scheduler::step.
  StepReport step(double dt_s, const detail::StepItems& items) noexcept;
  Response find_force(double dt_s, const Motion& motion) noexcept;
  bool reset(PatchId id, std::uint32_t seed, std::uint64_t key) noexcept;
  std::size_t state_size() const noexcept;
  /// Checks all patches for impossible values, in builds with asserts: after each of the first steps, later
  /// from time to time, because a check costs more than a step.
  bool is_sound() noexcept;

  /// Returns the patch of an id; null if there is none. If its block of lanes has a part of its state,
  /// settle() first moves that to the patch.
  detail::Patch* find(PatchId id) const noexcept {
    detail::Patch* const p = pool.find(id);
    if (p != nullptr && p->in_lane) settle(*p);
    return p;
  }
  /// Calls `visit(slot, patch)` for each patch, in the order of slots.
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
