#include "core/runtime/scheduler.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <type_traits>
#include <utility>

#include "bristle/deadline_monitor.hpp"
#include "core/runtime/float_mode.hpp"

namespace bristle::detail {
namespace {

/// Distances, in motions of the step, at which the slot of a patch and its record are prefetched from memory.
constexpr std::size_t slots_ahead = 4;
constexpr std::size_t records_ahead = 2;
constexpr std::uint32_t blocks_ahead = 8;  ///< distance at which a group's block of lanes is prefetched
constexpr std::size_t resting_row = 16;    ///< number of resting patches in a row at which prefetching stops

// Prefetches cache lines. Always inlined, because g++ 12 drops calls to a function that only prefetches.
// Computes with the address as a number: a slot without a patch has a null record, and arithmetic on a null
// pointer is undefined.
[[gnu::always_inline]] inline void fetch(const void* memory, int lines) noexcept {
  const auto address = reinterpret_cast<std::uintptr_t>(memory);
  for (std::uintptr_t line = 0; line < static_cast<std::uintptr_t>(lines); ++line)
    __builtin_prefetch(reinterpret_cast<const void*>(address + 64 * line));
}

}  // namespace

/// Items of a step that are given as motions of patches.
struct Scheduler::Motions {
  double dt;
  Span<const Motion> in;
  Span<Response> out;

  std::size_t size() const noexcept { return in.size(); }
  PatchId id(std::size_t i) const noexcept { return in[i].id; }
  const Motion& motion(std::size_t i) const noexcept { return in[i]; }

  /// Checks whether a motion can be stepped and returns its patch. Otherwise returns null, and sets `status`
  /// to the reason.
  Patch* admit(Patch* p, std::size_t i, std::uint64_t step_number, Status& status) const noexcept {
    out[i].id = in[i].id;
    Status why = Status::ok;
    if (p == nullptr)
      why = why_missing(in[i].id.value);
    else if (p->last_step == step_number)
      why = Status::repeated_id;
    else if (p->last_step = step_number; !is_good_motion(p->axes, in[i]))
      why = Status::bad_input;
    if (why == Status::ok) return p;
    write_refusal(p != nullptr ? p->outputs : Outputs::all, why, out[i]);
    status = status | why;
    return nullptr;
  }
  /// Writes the motion of a contact into its block, to be stepped with it. Returns false if there is nothing
  /// to step, because the motion is refused or the contact stays at rest and is answered at once.
  bool assign(LaneBlock& block, std::uint32_t lane, std::size_t i, bool repeats,
              Outcome& outcome) const noexcept {
    out[i].id = in[i].id;
    const bool lent = (block.lent >> lane & 1u) != 0 || lend(*block.patch[lane]);
    if (lent && !repeats && stays_at_rest(block, lane, in[i])) {
      answer_resting_lane(block, lane, out[i]);
      outcome.status = outcome.status | out[i].status;
      ++outcome.stepped;
      return false;
    }
    const Status why = repeats                              ? Status::repeated_id
                       : !is_good_motion(block.axes, in[i]) ? Status::bad_input
                                                            : Status::ok;
    if (why != Status::ok) {
      write_refusal(block.outputs, why, out[i]);
      outcome.status = outcome.status | why;
      return false;
    }
    ++outcome.stepped;
    if (!lent) {
      assign_motion(*block.patch[lane], in[i], dt);
      return true;
    }
    block.motions.set(lane, in[i].displacement, in[i].normal_load, dt);
    return true;
  }
  /// Steps the contacts of a block whose motions assign() has written into it, and answers them.
  void step_block(LaneBlock& block, Outcome& outcome) const noexcept {
    LaneAnswers answers;
    LaneInput input = block.motions.input(true);
    input.ahead = block.ahead();
    block.run(block, input, answers.columns());
    for (std::uint32_t named = std::exchange(block.motions.named, 0); named != 0; named &= named - 1) {
      const auto lane = static_cast<std::uint32_t>(std::countr_zero(named));
      const std::uint32_t i = block.motions.item[lane];
      if ((block.lent >> lane & 1u) != 0) {
        answer_lane(block, lane, in[i], dt, answers, out[i]);
        note_step(block, lane, in[i].normal_load, answers);
        block.rests |= 1u << lane;
      } else {
        answer_motion(*block.patch[lane], in[i], dt, answers, out[i]);
      }
      outcome.status = outcome.status | out[i].status;
    }
  }
  Status rest(const Patch& p, std::size_t i) const noexcept {
    out[i].id = in[i].id;
    answer_at_rest(p, out[i]);
    return out[i].status;
  }
  std::uint64_t step(Patch& p, std::size_t i, Status& status) const noexcept {
    const std::uint64_t visited = step_patch(p, in[i], dt, out[i]);
    status = status | out[i].status;
    return visited;
  }
  std::uint64_t end(Patch& p, std::size_t i, const PatchStep& step, const Totals* totals,
                    Status& status) const noexcept {
    const std::uint64_t visited = end_step(p, in[i], dt, step, totals, out[i]);
    status = status | out[i].status;
    return visited;
  }
};

/// Items of a step that are blocks of a group of contacts; link_group() has chosen them.
struct Scheduler::Blocks : GroupColumns {
  std::uint64_t cost;
};

/// One step of all items of one kind (Motions or Blocks), alone or shared among threads.
template <class Items>
class Scheduler::Step {
 public:
  Step(Scheduler& scheduler, const Items& items) noexcept : s(scheduler), items_(items) {}

