#include "bristle/patch_batch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <unordered_map>
#include <vector>

#include "bristle/deadline_monitor.hpp"
#include "bristle/error.hpp"
#include "core/common/assert.hpp"
#include "core/common/hashing.hpp"
#include "core/common/range_check.hpp"
#include "core/patches/contact_model.hpp"
#include "core/patches/representatives/representatives.hpp"
#include "core/patches/saved_state.hpp"
#include "core/patches/sliders/sliders.hpp"
#include "core/runtime/batch_access.hpp"
#include "core/runtime/chosen_kernels.hpp"
#include "core/runtime/command_list.hpp"
#include "core/runtime/float_mode.hpp"
#include "core/runtime/sharing.hpp"
#include "core/runtime/stepping_side.hpp"
#include "core/runtime/workers.hpp"

namespace bristle {

using namespace detail;

namespace {

constexpr int max_tasks = 512;
constexpr int max_split = 64;

thread_local char this_thread;  // its address tells threads apart

/// Whether a time step is allowed. A denormal one is not, because it would read as 0 or not by the caller's
/// floating-point mode.
bool is_good_time(double dt_s) noexcept {
  return dt_s >= std::numeric_limits<double>::min() && dt_s <= std::numeric_limits<double>::max();
}

/// Where the memory of the patches after this one is asked for ahead of time: its slot, then its record.
constexpr std::size_t slots_ahead = 4;
constexpr std::size_t records_ahead = 2;
constexpr std::size_t resting_row = 16;

/// Calls `visit(slot, patch)` for each patch of the pool, by slot.
template <class Visit>
void for_each_patch(const PatchPool& pool, Visit&& visit) {
  for (std::uint32_t slot = 0; slot < pool.capacity(); ++slot) {
    Patch& p = pool.patch(slot);
    if (p.generation != 0) visit(slot, p);
  }
}

}  // namespace

struct PatchBatch::Impl {
  explicit Impl(const BatchOptions& options)
      : kernels(choose_kernels(options.isa)),
        workers(check_threads(options.threads), check_core(options.servo_core)),
        skips(!options.eager),
        queue(new MoveQueue(PatchPool::first_slots)) {
    name_kernels();
    name_sliders();
    pool.put(0, std::make_unique<PatchChunk>(PatchPool::first_slots));
  }
  ~Impl() {
    for (std::uint32_t slot = 0; slot < pool.capacity(); ++slot) release(pool.patch(slot).record);
  }

  const KernelTable& kernels;
  Workers workers;
  const Sharing sharing = chosen_sharing();
  Retreat retreat;
  double last_sizable_step = -1.0;  ///< when the last step ended that may be worth sharing, s
  const bool skips;
  CommandList commands;

  // --- the adding thread's side
  SteppingSide adding_side;
  struct Record {
    PatchOptions options;
    double full_weight = 0.0;
    bool alive = false;
    const ContactModel* model = nullptr;
  };
  SlotList slots;
  std::vector<Record> records;                                     ///< by slot
  std::vector<std::shared_ptr<const CompiledMaterial>> materials;  ///< recently used first
  int chunks = 1;
  std::size_t scratch_bytes = 0;
  bool publishes_later = false;  ///< commands are published when BatchAccess::Changes ends

  // --- the stepping thread's side
  mutable SteppingSide stepping_side;
  bool is_in_turn = false;  ///< BatchAccess::Turn has taken the changes of the call that is under way
  PatchPool pool;
  std::unique_ptr<MoveQueue> queue;
  std::uint32_t queue_length = 0;
  Scratch scratch;  ///< as large as the largest patch's record
  std::uint64_t step_number = 0;
  Int128 clock = 0;  ///< runs on in every step, whoever is named in it (PatchRecord::clock)
  std::size_t patches = 0;

  /// A copy of a patch under a load that was tried, until anything changes: a solver asks for many motions
  /// under the same new load.
  struct Trial {
    const Patch* of = nullptr;
    double normal_load = 0.0;
    double contact_loss = 0.0;
    Patch patch;
  };
  Trial trial;

  struct Range {
    std::uint32_t first = 0, last = 0;
    int next_split = 0;  ///< of motions: the first of the splits that may lie among them
  };
  /// Result of stepping a range of motions.
  struct Outcome {
    std::uint64_t visited = 0;
    std::uint32_t stepped = 0;
    Status status = Status::ok;
  };
  /// A piece of a shared step: a range of blocks of one large patch, or a range of motions.
  struct Task {
    int split = -1;
    Range range;
    Totals totals;
    Outcome outcome;
    const void* thread = nullptr;  ///< who did it
    double end = 0.0;              ///< when it was done, s
  };
  struct Split {
    Patch* patch = nullptr;
    std::size_t motion = 0;
    PatchStep step;
    int first_task = 0, task_count = 0;
  };
  std::array<Task, max_tasks> tasks;
  std::array<Split, max_split> splits;  ///< by motion
  int split_count = 0;
  double dt = 0.0;
  Span<const Motion> in;
  Span<Response> out;

  Record& record_of(PatchId id) {
    const std::uint32_t slot = slot_of(id);
    if (slot >= records.size() || !records[slot].alive || slots.generation(slot) != generation_of(id))
      throw Error("PatchBatch: there is no patch with id " + std::to_string(id.value));
    return records[slot];
  }

