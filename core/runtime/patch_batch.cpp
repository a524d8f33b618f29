#include "bristle/patch_batch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "bristle/deadline_monitor.hpp"
#include "bristle/error.hpp"
#include "core/runtime/command_list.hpp"
#include "core/runtime/float_mode.hpp"
#include "core/common/hashing.hpp"
#include "core/patches/patch_detail.hpp"
#include "core/patches/patch_state.hpp"
#include "core/common/range_check.hpp"
#include "core/runtime/sharing.hpp"
#include "core/patches/state_io.hpp"
#include "core/runtime/workers.hpp"

namespace bristle {

using namespace detail;

namespace {

constexpr Totals no_totals{};
constexpr int max_tasks = 512;
constexpr int max_split = 64;

thread_local char this_thread;  // its address tells threads apart

constexpr std::uint32_t slot_of(PatchId id) noexcept { return static_cast<std::uint32_t>(id.value) - 1; }
constexpr std::uint32_t generation_of(PatchId id) noexcept {
  return static_cast<std::uint32_t>(id.value >> 32);
}
constexpr PatchId make_id(std::uint32_t slot, std::uint32_t generation) noexcept {
  return {std::uint64_t{generation} << 32 | (std::uint64_t{slot} + 1)};
}

/// A denormal time is no time: it would read as 0 or not by the caller's floating-point mode.
bool is_good_time(double dt_s) noexcept {
  return dt_s >= std::numeric_limits<double>::min() && dt_s <= std::numeric_limits<double>::max();
}

const KernelTable& choose_kernels(const char* wanted) {
  int count = 0;
  const KernelEntry* entries = kernel_entries(&count);
  if (wanted == nullptr || *wanted == 0) wanted = std::getenv("BRISTLE_ISA");
  const bool any = wanted == nullptr || *wanted == 0;
  std::string known;
  for (int i = 0; i < count; ++i) {
    if (any ? entries[i].usable() : std::strcmp(wanted, entries[i].table->name) == 0) {
      if (entries[i].usable()) return *entries[i].table;
      throw Error(std::string("BatchOptions: isa = ") + wanted + "; this machine does not run it");
    }
    known += (i ? ", " : "") + std::string(entries[i].table->name);
  }
  throw Error(std::string("BatchOptions: isa = ") + (wanted ? wanted : "") + "; this build has " + known);
}

/// Names of the variants: axes, rule, mean, energy, precision, step rule. Made by the first batch, so that
/// asking for one allocates nothing.
const std::array<std::string, 64>& kernel_names() {
  static const std::array<std::string, 64> names = [] {
    std::array<std::string, 64> all;
    for (unsigned i = 0; i < 64; ++i) {
      std::string& name = all[i];
      name = i & 1 ? "2 axes" : "1 axis";
      name += i & 2 ? ", redraw" : ", keep";
      if (i & 32) name += ", literal";
      name += i & 4 ? ", end + mean" : ", end";
      if (i & 8) name += ", energy";
      name += i & 16 ? ", double" : ", single";
    }
    return all;
  }();
  return names;
}

const char* kernel_name(const PatchState& p) noexcept {
  const unsigned index = (p.options.axes == 2 ? 1u : 0u) | (p.draw != nullptr ? 2u : 0u) |
                         (has(p.options.outputs, Outputs::mean) ? 4u : 0u) |
                         (has(p.options.outputs, Outputs::energy) ? 8u : 0u) | (p.is_double() ? 16u : 0u) |
                         (p.options.step_rule == StepRule::literal ? 32u : 0u);
  return kernel_names()[index].c_str();
}

}  // namespace

struct PatchBatch::Impl {
  explicit Impl(const BatchOptions& options)
      : kernels(choose_kernels(options.isa)),
        workers(check_threads(options.threads), check_core(options.servo_core)),
        skips(!options.eager),
        table(new SlotTable(64)) {
    kernel_names();
  }