  [[gnu::always_inline]] void run(StepReport& report) noexcept {
    std::size_t others = items_.size();
    LaneBlock* blocks = nullptr;
    std::uint64_t cost = 0;
    if (s.patches_in_lanes > 0) blocks = assign_motions(others, cost, report);
    if (others > 0) run_patches(report);
    if (blocks != nullptr) run_blocks(blocks, cost, report);
  }

  /// Runs the blocks from `first` on.
  void run_blocks(LaneBlock* first, std::uint64_t cost, StepReport& report) noexcept {
    const auto alone = [&] {
      Outcome outcome;
      step_blocks(first, ~0u, outcome);
      add_to(report, outcome);
    };
    s.work.step(cost, alone, [&] {
      const std::uint64_t piece = s.work.piece_of(cost);
      int task_count = 0;
      for (LaneBlock* block = first; block != nullptr;) {
        Task& task = s.tasks_[static_cast<std::size_t>(task_count++)] = Task{};
        task.blocks = block;
        const bool is_last = task_count == max_tasks;
        for (std::uint64_t taken = 0; block != nullptr && (taken < piece || is_last); block = block->next) {
          taken += block->work;
          ++task.block_count;
        }
      }
      run_tasks(task_count, report);
    });
  }

 private:
  /// Writes the motions of contacts in lanes into their blocks, and links the blocks that the step has to
  /// run. Returns the first of them, null if there is none, and sets `cost` to their cost. Sets `others` to
  /// the number of items that are not in lanes.
  LaneBlock* assign_motions(std::size_t& others, std::uint64_t& cost, StepReport& report) noexcept {
    Outcome outcome;
    LaneBlock *first = nullptr, *last = nullptr;
    others = 0;
    for (std::size_t i = 0; i < items_.size(); ++i) {
      const std::uint32_t slot = slot_of(items_.id(i));
      const LaneAddress at = slot < s.pool.capacity() ? s.pool.lane(slot) : LaneAddress{};
      if (at.block == nullptr || at.generation != generation_of(items_.id(i))) {
        ++others;
        continue;
      }
      LaneBlock& block = *at.block;
      const std::uint32_t repeats = block.see(1u << at.lane, s.step_number_);
      const bool is_new = block.motions.named == 0;
      if (!items_.assign(block, at.lane, i, repeats != 0, outcome)) continue;
      if (is_new) {
        (first == nullptr ? first : last->next) = &block;
        last = &block;
        block.next = nullptr;
        cost += block.work;
      }
      block.motions.item[at.lane] = static_cast<std::uint32_t>(i);
      outcome.visited += block.springs;
    }
    add_to(report, outcome);
    return first;
  }

