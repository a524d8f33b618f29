// Access to the inside of a PatchBatch for code of the library and its tests: outlines (ExtendedPatches),
// and contact models that only tests use.
#pragma once

#include "bristle/patch_batch.hpp"
#include "core/patches/patch.hpp"
#include "core/runtime/command_list.hpp"

namespace bristle::detail {

struct BatchAccess {
  using Impl = PatchBatch::Impl;
  static Impl& inside(const PatchBatch& batch) noexcept { return *batch.impl_; }

  /// Adds a patch that is already built, out of contact; the batch owns its record from then on. Thread rule:
  /// as PatchBatch::add. Throws std::bad_alloc.
  static PatchId add(PatchBatch& batch, const Patch& made);

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
};

}  // namespace bristle::detail