  std::shared_ptr<const CompiledMaterial> compiled(const Material& material) {
    for (std::size_t i = 0; i < materials.size(); ++i) {
      if (materials[i]->material != material) continue;
      std::rotate(materials.begin(), materials.begin() + static_cast<std::ptrdiff_t>(i),
                  materials.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      return materials.front();
    }
    if (materials.size() >= 64) materials.pop_back();
    materials.insert(materials.begin(), compile_material(material));
    return materials.front();
  }

  /// Takes what the adding thread had handed over when the call began. Neither allocates nor frees.
  void apply_commands() noexcept {
    if (is_in_turn) return;
    const std::uint64_t last = commands.pushed();
    while (Command* c = commands.take(last)) {
      trial.of = nullptr;
      if (c->scratch.memory) std::swap(scratch, c->scratch);
      switch (c->kind) {
        case Command::Kind::add:
          c->patch.record->clock = &clock;
          c->patch.record->epoch = clock;
          pool.patch(c->slot) = c->patch;
          pool.outlook(c->slot) = {-1.0, c->patch.record->largest_work, 0};
          c->patch.record = nullptr;
          ++patches;
          break;
        case Command::Kind::replace: {
          FloatModeScope mode;
          Patch& p = pool.patch(c->slot);
          c->patch.record->clock = &clock;
          c->patch.record->epoch = p.record->epoch;
          p.model->take_over(c->patch, p);
          take_hold_over(c->patch, p);
          keep_place(c->patch, p);
          std::swap(p, c->patch);
          break;
        }
        case Command::Kind::remove: {
          Patch& p = pool.patch(c->slot);
          c->removed = std::exchange(p.record, nullptr);
          p.generation = 0;
          --patches;
          break;
        }
        case Command::Kind::grow:
          pool.put(static_cast<int>(c->slot), std::move(c->chunk));
          std::copy_n(queue->motions.begin(), queue_length, c->queue->motions.begin());
          std::swap(queue, c->queue);
          break;
        case Command::Kind::change:
          c->change->apply();
          break;
        case Command::Kind::none:
          break;
      }
    }
  }

  void attach_scratch(Command& command) {
    std::size_t bytes = command.patch.record->bytes;
#if BRISTLE_ASSERTS
    bytes = std::max(bytes, saved_size_of(command.patch));  // is_sound() saves into it
#endif
    if (bytes <= scratch_bytes) return;
    command.scratch.memory.reset(
        static_cast<std::byte*>(::operator new (bytes, std::align_val_t{column_alignment})));
    command.scratch.bytes = bytes;
  }

  /// Looks through all patches after each of the first steps, and then now and then: a look costs more than a
  /// step.
  bool is_sound() noexcept {
    if (step_number > 16 && step_number % 64 != 0) return true;
    bool sound = true;
    trial.of = nullptr;
    for_each_patch(pool, [&](std::uint32_t, const Patch& p) {
      sound = sound && find_present_fault(p, scratch.memory.get()) == nullptr;
    });
    return sound;
  }

  /// Pushes a command. Nothing can fail after this point, so its memory is counted only here.
  void send(std::unique_ptr<Command> command) noexcept {
    if (command->scratch.memory) scratch_bytes = command->scratch.bytes;
    commands.push(std::move(command), !publishes_later);
  }

  PatchId add(const Patch& made) {
    const auto give_back = [](PatchRecord* record) { release(record); };
    std::unique_ptr<PatchRecord, decltype(give_back)> owner(made.record, give_back);
    auto command = std::make_unique<Command>();
    command->patch = made;
    owner.release();  // the command's from here on
    attach_scratch(*command);
    return add_to(slots.take(), std::move(command));
  }

  /// `command` has the patch, and scratch where that needs it.
  PatchId add_to(const SlotList::Slot& slot, std::unique_ptr<Command> command) {
    const Patch& made = command->patch;
    command->kind = Command::Kind::add;
    command->patch.skips = skips;
    records.resize(slots.size());
    while (slot.number >= PatchPool::first_of(chunks - 1) + PatchPool::slots_of(chunks - 1)) grow_pool();
    records[slot.number] = {made.record->options, made.record->full_weight, true, made.model};
    command->slot = slot.number;
    command->patch.generation = slot.generation;
    send(std::move(command));
    return make_id(slot.number, slot.generation);
  }

  /// Another chunk of slots, when all are taken. Throws std::bad_alloc.
  void grow_pool() {
    auto grow = std::make_unique<Command>();
    grow->kind = Command::Kind::grow;
    grow->slot = static_cast<std::uint32_t>(chunks);
    grow->chunk = std::make_unique<PatchChunk>(PatchPool::slots_of(chunks));
    grow->queue = std::make_unique<MoveQueue>(PatchPool::first_of(chunks) + PatchPool::slots_of(chunks));
    ++chunks;
    send(std::move(grow));
  }

  bool reset(PatchId id, std::uint32_t seed, std::uint64_t key) noexcept {
    Patch* p = pool.find(id);
    if (p == nullptr) return false;
    const FloatModeScope mode;
    trial.of = nullptr;
    const Patch before = *p;
    p->record->epoch = clock;
    p->model->reset(*p, seed, key);
    p->record->hold = {};
    p->record->remainder[0] = p->record->remainder[1] = 0.0;
    keep_place(*p, before);
    pool.note(slot_of(id)).last = Response{};
    return true;
  }

  std::size_t state_size() const noexcept {
    std::size_t size = saved_batch_size;
    for_each_patch(pool, [&](std::uint32_t, const Patch& p) { size += saved_size_of(p); });
    return size;
  }

  /// Refuses motions that cannot be stepped; returns null for those.
  Patch* admit(Patch* p, std::size_t i) noexcept {
    out[i].id = in[i].id;
    if (p == nullptr) {
      write_refusal(nullptr, Status::unknown_id, out[i]);
      return nullptr;
    }
    if (p->last_step == step_number) {
      write_refusal(p, Status::repeated_id, out[i]);
      return nullptr;
    }
    p->last_step = step_number;
    if (!is_good_motion(*p, in[i])) {
      write_refusal(p, Status::bad_input, out[i]);
      return nullptr;
    }
    return p;
  }

  /// Requests the memory of the next motions before `last`. Patches out of cache then take half the time
  /// (core/decisions/007-memory-and-threads.md).
  [[gnu::always_inline]] void fetch_ahead(std::size_t i, std::size_t last) const noexcept {
    if (i + slots_ahead < last) {
      const std::uint32_t slot = slot_of(in[i + slots_ahead].id);
      if (slot < pool.capacity()) fetch(&pool.patch(slot), 1);
    }
    if (i + records_ahead < last) {
      const std::uint32_t slot = slot_of(in[i + records_ahead].id);
      if (slot >= pool.capacity()) return;
      const Patch& p = pool.patch(slot);
      if (stays_at_rest(p, in[i + records_ahead])) return;
      fetch(&p.position, sizeof(Patch) / 64 - 1);
      if (!p.held) fetch(p.record, p.fetched_lines);
    }
  }
  // Inlined by force: g++ 12 takes a function that does nothing but prefetch for one without effect. Of the
  // number of an address: a slot without a patch has no record, and what is reckoned from a null pointer is
  // undefined.
  [[gnu::always_inline]] static void fetch(const void* memory, int lines) noexcept {
    const auto address = reinterpret_cast<std::uintptr_t>(memory);
    for (std::uintptr_t line = 0; line < static_cast<std::uintptr_t>(lines); ++line)
      __builtin_prefetch(reinterpret_cast<const void*>(address + 64 * line));
  }

  /// Steps one motion, start to end, on one thread.
  void step_one(Patch& p, std::size_t i, Outcome& outcome) noexcept {
    outcome.visited += step_patch(p, in[i], dt, out[i]);
    outcome.status = outcome.status | out[i].status;
    ++outcome.stepped;
  }

  /// Steps the motions of a range, one after another. A patch at rest is answered without a call of its
  /// model.
  void step_range(const Range& range, Outcome& outcome) noexcept {
    const bool notes = workers.count() > 1;
    int next_split = range.next_split;
    std::size_t fetch_until = range.first;
    for (std::size_t i = range.first; i < range.last; ++i) {
      if (next_split < split_count && splits[static_cast<std::size_t>(next_split)].motion == i) {
        ++next_split;
        continue;
      }
      // A long row of resting patches is read as fast without asking.
      if (i < fetch_until) fetch_ahead(i, range.last);
      Patch* p = pool.find(in[i].id);
      if (p != nullptr && p->last_step != step_number && stays_at_rest(*p, in[i])) {
        p->last_step = step_number;
        out[i].id = in[i].id;
        answer_at_rest(*p, out[i]);
        outcome.status = outcome.status | out[i].status;
        ++outcome.stepped;
        continue;
      }
      p = admit(p, i);
      if (p == nullptr) {
        outcome.status = outcome.status | out[i].status;
        continue;
      }
      fetch_until = i + resting_row;
      step_one(*p, i, outcome);
      if (notes) note_outlook(*p, slot_of(in[i].id));
    }
  }

  void note_outlook(const Patch& p, std::uint32_t slot) const noexcept {
    Outlook& outlook = pool.outlook(slot);
    outlook.normal_load = p.normal_load;
    outlook.bristles = p.in_contact();
  }

  static void run_task(void* self, int index) {
    Impl& impl = *static_cast<Impl*>(self);
    Task& task = impl.tasks[static_cast<std::size_t>(index)];
    task.thread = &this_thread;
    FloatModeScope mode;
    if (task.split >= 0) {
      const Split& split = impl.splits[static_cast<std::size_t>(task.split)];
      Totals totals{};  // not in `task`: its neighbours belong to other threads
      split.patch->model->run(*split.patch, split.step, task.range.first, task.range.last, totals);
      task.totals = totals;
    } else {
      impl.step_range(task.range, task.outcome);
    }
    task.end = DeadlineMonitor::wall_now();
  }

  /// Time that the calling thread worked in a shared step, and then waited for others, s.
  struct Held {
    double worked = 0.0, waited = 0.0;
  };
  Held held;

  /// A task of a model that prepares a step (Crew).
  struct Errand {
    void (*task)(void* of, int k);
    void* of;
    const void* caller;
    double own_end;  ///< when the caller did its last, s

    static void run(void* errand, int k) {
      Errand& e = *static_cast<Errand*>(errand);
      {
        FloatModeScope mode;
        e.task(e.of, k);
      }
      if (e.caller == &this_thread) e.own_end = DeadlineMonitor::wall_now();
    }
  };
  static void run_errands(void* self, int tasks, void (*task)(void*, int), void* of) noexcept {
    Impl& impl = *static_cast<Impl*>(self);
    const double start = DeadlineMonitor::wall_now();
    Errand errand{task, of, &this_thread, start};
    impl.workers.run(tasks, &Errand::run, &errand);
    impl.note_held(start, errand.own_end);
  }
  void note_held(double start, double own_end) noexcept {
    held.worked += own_end - start;
    held.waited += DeadlineMonitor::wall_now() - own_end;
  }

  /// Bristles that the step may visit, with what a patch costs beside them. 0 = nothing is to be done.
  std::uint64_t cost_of(const Motion& motion) const noexcept {
    const std::uint32_t slot = slot_of(motion.id);
    if (slot >= pool.capacity()) return 0;
    const Outlook& outlook = pool.outlook(slot);
    const bool works = motion.displacement[0] != 0.0 || motion.displacement[1] != 0.0 ||
                       motion.normal_load != outlook.normal_load;
    return works ? sharing.patch_overhead + outlook.bristles : 0;
  }

  /// Estimated cost of all motions; 0 where a slot is named twice, because such a step is not worth sharing.
  std::uint64_t count_cost() noexcept {
    std::uint64_t cost = 0;
    const auto mark = static_cast<std::uint32_t>(step_number);
    for (std::size_t i = 0; i < in.size(); ++i) {
      const std::uint32_t slot = slot_of(in[i].id);
      if (slot >= pool.capacity()) continue;
      if (std::exchange(pool.outlook(slot).last_counted, mark) == mark) return 0;
      cost += cost_of(in[i]);
    }
    return cost;
  }

  StepReport step_all() noexcept {
    StepReport report;
    ++step_number;
    trial.of = nullptr;
    split_count = 0;
    FloatModeScope mode;
    const std::uint64_t cost = workers.count() > 1 ? count_cost() : 0;
    const bool sizable = cost >= sharing.parallel_from;
    const bool pays = sizable && (cost >= sharing.parallel_from_paused ||
                                  DeadlineMonitor::wall_now() - last_sizable_step < sharing.awake);
    const bool shared = pays && retreat.is_over();
    report.tasks = 1;
    report.threads = 1;
    if (shared) {
      split_and_run(cost, report);
    } else {
      Outcome outcome;
      step_range({0, static_cast<std::uint32_t>(in.size())}, outcome);
      add_to(report, outcome);
    }
    if (sizable) last_sizable_step = DeadlineMonitor::wall_now();
    return report;
  }

  static void add_to(StepReport& report, const Outcome& outcome) noexcept {
    report.status = report.status | outcome.status;
    report.patches_stepped += outcome.stepped;
    report.bristles_visited += outcome.visited;
  }

  /// The step proper; the caller took the commands, so that the table stays as it is.
  StepReport step(double dt_s, Span<const Motion> motions, Span<Response> responses) noexcept {
    if (!is_good_time(dt_s) || motions.size() != responses.size()) {
      StepReport report;
      report.status = Status::bad_input;
      for (std::size_t i = 0; i < responses.size(); ++i) {
        if (i < motions.size()) responses[i].id = motions[i].id;
        write_refusal(i < motions.size() ? pool.find(motions[i].id) : nullptr, Status::bad_input,
                      responses[i]);
      }
      return report;
    }
    dt = dt_s;
    in = motions;
    out = responses;
    const StepReport report = step_all();
    run_on(dt_s);
    return report;
  }

  void run_on(double dt_s) noexcept {
    if (stands_still(clock)) return;
    const double units = std::min(dt_s, longest_time) * clock_units_per_second;
    // A short step without the long conversion.
    clock += units < 9e18 ? Int128{static_cast<std::int64_t>(units)} : static_cast<Int128>(units);
  }

  /// A large patch goes by ranges of blocks. False: there is no room for its tasks, or none are needed.
  bool split_patch(std::size_t i, std::uint64_t pieces, int& task_count) noexcept {
    if (pieces <= 1 || split_count >= max_split || task_count + static_cast<int>(pieces) >= max_tasks / 2)
      return false;
    Patch* const found = pool.find(in[i].id);
    if (found == nullptr || stays_at_rest(*found, in[i]) || !is_good_motion(*found, in[i])) return false;
    Patch& p = *admit(found, i);
    Split& split = splits[static_cast<std::size_t>(split_count)];
    split.patch = &p;
    split.motion = i;
    double contact_loss = 0.0;
    if (in[i].normal_load != p.normal_load) contact_loss = p.model->apply_load(p, in[i].normal_load);
    split.step = read_motion(p, in[i], dt, true);
    split.step.contact_loss = contact_loss;
    split.first_task = task_count;
    split.task_count = 0;
    if (split.step.moves && !holds_still(p, split.step)) {
      find_direction(split.step.advance);
      // Whole groups of blocks to a task: bounds are kept by group.
      const Crew crew{&run_errands, this, static_cast<std::uint32_t>(workers.count()),
                      static_cast<std::uint32_t>(pieces)};
      split.step.crew = &crew;
      const std::uint32_t blocks = p.model->prepare(p, split.step);
      split.step.crew = nullptr;
      const std::uint32_t groups = (blocks + blocks_per_range - 1) / blocks_per_range;
      const std::uint32_t parts = std::min(static_cast<std::uint32_t>(pieces), groups);
      for (std::uint32_t k = 0; k < parts; ++k) {
        Task& task = tasks[static_cast<std::size_t>(task_count++)] = Task{};
        task.split = split_count;
        task.range.first = groups * k / parts * blocks_per_range;
        task.range.last = std::min(groups * (k + 1) / parts * blocks_per_range, blocks);
      }
      split.task_count = static_cast<int>(parts);
    }
    ++split_count;
    return true;
  }

  /// The response of a patch whose ranges are done.
  void finish_split(const Split& split, StepReport& report) noexcept {
    Patch& p = *split.patch;
    Response& response = out[split.motion];
    StepSums sums;
    if (split.task_count == 0) {
      hold(p, split.step.advance, sums);
    } else {
      Totals totals{};
      for (int t = 0; t < split.task_count; ++t)
        add_totals(totals, tasks[static_cast<std::size_t>(split.first_task + t)].totals);
      p.model->finish(p, split.step, totals, sums);
    }
    write_response(p, split.step, sums, response);
    note_outlook(p, slot_of(response.id));
    report.status = report.status | response.status;
    report.bristles_visited += sums.visited;
    ++report.patches_stepped;
  }

  void split_and_run(std::uint64_t cost, StepReport& report) noexcept {
    const auto n = static_cast<std::uint32_t>(in.size());
    held = Held{};
    const std::uint64_t piece = std::max<std::uint64_t>(
        cost / (static_cast<std::uint64_t>(workers.count()) * 4), sharing.smallest_piece);
    int task_count = 0;
    Range group;
    std::uint64_t group_cost = 0;
    std::uint32_t group_size = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint64_t patch_cost = cost_of(in[i]);
      const std::uint64_t pieces = std::min<std::uint64_t>((patch_cost + piece - 1) / piece, 64);
      const bool is_split = patch_cost > 2 * sharing.smallest_piece && split_patch(i, pieces, task_count);
      if (!is_split) {
        group_cost += patch_cost;
        ++group_size;
      }
      group.last = i + 1;
      const bool is_full = group_cost >= piece && task_count < max_tasks - 1;
      if (group_size == 0 || (i + 1 < n && !is_full)) continue;
      Task& task = tasks[static_cast<std::size_t>(task_count++)] = Task{};
      task.range = group;
      group.first = i + 1;
      group.next_split = split_count;
      group_cost = 0;
      group_size = 0;
    }
    const double start = DeadlineMonitor::wall_now();
    workers.run(task_count, &run_task, this);
    double own_end = start;
    for (int t = 0; t < task_count; ++t) {
      const Task& task = tasks[static_cast<std::size_t>(t)];
      if (task.thread == &this_thread) own_end = std::max(own_end, task.end);
      add_to(report, task.outcome);
    }
    note_held(start, own_end);
    retreat.judge(held.worked, held.waited);
    for (int s = 0; s < split_count; ++s) finish_split(splits[static_cast<std::size_t>(s)], report);
    // Where all that could have been shared holds still, the calling thread did what there was.
    report.tasks = std::max(static_cast<std::uint32_t>(task_count), 1u);
    report.threads = std::max(count_threads(task_count), 1u);
  }