  /// Runs `count` blocks from `block` on.
  void step_blocks(LaneBlock* block, std::uint32_t count, Outcome& outcome) const noexcept {
    for (; block != nullptr && count > 0; --count) {
      LaneBlock* const next = block->next;
      if (next != nullptr) fetch(next, (offsetof(LaneBlock, state) + offsetof(LaneState, phase)) / 64);
      items_.step_block(*block, outcome);
      block = next;
    }
  }

  void run_patches(StepReport& report) noexcept {
    s.split_count_ = 0;
    const std::uint64_t cost = s.work.workers.count() > 1 ? count_cost() : 0;
    const auto alone = [&] {
      Outcome outcome;
      step_range({0, static_cast<std::uint32_t>(items_.size()), 0}, outcome);
      add_to(report, outcome);
    };
    s.work.step(cost, alone, [&] { split_and_run(cost, report); });
  }

  /// Prefetches the memory of patches that the next motions (before `last`) will need. Patches out of cache
  /// then take half the time (core/decisions/README.md, 007).
  [[gnu::always_inline]] void fetch_ahead(const Items& items, std::size_t i,
                                          std::size_t last) const noexcept {
    if (i + slots_ahead < last) {
      const std::uint32_t slot = slot_of(items.id(i + slots_ahead));
      if (slot < s.pool.capacity()) fetch(&s.pool.patch(slot), 1);
    }
    if (i + records_ahead < last) {
      const std::uint32_t slot = slot_of(items.id(i + records_ahead));
      if (slot >= s.pool.capacity()) return;
      const Patch& p = s.pool.patch(slot);
      if (find_bound(p, items.motion(i + records_ahead)) == Bound::rest) return;
      fetch(&p.position, sizeof(Patch) / 64 - 1);
      if (!p.snap_free) fetch(p.record, p.fetched_lines);
    }
  }

  /// Steps the motions of a range one after another. A patch that stays at rest is answered here, without a
  /// call of its contact model.
  void step_range(const Range& range, Outcome& outcome) noexcept {
    const bool notes = s.work.workers.count() > 1;
    const PatchPool& patches = s.pool;
    const Items items = items_;  // copied, because a store through other pointers cannot change the copy
    const std::uint64_t step_number = s.step_number_;
    int next_split = range.next_split;
    std::size_t fetch_until = range.first;
    for (std::size_t i = range.first; i < range.last; ++i) {
      if (next_split < s.split_count_ && s.splits_[static_cast<std::size_t>(next_split)].motion == i) {
        ++next_split;
        continue;
      }
      // Stops prefetching in a long row of resting patches. The processor's own prefetching reads those as
      // fast.
      if (i < fetch_until) fetch_ahead(items, i, range.last);
      Patch* p = patches.find(items.id(i));
      if (p != nullptr && p->in_lane) continue;  // assign_motions() has assigned or answered it
      if (p != nullptr && p->last_step != step_number && find_bound(*p, items.motion(i)) == Bound::rest) {
        p->last_step = step_number;
        outcome.status = outcome.status | items.rest(*p, i);
        ++outcome.stepped;
        continue;
      }
      p = items.admit(p, i, step_number, outcome.status);
      if (p == nullptr) continue;
      fetch_until = i + resting_row;
      outcome.visited += items.step(*p, i, outcome.status);
      ++outcome.stepped;
      if (notes) s.note_outlook(*p, items.id(i));
    }
  }

  static void run_task(void* self, int index) {
    Step& step = *static_cast<Step*>(self);
    Scheduler& s = step.s;
    Task& task = s.tasks_[static_cast<std::size_t>(index)];
    task.thread = this_thread();
    FloatModeScope mode;
    if (task.blocks != nullptr) {
      step.step_blocks(task.blocks, task.block_count, task.outcome);
    } else if constexpr (std::is_same_v<Items, Blocks>) {
      BRISTLE_ASSERT(false);  // unreachable: blocks of lanes are the only tasks of a group
    } else if (task.split >= 0) {
      const Split& split = s.splits_[static_cast<std::size_t>(task.split)];
      Totals totals{};  // kept out of `task`, whose neighbours in memory belong to other threads
      split.patch->model->shared->run(*split.patch, split.step, task.range.first, task.range.last, totals);
      task.totals = totals;
    } else {
      step.step_range(task.range, task.outcome);
    }
  }