  static int check_threads(int threads) {
    if (threads < 0 || threads > 1024) refuse("BatchOptions", "threads", threads, "0 (one per core) to 1024");
    return threads;
  }
  static int check_core(int core) {
    if (core < -1 || core > 1023) refuse("BatchOptions", "servo_core", core, "0 to 1023, or -1 for none");
    return core;
  }

  const KernelTable& kernels;
  Workers workers;
  const Sharing sharing = chosen_sharing();
  double last_sizable_step = -1.0;  ///< when the last step ended that may be worth sharing, s
  const bool skips;
  CommandList commands;

  // --- the adding thread's side
  struct Record {
    PatchOptions options;
    double weight = 0.0;
    std::uint32_t generation = 0;
    bool alive = false;
  };
  std::vector<Record> records;
  std::vector<std::uint32_t> free_slots;
  std::vector<std::shared_ptr<const CompiledMaterial>> materials;  ///< recently used first
  std::uint32_t table_capacity = 64;
  std::size_t scratch_bytes = 0;

  // --- the stepping thread's side
  std::unique_ptr<SlotTable> table;
  std::unique_ptr<PatchState> scratch;  ///< for trial loads; storage as large as the largest patch's
  std::uint64_t step_number = 0;
  std::size_t patches = 0;
  std::uint32_t queue_length = 0;

  /// A piece of a step: a range of blocks of one large patch, or a range of motions.
  struct Task {
    int split = -1;
    std::uint32_t first = 0, last = 0;
    Totals totals;
    std::uint64_t visited = 0;
    const void* thread = nullptr;  ///< who did it
    std::uint32_t stepped = 0;
    Status status = Status::ok;
  };
  struct Split {
    PatchState* patch = nullptr;
    std::size_t motion = 0;
    PatchStep step;
    int first_task = 0, task_count = 0;
  };
  std::array<Task, max_tasks> tasks;
  std::array<Split, max_split> splits;
  double dt = 0.0;
  Span<const Motion> in;
  Span<Response> out;