  std::uint32_t count_threads(int task_count) const noexcept {
    std::array<const void*, max_tasks> seen;
    std::uint32_t count = 0;
    for (int t = 0; t < task_count; ++t) {
      const void* thread = tasks[static_cast<std::size_t>(t)].thread;
      if (std::find(seen.begin(), seen.begin() + count, thread) == seen.begin() + count)
        seen[count++] = thread;
    }
    return count;
  }
};

PatchBatch::PatchBatch(const BatchOptions& options, const BuildSignature& headers) {
  check_build(headers);
  impl_ = std::make_unique<Impl>(options);
}
PatchBatch::~PatchBatch() = default;
PatchBatch::PatchBatch(PatchBatch&&) noexcept = default;
PatchBatch& PatchBatch::operator=(PatchBatch&&) noexcept = default;

PatchId PatchBatch::add(const Material& material, const PatchOptions& options) {
  const SteppingCall call(impl_->adding_side);
  const FloatModeScope mode;  // the caller's rounding must not reach our bits
  return impl_->add(make_patch(impl_->compiled(material), options, impl_->kernels));
}

PatchId BatchAccess::add(PatchBatch& batch, const Patch& made) {
  const SteppingCall call(batch.impl_->adding_side);
  return batch.impl_->add(made);
}

BatchAccess::Turn::Turn(PatchBatch& batch) noexcept : impl_(*batch.impl_) {
  impl_.stepping_side.enter();
  is_outermost_ = !impl_.is_in_turn;
  impl_.apply_commands();
  impl_.is_in_turn = true;
}
BatchAccess::Turn::~Turn() {
  if (is_outermost_) impl_.is_in_turn = false;
  impl_.stepping_side.leave();
}

BatchAccess::Changes::Changes(PatchBatch& batch) noexcept : impl_(*batch.impl_) {
  impl_.adding_side.enter();
  impl_.publishes_later = true;
}
BatchAccess::Changes::~Changes() {
  impl_.publishes_later = false;
  impl_.commands.publish();
  impl_.adding_side.leave();
}
void BatchAccess::Changes::send(std::unique_ptr<Change>&& change) {
  auto command = std::make_unique<Command>();
  command->kind = Command::Kind::change;
  command->change = std::move(change);
  impl_.send(std::move(command));
}

const char* BatchAccess::find_fault(PatchBatch& batch) {
  const Turn turn(batch);
  std::vector<std::byte> room;
  const char* fault = nullptr;
  for_each_patch(batch.impl_->pool, [&](std::uint32_t, const Patch& p) {
    room.resize(saved_size_of(p));
    if (fault == nullptr) fault = find_present_fault(p, room.data());
  });
  return fault;
}

void BatchAccess::forget_trials(PatchBatch& batch) noexcept { batch.impl_->trial.of = nullptr; }

Patch* BatchAccess::find(PatchBatch& batch, PatchId id) noexcept { return batch.impl_->pool.find(id); }

Outputs BatchAccess::outputs(const PatchBatch& batch, PatchId id) noexcept {
  const SteppingCall call(batch.impl_->stepping_side);
  batch.impl_->apply_commands();
  const Patch* p = batch.impl_->pool.find(id);
  return p != nullptr ? p->outputs : Outputs::end;
}

BatchRecipe BatchAccess::recipe(const PatchBatch& batch) {
  PatchBatch::Impl& impl = *batch.impl_;
  const SteppingCall call(impl.stepping_side);
  impl.apply_commands();
  BatchRecipe recipe;
  recipe.generations = impl.slots.generations();
  recipe.free_slots = impl.slots.free_slots();
  std::unordered_map<const CompiledMaterial*, std::uint32_t> indices;
  for_each_patch(impl.pool, [&](std::uint32_t slot, const Patch& p) {
    const auto [found, is_new] =
        indices.try_emplace(p.record->material, static_cast<std::uint32_t>(recipe.materials.size()));
    if (is_new) recipe.materials.push_back(p.material().material);
    PatchOptions options = p.record->options;
    options.seed = p.record->first_seed;
    recipe.patches.push_back({slot, found->second, options, p.record->full_weight});
  });
  return recipe;
}

void BatchAccess::fill(PatchBatch& empty, const BatchRecipe& recipe) {
  PatchBatch::Impl& impl = *empty.impl_;
  const auto require = [](bool holds) {
    if (!holds) throw Error("PatchBatch: these are not the patches of a batch");
  };
  const std::size_t slots = recipe.generations.size();
  require(impl.slots.size() == 0 && slots <= std::numeric_limits<std::uint32_t>::max() / 2);
  std::vector<char> used(slots, 0);
  const auto use = [&](std::uint32_t slot) {
    require(slot < slots && !used[slot] && recipe.generations[slot] > 0);
    used[slot] = 1;
  };
  for (const std::uint32_t slot : recipe.free_slots) use(slot);
  for (const PatchRecipe& patch : recipe.patches) {
    use(patch.slot);
    require(patch.material < recipe.materials.size() && patch.full_weight > 0.0 &&
            std::isfinite(patch.full_weight));
  }
  const FloatModeScope mode;
  impl.slots.assign(recipe.generations, recipe.free_slots);
  impl.records.resize(slots);
  for (const PatchRecipe& patch : recipe.patches) {
    auto command = std::make_unique<Command>();
    command->patch = make_patch(impl.compiled(recipe.materials[patch.material]), patch.options, impl.kernels,
                                patch.full_weight);
    impl.attach_scratch(*command);
    impl.add_to({patch.slot, recipe.generations[patch.slot]}, std::move(command));
  }
}

Outputs find_outputs(const PatchBatch& batch, PatchId id) noexcept { return BatchAccess::outputs(batch, id); }
BatchRecipe find_recipe(const PatchBatch& batch) { return BatchAccess::recipe(batch); }
void fill_batch(PatchBatch& empty, const BatchRecipe& recipe) { BatchAccess::fill(empty, recipe); }

void PatchBatch::remove(PatchId id) {
  Impl& impl = *impl_;
  const SteppingCall call(impl.adding_side);
  Impl::Record& record = impl.record_of(id);
  auto command = std::make_unique<Command>();
  command->kind = Command::Kind::remove;
  command->slot = slot_of(id);
  impl.send(std::move(command));
  record.alive = false;
  impl.slots.give_back(slot_of(id));
}

void PatchBatch::set_material(PatchId id, const Material& material) {
  Impl& impl = *impl_;
  const SteppingCall call(impl.adding_side);
  const Impl::Record& record = impl.record_of(id);
  FloatModeScope mode;
  auto command = std::make_unique<Command>();
  command->kind = Command::Kind::replace;
  command->slot = slot_of(id);
  command->patch = make_patch(impl.compiled(material), record.options, impl.kernels, record.full_weight);
  if (command->patch.model != record.model)
    throw Error(
        "PatchBatch::set_material: the patch and the new material are not of one kind: bristles that slide "
        "(SnapRule::slide) and bristles that snap have other states; remove the patch and add another");
  impl.attach_scratch(*command);
  impl.send(std::move(command));
}

void PatchBatch::warm_up() {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  impl_->workers.warm_up();
}

StepReport PatchBatch::step(double dt_s, Span<const Motion> in, Span<Response> out) noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  const StepReport report = impl_->step(dt_s, in, out);
  BRISTLE_ASSERT(impl_->is_sound());
  return report;
}