  /// Returns the cost of an item's step, as a number of bristles: those that it may visit plus the fixed cost
  /// of a patch; 0 if there is nothing to do.
  std::uint64_t cost_of(std::size_t i) const noexcept {
    const std::uint32_t slot = slot_of(items_.id(i));
    if (slot >= s.pool.capacity()) return 0;
    const Outlook& outlook = s.pool.outlook(slot);
    if (outlook.bristles == Outlook::in_lane) return 0;
    const Motion& motion = items_.motion(i);
    const bool works = motion.displacement[0] != 0.0 || motion.displacement[1] != 0.0 ||
                       motion.normal_load != outlook.normal_load;
    return works ? s.work.constants.patch_overhead + outlook.bristles : 0;
  }

  /// Returns the estimated cost of all items of the step. Returns 0 if a slot is named twice, because such a
  /// step is never shared.
  std::uint64_t count_cost() noexcept {
    std::uint64_t cost = 0;
    const auto mark = static_cast<std::uint32_t>(s.step_number_);
    for (std::size_t i = 0; i < items_.size(); ++i) {
      const std::uint32_t slot = slot_of(items_.id(i));
      if (slot >= s.pool.capacity()) continue;
      if (std::exchange(s.pool.outlook(slot).last_counted, mark) == mark) return 0;
      cost += cost_of(i);
    }
    return cost;
  }

  /// Begins the step of a large patch and splits it into ranges of blocks of bristles, one for each task.
  /// Returns false, and begins nothing, if the patch cannot or need not be split, or if there is no room for
  /// its tasks.
  bool split_patch(std::size_t i, std::uint64_t pieces, int& task_count, Status& status) noexcept {
    if (pieces <= 1 || s.split_count_ >= max_split || task_count + static_cast<int>(pieces) >= max_tasks / 2)
      return false;
    Patch* const found = s.pool.find(items_.id(i));
    if (found == nullptr || found->model->shared == nullptr) return false;
    const Motion& motion = items_.motion(i);
    if (find_bound(*found, motion) == Bound::rest || !is_good_motion(found->axes, motion)) return false;
    Patch& p = *items_.admit(found, i, s.step_number_, status);
    Split& split = s.splits_[static_cast<std::size_t>(s.split_count_)];
    split.patch = &p;
    split.motion = i;
    split.first_task = task_count;
    const std::uint32_t blocks = begin_step(p, motion, items_.dt, split.step);
    // Gives each task whole groups of blocks, because the bounds below which no bristle snaps are kept for
    // groups.
    const std::uint32_t groups = (blocks + blocks_per_range - 1) / blocks_per_range;
    const std::uint32_t parts = std::min(static_cast<std::uint32_t>(pieces), groups);
    for (std::uint32_t k = 0; k < parts; ++k) {
      Task& task = s.tasks_[static_cast<std::size_t>(task_count++)] = Task{};
      task.split = s.split_count_;
      task.range.first = groups * k / parts * blocks_per_range;
      task.range.last = std::min(groups * (k + 1) / parts * blocks_per_range, blocks);
    }
    split.task_count = static_cast<int>(parts);
    ++s.split_count_;
    return true;
  }

  /// Writes the response of a split patch, from the sums of its tasks, when all of them are done.
  void finish_split(const Split& split, StepReport& report) noexcept {
    Patch& p = *split.patch;
    Totals totals{};
    for (int t = 0; t < split.task_count; ++t)
      add_totals(totals, s.tasks_[static_cast<std::size_t>(split.first_task + t)].totals);
    report.bristles_visited +=
        items_.end(p, split.motion, split.step, split.task_count == 0 ? nullptr : &totals, report.status);
    s.note_outlook(p, items_.id(split.motion));
    ++report.patches_stepped;
  }