  Record& record_of(PatchId id) {
    const std::uint32_t slot = slot_of(id);
    if (!id || slot >= records.size() || !records[slot].alive ||
        records[slot].generation != generation_of(id))
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

  /// Takes what the adding thread handed over. Neither allocates nor frees.
  void apply_commands() noexcept {
    while (Command* c = commands.take()) {
      switch (c->kind) {
        case Command::Kind::add: {
          SlotTable::Slot& slot = table->slots[c->slot];
          slot.generation = c->generation;
          slot.patch.swap(c->patch);
          if (c->scratch) scratch.swap(c->scratch);
          ++patches;
          break;
        }
        case Command::Kind::replace: {
          FloatModeScope mode;
          SlotTable::Slot& slot = table->slots[c->slot];
          take_over(*c->patch, *slot.patch);
          slot.patch.swap(c->patch);
          if (c->scratch) scratch.swap(c->scratch);
          break;
        }
        case Command::Kind::remove:
          table->slots[c->slot].patch.swap(c->patch);
          --patches;
          break;
        case Command::Kind::grow:
          for (std::uint32_t i = 0; i < table->capacity; ++i) {
            c->table->slots[i] = std::move(table->slots[i]);
            c->table->last[i] = table->last[i];
          }
          for (std::uint32_t i = 0; i < queue_length; ++i) c->table->motions[i] = table->motions[i];
          table.swap(c->table);
          break;
        case Command::Kind::none:
          break;
      }
    }
  }

  PatchState* find(PatchId id) const noexcept {
    const std::uint32_t slot = slot_of(id);
    if (!id || slot >= table->capacity) return nullptr;
    const SlotTable::Slot& s = table->slots[slot];
    return s.patch && s.generation == generation_of(id) ? s.patch.get() : nullptr;
  }

  void attach_scratch(Command& command) {
    const std::size_t bytes = command.patch->storage_bytes;
    if (bytes <= scratch_bytes) return;
    command.scratch = std::make_unique<PatchState>();
    command.scratch->storage.reset(static_cast<std::byte*>(::operator new[](bytes, std::align_val_t{64})));
    command.scratch->storage_bytes = bytes;
  }

  /// Nothing can fail any more: only now is what comes with the command counted as there.
  void send(std::unique_ptr<Command> command) noexcept {
    if (command->scratch) scratch_bytes = command->scratch->storage_bytes;
    commands.push(std::move(command));
  }

  /// One motion, start to end, on one thread.
  void step_one(std::size_t i, Task& task) noexcept {
    PatchState& p = *find(in[i].id);
    PatchStep step = begin_step(p, in[i], dt, true);
    step.ran = step.moves && !holds_still(p, step);
    if (step.ran) {
      Totals totals{};
      run_blocks(p, step, 0, p.active_blocks(), totals);
      finish_step(p, step, totals, out[i]);
      task.visited += totals.visited;
    } else {
      finish_step(p, step, no_totals, out[i]);
    }
    task.status = task.status | out[i].status;
    ++task.stepped;
  }

  /// Refuses what cannot be stepped. Null when refused.
  PatchState* admit(std::size_t i) noexcept {
    out[i].id = in[i].id;
    PatchState* p = find(in[i].id);
    if (p == nullptr) {
      write_refusal(nullptr, Status::unknown_id, out[i]);
      return nullptr;
    }
    if (p->last_step == step_number) {
      write_refusal(&p->options, Status::repeated_id, out[i]);
      return nullptr;
    }
    p->last_step = step_number;
    if (!is_good_motion(*p, in[i])) {
      write_refusal(&p->options, Status::bad_input, out[i]);
      return nullptr;
    }
    out[i].status = Status::ok;
    return p;
  }

  static constexpr Status refusals = Status::unknown_id | Status::repeated_id | Status::bad_input;

  static void run_task(void* self, int index) {
    Impl& impl = *static_cast<Impl*>(self);
    Task& task = impl.tasks[static_cast<std::size_t>(index)];
    task.thread = &this_thread;
    FloatModeScope mode;
    if (task.split >= 0) {
      const Split& split = impl.splits[static_cast<std::size_t>(task.split)];
      run_blocks(*split.patch, split.step, task.first, task.last, task.totals);
      return;
    }
    for (std::uint32_t i = task.first; i < task.last; ++i) {
      if (has(impl.out[i].status, refusals)) continue;
      if (impl.find(impl.in[i].id)->split_step == impl.step_number) continue;
      impl.step_one(i, task);
    }
  }

  Task& new_task(int& count, int split, std::uint32_t first, std::uint32_t last) noexcept {
    Task& task = tasks[static_cast<std::size_t>(count++)];
    task = Task{};
    task.split = split;
    task.first = first;
    task.last = last;
    return task;
  }

  StepReport step_all() noexcept {
    StepReport report;
    ++step_number;
    const auto n = in.size();
    const bool serial = workers.count() == 1;
    FloatModeScope mode;

    // Who can be stepped, and what it will cost.
    std::uint64_t cost = 0;
    Task alone{};
    for (std::size_t i = 0; i < n; ++i) {
      PatchState* p = admit(i);
      if (p == nullptr) {
        report.status = report.status | out[i].status;
        continue;
      }
      if (serial)
        step_one(i, alone);
      else
        cost += cost_of(*p, in[i]);
    }
    const bool sizable = !serial && cost >= sharing.parallel_from;
    const bool shared = sizable && (cost >= sharing.parallel_from_paused ||
                                    DeadlineMonitor::wall_now() - last_sizable_step < sharing.awake);
    if (!serial && !shared)
      for (std::size_t i = 0; i < n; ++i)
        if (!has(out[i].status, refusals)) step_one(i, alone);
    if (shared) split_and_run(cost, report);
    if (sizable) last_sizable_step = DeadlineMonitor::wall_now();
    if (!shared) {
      report.status = report.status | alone.status;
      report.patches_stepped = alone.stepped;
      report.bristles_visited = alone.visited;
      report.tasks = 1;
      report.threads = 1;
    }
    return report;
  }

  /// The step proper; the caller took the commands, so that the table stays as it is.
  StepReport step(double dt_s, Span<const Motion> motions, Span<Response> responses) noexcept {
    if (!is_good_time(dt_s) || motions.size() != responses.size()) {
      StepReport report;
      report.status = Status::bad_input;
      for (std::size_t i = 0; i < responses.size(); ++i) {
        if (i < motions.size()) responses[i].id = motions[i].id;
        const PatchState* p = i < motions.size() ? find(motions[i].id) : nullptr;
        write_refusal(p != nullptr ? &p->options : nullptr, Status::bad_input, responses[i]);
      }
      return report;
    }
    dt = dt_s;
    in = motions;
    out = responses;
    return step_all();
  }

  std::uint64_t cost_of(const PatchState& p, const Motion& motion) const noexcept {
    const bool moves = motion.displacement[0] != 0.0 || motion.displacement[1] != 0.0;
    const std::uint64_t contact = motion.normal_load == p.normal_load ? p.in_contact() : p.detail;
    return sharing.patch_overhead + (moves ? contact : 0);
  }

  void split_and_run(std::uint64_t cost, StepReport& report) noexcept {
    const auto n = in.size();
    const std::uint64_t piece = std::max<std::uint64_t>(
        cost / (static_cast<std::uint64_t>(workers.count()) * 4), sharing.smallest_piece);
    int task_count = 0;
    int split_count = 0;
    std::uint32_t group_first = 0;
    std::uint64_t group_cost = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (has(out[i].status, refusals)) continue;
      PatchState& p = *find(in[i].id);
      const std::uint64_t patch_cost = cost_of(p, in[i]);
      // Large patches go by ranges of blocks, as long as there is room for their tasks.
      const auto pieces = static_cast<int>(std::min<std::uint64_t>((patch_cost + piece - 1) / piece, 64));
      if (patch_cost > 2 * sharing.smallest_piece && pieces > 1 && split_count < max_split &&
          task_count + pieces < max_tasks / 2) {
        Split& split = splits[static_cast<std::size_t>(split_count)];
        p.split_step = step_number;
        split.patch = &p;
        split.motion = i;
        split.step = begin_step(p, in[i], dt, true);
        split.first_task = task_count;
        split.step.ran = split.step.moves && !holds_still(p, split.step);
        const std::uint32_t blocks = split.step.ran ? p.active_blocks() : 0;
        // Whole groups of blocks to a task: bounds are kept by group.
        const std::uint32_t groups = (blocks + blocks_per_group - 1) / blocks_per_group;
        const std::uint32_t parts = std::min<std::uint32_t>(static_cast<std::uint32_t>(pieces), groups);
        for (std::uint32_t k = 0; k < parts; ++k)
          new_task(task_count, split_count, groups * k / parts * blocks_per_group,
                   std::min(groups * (k + 1) / parts * blocks_per_group, blocks));
        split.task_count = static_cast<int>(parts);
        ++split_count;
        continue;
      }
      group_cost += patch_cost;
      const int room = max_tasks - 1 - task_count;
      if (group_cost >= piece && room > 0) {
        new_task(task_count, -1, group_first, static_cast<std::uint32_t>(i) + 1);
        group_first = static_cast<std::uint32_t>(i) + 1;
        group_cost = 0;
      }
    }
    if (group_cost > 0) new_task(task_count, -1, group_first, static_cast<std::uint32_t>(n));
    workers.run(task_count, &run_task, this);

    for (int t = 0; t < task_count; ++t) {
      const Task& task = tasks[static_cast<std::size_t>(t)];
      report.status = report.status | task.status;
      report.patches_stepped += task.stepped;
      report.bristles_visited += task.visited;
    }
    for (int s = 0; s < split_count; ++s) {
      Split& split = splits[static_cast<std::size_t>(s)];
      Totals totals{};
      for (int t = 0; t < split.task_count; ++t)
        add_totals(totals, tasks[static_cast<std::size_t>(split.first_task + t)].totals);
      Response& response = out[split.motion];
      finish_step(*split.patch, split.step, totals, response);
      report.status = report.status | response.status;
      report.bristles_visited += totals.visited;
      ++report.patches_stepped;
    }
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
  Impl& impl = *impl_;
  FloatModeScope mode;  // the caller's rounding must not reach our bits
  auto command = std::make_unique<Command>();
  command->kind = Command::Kind::add;
  command->patch = make_patch(impl.compiled(material), options, impl.kernels);
  command->patch->skips = impl.skips;
  impl.attach_scratch(*command);

  if (impl.free_slots.empty()) {
    const auto fresh = static_cast<std::uint32_t>(impl.records.size());
    if (fresh >= impl.table_capacity) {
      auto grow = std::make_unique<Command>();
      grow->kind = Command::Kind::grow;
      grow->table = std::make_unique<SlotTable>(impl.table_capacity * 2);
      impl.table_capacity *= 2;
      impl.send(std::move(grow));
    }
    impl.records.emplace_back();
    impl.free_slots.reserve(impl.records.capacity());
    impl.free_slots.push_back(fresh);
  }
  const std::uint32_t slot = impl.free_slots.back();
  impl.free_slots.pop_back();
  Impl::Record& record = impl.records[slot];
  record.options = command->patch->options;
  record.weight = command->patch->weight;
  ++record.generation;
  record.alive = true;
  command->slot = slot;
  command->generation = record.generation;
  impl.send(std::move(command));
  return make_id(slot, record.generation);
}

void PatchBatch::remove(PatchId id) {
  Impl& impl = *impl_;
  Impl::Record& record = impl.record_of(id);
  auto command = std::make_unique<Command>();
  command->kind = Command::Kind::remove;
  command->slot = slot_of(id);
  impl.send(std::move(command));
  record.alive = false;
  impl.free_slots.push_back(slot_of(id));
}

void PatchBatch::set_material(PatchId id, const Material& material) {
  Impl& impl = *impl_;
  const Impl::Record& record = impl.record_of(id);
  FloatModeScope mode;
  auto command = std::make_unique<Command>();
  command->kind = Command::Kind::replace;
  command->slot = slot_of(id);
  command->patch = make_patch(impl.compiled(material), record.options, impl.kernels, record.weight);
  impl.attach_scratch(*command);
  impl.send(std::move(command));
}

void PatchBatch::warm_up() {
  impl_->apply_commands();
  impl_->workers.warm_up();
}

StepReport PatchBatch::step(double dt_s, Span<const Motion> in, Span<Response> out) noexcept {
  impl_->apply_commands();
  return impl_->step(dt_s, in, out);
}

void PatchBatch::move(PatchId id, double dx_m, double dy_m, double normal_load_n) noexcept {
  Impl& impl = *impl_;
  impl.apply_commands();
  if (impl.find(id) == nullptr) return;
  // One entry for a slot at the most: a patch that follows a removed one takes its place in the queue.
  std::uint32_t& queued = impl.table->slots[slot_of(id)].queued;
  if (queued == 0) queued = ++impl.queue_length;
  Motion& motion = impl.table->motions[queued - 1];
  motion = Motion{};
  motion.id = id;
  motion.displacement[0] = dx_m;
  motion.displacement[1] = dy_m;
  motion.normal_load = normal_load_n;
}

StepReport PatchBatch::step(double dt_s) noexcept {
  Impl& impl = *impl_;
  impl.apply_commands();
  SlotTable& table = *impl.table;
  const std::uint32_t count = impl.queue_length;
  std::fill_n(table.responses.begin(), count, Response{});
  const StepReport report = impl.step(dt_s, Span<const Motion>(table.motions.data(), count),
                                      Span<Response>(table.responses.data(), count));
  for (std::uint32_t i = 0; i < count; ++i) {
    const PatchId id = table.motions[i].id;
    table.slots[slot_of(id)].queued = 0;
    if (impl.find(id) != nullptr) table.last[slot_of(id)] = table.responses[i];
  }
  impl.queue_length = 0;
  return report;
}

Response PatchBatch::force(PatchId id) const noexcept {
  Impl& impl = *impl_;
  impl.apply_commands();
  if (impl.find(id) != nullptr && impl.table->last[slot_of(id)].id == id)
    return impl.table->last[slot_of(id)];
  Response none;
  none.id = id;
  none.status = Status::unknown_id;
  return none;
}

bool PatchBatch::reset(PatchId id) noexcept {
  impl_->apply_commands();
  const PatchState* p = impl_->find(id);
  return p != nullptr && reset(id, p->options.seed, p->options.key);
}

bool PatchBatch::reset(PatchId id, std::uint32_t seed, std::uint64_t key) noexcept {
  impl_->apply_commands();
  PatchState* p = impl_->find(id);
  if (p == nullptr) return false;
  FloatModeScope mode;
  reset_patch(*p, seed, key);
  impl_->table->last[slot_of(id)] = Response{};
  return true;
}

Response PatchBatch::find_force(double dt_s, const Motion& motion) noexcept {
  Impl& impl = *impl_;
  impl.apply_commands();
  FloatModeScope mode;
  Response response;
  response.id = motion.id;
  PatchState* p = impl.find(motion.id);
  if (p == nullptr) {
    write_refusal(nullptr, Status::unknown_id, response);
    return response;
  }
  if (!is_good_time(dt_s) || !is_good_motion(*p, motion)) {
    write_refusal(&p->options, Status::bad_input, response);
    return response;
  }
  double loss = 0.0;
  if (motion.normal_load != p->normal_load) {
    // Another load moves bristles in and out of contact: tried on a copy.
    copy_patch(*p, *impl.scratch);
    p = impl.scratch.get();
    loss = apply_load(*p, motion.normal_load);
  }
  PatchStep step = begin_step(*p, motion, dt_s, false);
  step.contact_loss = loss;
  Totals totals{};
  if (step.moves && !holds_still(*p, step)) run_blocks(*p, step, 0, p->active_blocks(), totals);
  finish_step(*p, step, totals, response);
  return response;
}

Status PatchBatch::set_detail(PatchId id, std::uint32_t bristles) noexcept {
  impl_->apply_commands();
  PatchState* p = impl_->find(id);
  if (p == nullptr) return Status::unknown_id;
  if (bristles == 0 || bristles > p->bristles) return Status::bad_input;
  FloatModeScope mode;
  change_detail(*p, bristles);
  return Status::ok;
}

PatchInfo PatchBatch::info(PatchId id) const noexcept {
  impl_->apply_commands();
  PatchInfo info;
  const PatchState* p = impl_->find(id);
  if (p == nullptr) return info;
  info.key = p->options.key;
  info.bristles = p->bristles;
  info.detail = p->detail;
  info.weight = p->weight;
  info.max_normal_load = p->material->material.load_on_bristles(p->full_weight * p->bristles);
  info.active = p->active;
  info.normal_load = p->normal_load;
  info.memory_bytes = p->storage_bytes + sizeof(PatchState);
  const unsigned number = p->is_double() ? 8 : 4;
  const unsigned columns = static_cast<unsigned>(p->options.axes) + 1 + (p->draw != nullptr ? 1 : 0);
  info.bytes_per_bristle = columns * number + (p->draw != nullptr ? 4 : 0);
  info.kernel = kernel_name(*p);
  return info;
}

double PatchBatch::stored_energy(PatchId id) const noexcept {
  impl_->apply_commands();
  FloatModeScope mode;
  const PatchState* p = impl_->find(id);
  return p != nullptr ? find_stored_energy(*p) : 0.0;
}

std::uint64_t PatchBatch::state_hash(PatchId id) const noexcept {
  impl_->apply_commands();
  const PatchState* p = impl_->find(id);
  return p != nullptr ? hash_patch(*p) : 0;
}

std::uint64_t PatchBatch::state_hash() const noexcept {
  impl_->apply_commands();
  Hasher hasher;
  for (const SlotTable::Slot& slot : impl_->table->slots)
    if (slot.patch) hasher.add(hash_patch(*slot.patch));
  return hasher.value();
}

std::size_t PatchBatch::read_bristles(PatchId id, Span<double> zx, Span<double> zy,
                                      Span<double> delta) const noexcept {
  impl_->apply_commands();
  const PatchState* p = impl_->find(id);
  if (p == nullptr) return 0;
  std::size_t count = p->bristles;
  for (const Span<double>& column : {zx, zy, delta})
    if (!column.empty()) count = std::min(count, column.size());
  read_columns(*p, count, zx, zy, delta);
  return count;
}

std::size_t PatchBatch::state_size() const noexcept {
  impl_->apply_commands();
  std::size_t size = saved_batch_size;
  for (const SlotTable::Slot& slot : impl_->table->slots)
    if (slot.patch) size += saved_size(*slot.patch);
  return size;
}

std::size_t PatchBatch::save_state(Span<std::byte> to) const noexcept {
  const std::size_t size = state_size();
  if (to.size() < size) return 0;
  std::size_t at = saved_batch_size;
  for (std::uint32_t i = 0; i < impl_->table->capacity; ++i) {
    const SlotTable::Slot& slot = impl_->table->slots[i];
    if (!slot.patch) continue;
    save_patch(*slot.patch, i, slot.generation, to.data() + at);
    at += saved_size(*slot.patch);
  }
  seal_batch({size, impl_->patches}, {to.data(), size});
  return size;
}

void PatchBatch::restore_state(Span<const std::byte> from) {
  Impl& impl = *impl_;
  impl.apply_commands();
  const FloatModeScope mode;  // first snap lengths may be computed anew
  const SavedBatch head = open_batch(from);
  if (head.patches != impl.patches)
    throw Error("restore_state: saved patches = " + std::to_string(head.patches) + "; this batch has " +
                std::to_string(impl.patches));
  // Every patch is looked through before one is changed.
  std::size_t at = saved_batch_size;
  for (std::uint32_t i = 0; i < impl.table->capacity; ++i) {
    const SlotTable::Slot& slot = impl.table->slots[i];
    if (!slot.patch) continue;
    const std::size_t left = static_cast<std::size_t>(head.bytes) - at;
    const auto fail = [i](const std::string& why) {
      throw Error("restore_state: patch " + std::to_string(i + 1) + why);
    };
    if (left < saved_patch_size) fail(" is cut short");
    const SavedPatch saved = read_saved_patch(from.data() + at);
    if (saved.slot != i || saved.generation != slot.generation || saved.signature != signature(*slot.patch) ||
        saved.bytes != saved_size(*slot.patch))
      fail(" has another material or other options than when it was saved");
    if (left < saved.bytes) fail(" is cut short");
    if (const char* fault = find_fault(*slot.patch, from.data() + at))
      fail(std::string(" is in a state that no patch can be in (") + fault + ")");
    at += saved.bytes;
  }
  if (at != head.bytes) throw Error("restore_state: the saved state holds more than its patches");
  at = saved_batch_size;
  for (std::uint32_t i = 0; i < impl.table->capacity; ++i) {
    const SlotTable::Slot& slot = impl.table->slots[i];
    if (!slot.patch) continue;
    restore_patch(*slot.patch, from.data() + at);
    impl.table->last[i] = Response{};
    at += saved_size(*slot.patch);
  }
}

std::size_t PatchBatch::patch_count() const noexcept {
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