void PatchBatch::move(PatchId id, double dx_m, double dy_m, double normal_load_n) noexcept {
  Impl& impl = *impl_;
  const SteppingCall call(impl.stepping_side);
  impl.apply_commands();
  if (impl.pool.find(id) == nullptr) return;
  // One entry for a slot at the most: a patch that follows a removed one takes its place in the queue.
  std::uint32_t& queued = impl.pool.note(slot_of(id)).queued;
  if (queued == 0) queued = ++impl.queue_length;
  Motion& motion = impl.queue->motions[queued - 1];
  motion = Motion{};
  motion.id = id;
  motion.displacement[0] = dx_m;
  motion.displacement[1] = dy_m;
  motion.normal_load = normal_load_n;
}

StepReport PatchBatch::step(double dt_s) noexcept {
  Impl& impl = *impl_;
  const SteppingCall call(impl.stepping_side);
  impl.apply_commands();
  MoveQueue& queue = *impl.queue;
  const std::uint32_t count = impl.queue_length;
  std::fill_n(queue.responses.begin(), count, Response{});
  const StepReport report = impl.step(dt_s, Span<const Motion>(queue.motions.data(), count),
                                      Span<Response>(queue.responses.data(), count));
  for (std::uint32_t i = 0; i < count; ++i) {
    const PatchId id = queue.motions[i].id;
    SlotNote& note = impl.pool.note(slot_of(id));
    note.queued = 0;
    if (impl.pool.find(id) != nullptr) note.last = queue.responses[i];
  }
  impl.queue_length = 0;
  return report;
}