  void split_and_run(std::uint64_t cost, StepReport& report) noexcept {
    const auto n = static_cast<std::uint32_t>(items_.size());
    const std::uint64_t piece = s.work.piece_of(cost);
    int task_count = 0;
    Range group;
    std::uint64_t group_cost = 0;
    std::uint32_t group_size = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint64_t patch_cost = cost_of(i);
      const std::uint64_t pieces = std::min<std::uint64_t>((patch_cost + piece - 1) / piece, 64);
      const bool is_split = patch_cost > 2 * s.work.constants.smallest_piece &&
                            split_patch(i, pieces, task_count, report.status);
      if (!is_split) {
        group_cost += patch_cost;
        ++group_size;
      }
      group.last = i + 1;
      const bool is_full = group_cost >= piece && task_count < max_tasks - 1;
      if (group_size == 0 || (i + 1 < n && !is_full)) continue;
      Task& task = s.tasks_[static_cast<std::size_t>(task_count++)] = Task{};
      task.range = group;
      group.first = i + 1;
      group.next_split = s.split_count_;
      group_cost = 0;
      group_size = 0;
    }
    run_tasks(task_count, report);
    for (int k = 0; k < s.split_count_; ++k) finish_split(s.splits_[static_cast<std::size_t>(k)], report);
  }

  void run_tasks(int task_count, StepReport& report) noexcept {
    s.work.run(task_count, &run_task, this);
    for (int t = 0; t < task_count; ++t) add_to(report, s.tasks_[static_cast<std::size_t>(t)].outcome);
    // Keeps the larger numbers for the report, because a step may share its cells and its motions in two
    // runs. Both numbers are 1 if there was no task and the calling thread did all the work.
    report.tasks = std::max(static_cast<std::uint32_t>(task_count), report.tasks);
    report.threads = std::max(s.count_threads(task_count), report.threads);
  }

  Scheduler& s;
  const Items& items_;
};

LaneBlock* Scheduler::link_group(const GroupStep& step, std::uint64_t& cost, Status* repeats) noexcept {
  const std::uint32_t slot = slot_of(step.group.first);
  const auto block_of = [&](std::size_t i) noexcept -> LaneBlock* {
    return pool.lane(slot + static_cast<std::uint32_t>(i)).block;
  };
  if (block_of(0) == nullptr) return nullptr;
  constexpr std::uint32_t all_lanes = (1u << lane_count) - 1;
  // Calls visit(block, index of its first contact, lanes) for the contacts that the step names.
  const auto for_each_block = [&](const auto& visit) {
    if (step.which.has_value()) {
      for (const std::uint32_t i : *step.which)
        visit(*block_of(i), i / lane_count * lane_count, 1u << i % lane_count);
      return;
    }
    for (std::uint32_t i = 0; i < step.group.count; i += lane_count) {
      if (i + blocks_ahead * lane_count < step.group.count) fetch(block_of(i + blocks_ahead * lane_count), 1);
      const std::uint32_t left = step.group.count - i;
      visit(*block_of(i), i, left < lane_count ? (1u << left) - 1 : all_lanes);
    }
  };
  LaneBlock *first = nullptr, *last = nullptr;
  Status repeated_ids = Status::ok;
  bool lent = true;
  for_each_block([&](LaneBlock& block, std::uint32_t index, std::uint32_t lanes) {
    for (std::uint32_t left = lanes & ~block.lent; left != 0; left &= left - 1)
      lent = lend(*block.patch[std::countr_zero(left)]) && lent;
    if (repeats != nullptr) {
      const std::uint32_t repeated = block.see(lanes, step_number_);
      if (repeated != 0) repeated_ids = Status::repeated_id;
      lanes &= ~repeated;
    }
    if (lanes == 0) return;
    if (block.asked == 0) {
      (first == nullptr ? first : last->next) = &block;
      last = &block;
      block.next = nullptr;
      cost += block.work;
    }
    block.asked |= lanes;
    block.first = index;
  });
  if (!lent) {
    for (LaneBlock* block = first; block != nullptr; block = block->next)
      block->seen &= ~std::exchange(block->asked, 0);
    return nullptr;
  }
  if (repeats != nullptr) *repeats = *repeats | repeated_ids;
  return first;
}

