// Steps the motions of a batch's patches, on the calling thread alone or shared among several threads.
#pragma once

#include <array>
#include <cstdint>

#include "bristle/patch_batch.hpp"
#include "core/patches/patch_step.hpp"
#include "core/runtime/group_columns.hpp"
#include "core/runtime/patch_pool.hpp"
#include "core/runtime/sharing.hpp"

namespace bristle::detail {

/// Everything that one step moves: groups of contacts, and single patches by one motion each.
struct StepItems {
  Span<const GroupStep> groups;
  Span<const Motion> motions;
  Span<Response> responses;
};

class Scheduler {
 public:
  explicit Scheduler(int threads) : work(threads) {}

  SharedWork work;
  PatchPool pool;

  /// Steps all items. The results do not depend on the number of threads and pieces, to the bit. Requires a
  /// valid `dt_s`.
  StepReport step(double dt_s, const StepItems& items) noexcept;

  /// Checks that a group's step can be made. Returns Status::unknown_id if there is no such group, and
  /// Status::bad_input if an array or an index does not fit it.
  Status find_fault(const GroupStep& step) const noexcept;
  /// Finds the responses to a group's motions without changing the state, for implicit solvers. Returns
  /// false, and does nothing, for a group whose contacts are not all in blocks and have to be tried one by
  /// one.
  bool try_group(double dt_s, const GroupStep& step, StepReport& report) noexcept;

  std::uint64_t step_number() const noexcept { return step_number_; }

  GroupRoom group_room;
  std::size_t patches_in_lanes = 0;  ///< number of patches of the pool whose state is in a lane

 private:
  static constexpr int max_tasks = 512;
  static constexpr int max_split = 64;

  struct Range {
    std::uint32_t first = 0, last = 0;
    /// Index in `splits_` of the first large patch that may lie in this range; step_range() leaves such
    /// patches out.
    int next_split = 0;
  };
  using Outcome = StepOutcome;
  /// A task of a step shared among threads: a row of blocks of contacts, a range of blocks of one large
  /// patch, or a range of motions.
  struct Task {
    LaneBlock* blocks = nullptr;  ///< first of the `block_count` blocks of lanes that the task steps
    std::uint32_t block_count = 0;
    int split = -1;
    Range range;
    Totals totals;
    Outcome outcome;
    const void* thread = nullptr;  ///< thread that did the task, by this_thread()
  };
  struct Split {
    Patch* patch = nullptr;
    std::size_t motion = 0;
    PatchStep step;
    int first_task = 0, task_count = 0;
  };
  struct Motions;
  struct Blocks;
  template <class Items>
  class Step;

  /// Links the blocks that have the contacts which a group's step names, and marks these contacts in
  /// LaneBlock::asked. Returns the first block; null if the state of a contact cannot be lent to its block,
  /// and the contacts have to be stepped one by one. `repeats`: gets Status::repeated_id for a contact that
  /// the step has named already; null for a trial.
  LaneBlock* link_group(const GroupStep& step, std::uint64_t& cost, Status* repeats) noexcept;
  void step_group(double dt_s, const GroupStep& step, StepReport& report) noexcept;

  static void add_to(StepReport& report, const Outcome& outcome) noexcept;
  void note_outlook(const Patch& p, PatchId id) const noexcept;
  std::uint32_t count_threads(int task_count) const noexcept;

  std::uint64_t step_number_ = 0;
  std::array<Task, max_tasks> tasks_;
  std::array<Split, max_split> splits_;  ///< large patches split into ranges, sorted by motion
  int split_count_ = 0;
};

}  // namespace bristle::detail