Response PatchBatch::force(PatchId id) const noexcept {
  Impl& impl = *impl_;
  const SteppingCall call(impl.stepping_side);
  impl.apply_commands();
  if (impl.pool.find(id) != nullptr && impl.pool.note(slot_of(id)).last.id == id)
    return impl.pool.note(slot_of(id)).last;
  Response none;
  none.id = id;
  none.status = Status::unknown_id;
  return none;
}

bool PatchBatch::reset(PatchId id) noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  const Patch* p = impl_->pool.find(id);
  return p != nullptr && impl_->reset(id, p->record->options.seed, p->record->options.key);
}

bool PatchBatch::reset(PatchId id, std::uint32_t seed, std::uint64_t key) noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  return impl_->reset(id, seed, key);
}

Response PatchBatch::find_force(double dt_s, const Motion& motion) noexcept {
  Impl& impl = *impl_;
  const SteppingCall call(impl.stepping_side);
  impl.apply_commands();
  FloatModeScope mode;
  Response response;
  response.id = motion.id;
  Patch* p = impl.pool.find(motion.id);
  if (p == nullptr) {
    write_refusal(nullptr, Status::unknown_id, response);
    return response;
  }
  if (!is_good_time(dt_s) || !is_good_motion(*p, motion)) {
    write_refusal(p, Status::bad_input, response);
    return response;
  }
  if (motion.normal_load == p->normal_load && !needs_copy(*p, motion)) {
    find_response(*p, motion, dt_s, 0.0, response);
    return response;
  }
  if (p->renews) {  // a trial is a step, of a copy
    Patch copy;
    p->model->copy(*p, copy, impl.scratch.memory.get());
    impl.trial.of = nullptr;
    step_patch(copy, motion, dt_s, response);
    return response;
  }
  // Another load moves bristles in and out of contact: tried on a copy.
  Impl::Trial& trial = impl.trial;
  if (trial.of != p || trial.normal_load != motion.normal_load) {
    p->model->copy(*p, trial.patch, impl.scratch.memory.get());
    trial.contact_loss = trial.patch.model->apply_load(trial.patch, motion.normal_load);
    trial.of = p;
    trial.normal_load = motion.normal_load;
  }
  if (!needs_copy(trial.patch, motion)) {
    find_response(trial.patch, motion, dt_s, trial.contact_loss, response);
    return response;
  }
  trial.of = nullptr;
  step_patch(trial.patch, motion, dt_s, response);
  if (has(p->outputs, Outputs::energy)) response.contact_loss += trial.contact_loss;
  return response;
}

