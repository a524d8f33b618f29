// Access to the inside of a batch: for objects made over it (outlines), for contact models of tests that
// make_patch.cpp does not know, and for patch_outputs.hpp.
#pragma once

#include "bristle/patch_batch.hpp"
#include "core/patches/patch.hpp"
#include "core/runtime/command_list.hpp"
#include "core/runtime/patch_outputs.hpp"
#include "core/runtime/scheduler.hpp"

namespace bristle::detail {

struct BatchAccess {
  static PatchBatch::Impl& inside(PatchBatch& batch) noexcept { return *batch.impl_; }

  /// Adds a finished patch, out of contact; the batch owns its record from then on. Same thread rule as
  /// PatchBatch::add. Throws std::bad_alloc.
  static PatchId add(PatchBatch& batch, const Patch& made);

  /// Marks a call of the stepping side over a batch. Applies the waiting changes at its start; calls to the
  /// batch within it apply none.
  class Turn {
   public:
    explicit Turn(PatchBatch& batch) noexcept;
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    PatchBatch::Impl& impl_;
    const bool is_outermost_;
  };
  /// Marks a call of the adding side over a batch. The stepping side sees all changes of the call at once, at
  /// its end.
  class Changes {
   public:
    explicit Changes(PatchBatch& batch) noexcept;
    ~Changes();
    Changes(const Changes&) = delete;
    Changes& operator=(const Changes&) = delete;
    /// Sends a change to the stepping side. Throws std::bad_alloc, and then leaves `change` to the caller.
    void send(std::unique_ptr<Change>&& change);

   private:
    PatchBatch::Impl& impl_;
  };
  /// Steps motions as PatchBatch::step does, and cells of outlines with them (Scheduler::step).
  static StepReport step(PatchBatch& batch, double dt_s, Span<CellMotion> cells, Span<const Motion> in,
                         Span<Response> out) noexcept;

  // Returns whether a patch is an infinite brush in a glide: a steady slide in which steps visit no cohort.
  static bool glides(const PatchBatch& batch, PatchId id) noexcept;

  // Returns what find_outputs() (patch_outputs.hpp) returns.
  static Outputs outputs(const PatchBatch& batch, PatchId id) noexcept;
};

}  // namespace bristle::detail
