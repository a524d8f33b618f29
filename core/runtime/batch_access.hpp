// Access to the inside of a PatchBatch for code of the library and its tests: outlines (ExtendedPatches),
// contact models that only tests use, and patch_outputs.hpp.
#pragma once

#include "bristle/patch_batch.hpp"
#include "core/patches/patch.hpp"
#include "core/runtime/command_list.hpp"
#include "core/runtime/patch_outputs.hpp"
#include "core/runtime/scheduler.hpp"

namespace bristle::detail {

struct BatchAccess {
  static PatchBatch::Impl& inside(PatchBatch& batch) noexcept { return *batch.impl_; }

  /// Adds a patch that is already built, out of contact; the batch owns its record from then on. Thread rule:
  /// as PatchBatch::add. Throws std::bad_alloc.
  static PatchId add(PatchBatch& batch, const Patch& made);

  /// Marks a call of the stepping thread over a batch. Applies the changes that the adding thread has sent at
  /// its start, and none during it, so that patches stay the same throughout the call.
  class Call {
   public:
    explicit Call(PatchBatch& batch) noexcept;
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

   private:
    PatchBatch::Impl& impl_;
    const bool is_outermost_;
  };
  /// Marks a call of the adding thread over a batch. The stepping thread sees all changes of the call at
  /// once, at its end, never half of them.
  class Changes {
   public:
    explicit Changes(PatchBatch& batch) noexcept;
    ~Changes();
    Changes(const Changes&) = delete;
    Changes& operator=(const Changes&) = delete;
    /// Sends a change to the stepping thread. Throws std::bad_alloc; `change` then still belongs to the
    /// caller.
    void send(std::unique_ptr<Change>&& change);

   private:
    PatchBatch::Impl& impl_;
  };

  // Returns what find_outputs() (patch_outputs.hpp) returns.
  static Outputs outputs(const PatchBatch& batch, PatchId id) noexcept;
};

}  // namespace bristle::detail