double PatchBatch::strengthening_damping(PatchId id, double normal_load_n,
                                         double speed_m_per_s) const noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  const Patch* p = impl_->pool.find(id);
  return p != nullptr && normal_load_n > 0.0
             ? normal_load_n * p->material().material.strengthening_damping(speed_m_per_s)
             : 0.0;
}

bool PatchBatch::ages(PatchId id) const noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  const Patch* p = impl_->pool.find(id);
  return p != nullptr && p->ages;
}

Status PatchBatch::set_detail(PatchId id, std::uint32_t bristles) noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  Patch* p = impl_->pool.find(id);
  if (p == nullptr) return Status::unknown_id;
  FloatModeScope mode;
  impl_->trial.of = nullptr;
  return p->model->set_detail(*p, bristles);
}

PatchInfo PatchBatch::info(PatchId id) const noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  const FloatModeScope mode;  // the caller may have unmasked what a division raises
  PatchInfo info;
  const Patch* p = impl_->pool.find(id);
  if (p == nullptr) return info;
  info.key = p->record->options.key;
  info.normal_load = p->normal_load;
  info.memory_bytes = p->record->bytes + sizeof(Patch);
  p->model->describe(*p, info);
  return info;
}

double PatchBatch::stored_energy(PatchId id) const noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  FloatModeScope mode;
  const Patch* p = impl_->pool.find(id);
  return p != nullptr ? p->model->stored_energy(*p) : 0.0;
}