Status Scheduler::find_fault(const GroupStep& step) const noexcept {
  const PatchGroup& group = step.group;
  const Patch* first = group.count > 0 ? pool.find(group.first) : nullptr;
  const Patch* last = first != nullptr ? pool.find(group[group.count - 1]) : nullptr;
  if (last == nullptr || first->record->group == 0 || first->record->group != last->record->group ||
      pool.lane(slot_of(group.first)).lane != 0)
    return Status::unknown_id;
  bool fits = !step.displacement[0].empty() && !step.normal_load.empty() &&
              (!step.displacement[1].empty() || first->axes == 1) &&
              step.velocity[0].empty() == step.velocity[1].empty();
  const auto check = [&](const auto& column) {
    fits = fits && (column.empty() || column.size() == group.size());
  };
  for (int axis = 0; axis < 2; ++axis) {
    check(step.displacement[axis]);
    check(step.velocity[axis]);
    check(step.end[axis]);
    check(step.elastic[axis]);
    check(step.damper[axis]);
    check(step.mean[axis]);
  }
  for (const Span<double>& column :
       {step.stiffness, step.damping, step.force_limit, step.dissipated, step.contact_loss, step.damper_work})
    check(column);
  check(step.normal_load);
  check(step.snaps);
  check(step.status);
  if (step.which.has_value())
    for (const std::uint32_t i : *step.which) fits = fits && i < group.count;
  return fits ? Status::ok : Status::bad_input;
}

void Scheduler::step_group(double dt_s, const GroupStep& step, StepReport& report) noexcept {
  const Status fault = find_fault(step);
  report.status = report.status | fault;
  if (fault != Status::ok) {
    std::fill(step.status.begin(), step.status.end(), fault);
    return;
  }
  Blocks blocks{{dt_s, step, true}, 0};
  if (LaneBlock* first = link_group(step, blocks.cost, &report.status)) {
    Step<Blocks>(*this, blocks).run_blocks(first, blocks.cost, report);
    return;
  }
  // Steps contacts that are not all in blocks as single patches, as many at a time as there is memory for.
  const Outputs computed = pool.find(step.group.first)->outputs;
  std::vector<Motion>& motions = group_room.motions;
  std::vector<Response>& responses = group_room.responses;
  std::size_t count = 0;
  const auto run = [&] {
    const Motions items{dt_s, {motions.data(), count}, {responses.data(), count}};
    Step<Motions>(*this, items).run(report);
    for (std::size_t i = 0; i < count; ++i)
      if (!has(responses[i].status, Status::repeated_id))
        write_response(step, group_room.contacts[i], computed, responses[i]);
    count = 0;
  };
  for_each_named(step, [&](std::size_t contact) {
    motions[count] = motion_of(step, contact);
    group_room.contacts[count] = contact;
    if (++count == motions.size()) run();
  });
  if (count > 0) run();
}

bool Scheduler::try_group(double dt_s, const GroupStep& step, StepReport& report) noexcept {
  Blocks blocks{{dt_s, step, false}, 0};
  LaneBlock* const first = link_group(step, blocks.cost, nullptr);
  if (first != nullptr) Step<Blocks>(*this, blocks).run_blocks(first, blocks.cost, report);
  return first != nullptr;
}

StepReport Scheduler::step(double dt_s, const StepItems& all) noexcept {
  StepReport report;
  report.tasks = report.threads = 1;
  ++step_number_;
  const FloatModeScope mode;
  for (const GroupStep& group : all.groups) step_group(dt_s, group, report);
  const Motions items{dt_s, all.motions, all.responses};
  Step(*this, items).run(report);
  return report;
}

void Scheduler::note_outlook(const Patch& p, PatchId id) const noexcept {
  Outlook& outlook = pool.outlook(slot_of(id));
  outlook.normal_load = p.normal_load;
  outlook.bristles = p.in_contact();
}

void Scheduler::add_to(StepReport& report, const Outcome& outcome) noexcept {
  report.status = report.status | outcome.status;
  report.patches_stepped += outcome.stepped;
  report.bristles_visited += outcome.visited;
}

std::uint32_t Scheduler::count_threads(int task_count) const noexcept {
  std::array<const void*, max_tasks> seen;
  std::uint32_t count = 0;
  for (int t = 0; t < task_count; ++t) {
    const void* thread = tasks_[static_cast<std::size_t>(t)].thread;
    if (std::find(seen.begin(), seen.begin() + count, thread) == seen.begin() + count) seen[count++] = thread;
  }
  return count;
}

}  // namespace bristle::detail