std::uint64_t PatchBatch::state_hash(PatchId id) const noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  const Patch* p = impl_->pool.find(id);
  return p != nullptr ? hash_of(*p) : 0;
}

std::uint64_t PatchBatch::state_hash() const noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  Hasher hasher;
  for_each_patch(impl_->pool, [&](std::uint32_t, const Patch& p) { hasher.add(hash_of(p)); });
  return hasher.value();
}

std::size_t PatchBatch::read_bristles(PatchId id, Span<double> zx, Span<double> zy,
                                      Span<double> delta) const noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  const Patch* p = impl_->pool.find(id);
  if (p == nullptr) return 0;
  std::size_t largest = 0;
  for (const Span<double>& column : {zx, zy, delta}) largest = std::max(largest, column.size());
  std::size_t count = p->record->endless ? largest : p->record->options.bristles;
  for (const Span<double>& column : {zx, zy, delta})
    if (!column.empty()) count = std::min(count, column.size());
  p->model->read_bristles(*p, count, zx, zy, delta);
  return count;
}

std::size_t PatchBatch::state_size() const noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  return impl_->state_size();
}

std::size_t PatchBatch::save_state(Span<std::byte> to) const noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  const std::size_t size = impl_->state_size();
  if (to.size() < size) return 0;
  std::size_t at = saved_batch_size;
  for_each_patch(impl_->pool, [&](std::uint32_t slot, const Patch& p) {
    save_patch(p, slot, to.data() + at);
    at += saved_size_of(p);
  });
  seal_batch({size, impl_->patches}, {to.data(), size});
  return size;
}

void PatchBatch::restore_state(Span<const std::byte> from) {
  Impl& impl = *impl_;
  const SteppingCall call(impl.stepping_side);
  impl.apply_commands();
  const FloatModeScope mode;  // first snap lengths may be computed anew
  const SavedBatch head = open_batch(from);
  if (head.patches != impl.patches)
    throw Error("restore_state: saved patches = " + std::to_string(head.patches) + "; this batch has " +
                std::to_string(impl.patches));
  // Every patch is looked through before one is changed.
  std::size_t at = saved_batch_size;
  for_each_patch(impl.pool, [&](std::uint32_t slot, const Patch& p) {
    const std::size_t left = static_cast<std::size_t>(head.bytes) - at;
    const auto fail = [slot](const std::string& why) {
      throw Error("restore_state: patch " + std::to_string(slot + 1) + why);
    };
    if (left < saved_patch_size) fail(" is cut short");
    const SavedPatch saved = read_saved_patch(from.data() + at);
    if (saved.slot != slot || saved.generation != p.generation || saved.signature != signature_of(p) ||
        saved.bytes != saved_size_of(p))
      fail(" has another material or other options than when it was saved");
    if (left < saved.bytes) fail(" is cut short");
    if (const char* fault = find_fault_of(p, from.data() + at))
      fail(std::string(" is in a state that no patch can be in (") + fault + ")");
    at += saved.bytes;
  });
  if (at != head.bytes) throw Error("restore_state: the saved state holds more than its patches");
  impl.trial.of = nullptr;
  at = saved_batch_size;
  for_each_patch(impl.pool, [&](std::uint32_t slot, Patch& p) {
    restore_patch(p, from.data() + at);
    impl.pool.note(slot).last = Response{};
    at += saved_size_of(p);
  });
}

std::size_t PatchBatch::patch_count() const noexcept {
  const SteppingCall call(impl_->stepping_side);
  impl_->apply_commands();
  return impl_->patches;
}

int PatchBatch::threads() const noexcept { return impl_->workers.count(); }
int PatchBatch::unbound_workers() const noexcept { return impl_->workers.unbound(); }
const char* PatchBatch::isa() const noexcept { return impl_->kernels.name; }

Span<const IsaInfo> instruction_sets() noexcept {
  static const std::vector<IsaInfo> list = [] {
    int count = 0;
    const KernelEntry* entries = kernel_entries(&count);
    std::vector<IsaInfo> all;
    for (int i = 0; i < count; ++i) all.push_back({entries[i].table->name, entries[i].usable()});
    return all;
  }();
  return list;
}

}  // namespace bristle
