// Implements the calls of the adding thread over a batch (add, remove, set_material) as commands, and how the
// stepping thread applies them.
#include <algorithm>
#include <string>

#include "bristle/error.hpp"
#include "core/patches/saved_state.hpp"
#include "core/runtime/batch_access.hpp"
#include "core/runtime/batch_impl.hpp"
#include "core/runtime/float_mode.hpp"
#include "core/runtime/patch_outputs.hpp"

namespace bristle {

using namespace detail;

PatchBatch::Impl::Record& PatchBatch::Impl::record_of(PatchId id) {
  const std::uint32_t slot = slot_of(id);
  if (slot >= records.size() || !records[slot].alive || slots.generation(slot) != generation_of(id))
    throw Error("PatchBatch: there is no patch with id " + std::to_string(id.value));
  if (records[slot].group != 0)
    throw Error("PatchBatch: patch " + std::to_string(id.value) +
                " belongs to a group, whose contacts are removed and changed together");
  return records[slot];
}

const PatchBatch::Impl::Record& PatchBatch::Impl::record_of(const PatchGroup& group) {
  const std::uint32_t slot = slot_of(group.first);
  const auto is_its = [&](std::uint32_t at) {
    return at < records.size() && records[at].alive && records[at].group != 0 &&
           records[at].group == records[slot].group && slots.generation(at) == generation_of(group.first);
  };
  const bool is_whole = group.count > 0 && is_its(slot) && is_its(slot + group.count - 1) &&
                        !is_its(slot + group.count) && (slot == 0 || !is_its(slot - 1));
  if (!is_whole)
    throw Error("PatchBatch: there is no group of " + std::to_string(group.count) + " patches from id " +
                std::to_string(group.first.value) + " on");
  return records[slot];
}

std::shared_ptr<const CompiledMaterial> PatchBatch::Impl::compiled(const Material& material) {
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

void PatchBatch::Impl::apply(Command& c) noexcept {
  trial.of = nullptr;
  if (c.scratch.memory) std::swap(scratch, c.scratch);
  switch (c.kind) {
    case Command::Kind::add:
      c.patch.record->clock = &clock;
      c.patch.record->epoch = clock;
      pool.patch(c.slot) = c.patch;
      pool.outlook(c.slot) = {-1.0, c.patch.in_lane ? Outlook::in_lane : c.patch.record->largest_work, 0};
      if (c.patch.in_lane) {
        enter_lane(pool.patch(c.slot));
        pool.lane(c.slot) = {lane_of(c.patch).block, c.patch.generation, lane_of(c.patch).lane};
        ++scheduler.patches_in_lanes;
      }
      c.patch.record = nullptr;
      ++patches;
      break;
    case Command::Kind::replace: {
      FloatModeScope mode;
      Patch& p = pool.patch(c.slot);
      c.patch.record->clock = &clock;
      // The time of a patch begins with its first material that ages.
      c.patch.record->epoch = p.ages ? p.record->epoch : clock;
      c.patch.record->options.key = p.record->options.key;
      c.patch.pending_snaps = p.pending_snaps;
      c.patch.pending_dissipated = p.pending_dissipated;
      c.patch.pending_loss = p.pending_loss;
      if (c.patch.in_lane) {
        settle(p);
        enter_lane(c.patch);
      }
      p.model->take_over(c.patch, p);
      copy_stuck_time(c.patch, p);
      keep_slot_fields(c.patch, p);
      std::swap(p, c.patch);
      if (p.in_lane) {
        lane_of(p).block->patch[lane_of(p).lane] = &p;
        pool.lane(c.slot) = {lane_of(p).block, p.generation, lane_of(p).lane};
      }
      break;
    }
    case Command::Kind::remove: {
      Patch& p = pool.patch(c.slot);
      c.removed = std::exchange(p.record, nullptr);
      if (p.in_lane) {
        --scheduler.patches_in_lanes;
        pool.lane(c.slot) = {};
      }
      p.generation = 0;
      --patches;
      break;
    }
    case Command::Kind::grow:
      pool.put(static_cast<int>(c.slot), std::move(c.chunk));
      break;
    case Command::Kind::change:
      c.change->apply();
      break;
    case Command::Kind::none:
      break;
  }
}

void PatchBatch::Impl::prepare(Command& command, std::size_t& has_scratch) {
  if (command.patch.in_lane) command.patch.model->take_lane(command.patch, *lanes);
  std::size_t bytes = command.patch.record->bytes;
#if BRISTLE_ASSERTS
  bytes = std::max(bytes, saved_size_of(command.patch));  // is_sound() saves the patch into this memory
#endif
  if (bytes > has_scratch) {
    has_scratch = bytes;
    command.scratch.memory.reset(
        static_cast<std::byte*>(::operator new (bytes, std::align_val_t{column_alignment})));
    command.scratch.bytes = bytes;
  }
}

void PatchBatch::Impl::send(std::unique_ptr<Command> command) noexcept {
  if (command->scratch.memory) scratch_bytes = command->scratch.bytes;
  commands.push(std::move(command), !publishes_later);
}

PatchId PatchBatch::Impl::add(const Patch& made) {
  const auto give_back = [](PatchRecord* record) { release(record); };
  std::unique_ptr<PatchRecord, decltype(give_back)> owner(made.record, give_back);
  auto command = std::make_unique<Command>();
  command->patch = made;
  owner.release();  // the command owns the patch's record from here on
  std::size_t has_scratch = scratch_bytes;
  prepare(*command, has_scratch);
  return add_to(slots.take(), std::move(command));
}

PatchId PatchBatch::Impl::add_to(const SlotList::Slot& slot, std::unique_ptr<Command> command) {
  const Patch& made = command->patch;
  command->kind = Command::Kind::add;
  command->patch.skips = skips;
  records.resize(slots.size());
  while (slot.number >= PatchPool::first_of(chunks - 1) + PatchPool::slots_of(chunks - 1)) grow_pool();
  records[slot.number] = {made.record->options, made.record->full_weight, true, made.record->group,
                          made.model};
  command->slot = slot.number;
  command->patch.generation = slot.generation;
  send(std::move(command));
  return make_id(slot.number, slot.generation);
}

void PatchBatch::Impl::grow_pool() {
  auto grow = std::make_unique<Command>();
  grow->kind = Command::Kind::grow;
  grow->slot = static_cast<std::uint32_t>(chunks);
  grow->chunk = std::make_unique<PatchChunk>(PatchPool::slots_of(chunks));
  ++chunks;
  send(std::move(grow));
}

Patch PatchBatch::Impl::make_replacement(std::shared_ptr<const CompiledMaterial> material,
                                         const Record& record) const {
  const Patch made = make_patch(std::move(material), record.options, kernels, record.full_weight);
  if (made.model == record.model) return made;
  release(made.record);
  throw Error(
      "PatchBatch::set_material: the patch and the new material are not of one kind: bristles that slide "
      "(SnapRule::slide) and bristles that snap have other states; remove the patch and add another");
}

PatchId PatchBatch::add(const Material& material, const PatchOptions& options) {
  const SteppingCall call(impl_->adding_side);
  const FloatModeScope mode;  // keeps the caller's rounding mode from changing the bits of the patch
  return impl_->add(make_patch(impl_->compiled(material), options, impl_->kernels));
}

template <class Make>
PatchBatch::Impl::Commands PatchBatch::Impl::make_group(Command::Kind kind, std::size_t contacts,
                                                        const Make& make) {
  Commands made(contacts);
  std::size_t has_scratch = scratch_bytes;
  ++last_group;
  for (std::size_t i = 0; i < contacts; ++i) {
    made[i] = std::make_unique<Command>();
    made[i]->kind = kind;
    made[i]->patch = make(i);
    made[i]->patch.record->group = last_group;
    prepare(*made[i], has_scratch);
  }
  return made;
}

namespace {

/// A change that enlarges the scheduler's working memory for the motions of a group, sent before a larger
/// group is added.
struct MakeRoom : Change {
  MakeRoom(GroupRoom& old, std::size_t count) : room(old), made(count) {}
  void apply() noexcept override { std::swap(room, made); }
  GroupRoom& room;
  GroupRoom made;
};

/// Largest number of contacts of a group for which there is memory to step them as single patches. A small
/// number suffices, because blocks step all but a few contacts of a group.
constexpr std::size_t few_motions = 256;

}  // namespace

PatchGroup PatchBatch::add_group(const Material& material, const PatchOptions& options,
                                 std::size_t contacts) {
  const SteppingCall call(impl_->adding_side);
  const FloatModeScope mode;
  if (contacts == 0 || contacts > max_group_size)
    throw Error("PatchBatch::add_group: contacts = " + std::to_string(contacts) + "; must be 1 to " +
                std::to_string(max_group_size));
  const std::shared_ptr<const CompiledMaterial> compiled = impl_->compiled(material);
  Impl::Commands commands = impl_->make_group(Command::Kind::add, contacts, [&](std::size_t i) {
    PatchOptions its = options;
    its.seed += static_cast<std::uint32_t>(i);
    its.key += i;
    return make_patch(compiled, its, impl_->kernels);
  });
  const auto count = static_cast<std::uint32_t>(contacts);
  const Patch& made = commands.front()->patch;
  const std::size_t room = made.in_lane && !made.ages ? std::min(contacts, few_motions) : contacts;
  auto make_room = std::make_unique<Command>();
  make_room->kind = Command::Kind::change;
  if (room > impl_->group_room)
    make_room->change = std::make_unique<MakeRoom>(impl_->scheduler.group_room, room);
  const SlotList::Slot first = impl_->slots.take_run(count);
  const BatchAccess::Changes at_once(*this);
  if (make_room->change != nullptr) {
    impl_->send(std::move(make_room));
    impl_->group_room = room;
  }
  for (std::uint32_t i = 0; i < count; ++i)
    impl_->add_to({first.number + i, first.generation}, std::move(commands[i]));
  return {make_id(first.number, first.generation), count};
}

PatchId BatchAccess::add(PatchBatch& batch, const Patch& made) {
  const SteppingCall call(batch.impl_->adding_side);
  return batch.impl_->add(made);
}

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

void PatchBatch::remove(const PatchGroup& group) {
  Impl& impl = *impl_;
  const SteppingCall call(impl.adding_side);
  impl.record_of(group);
  Impl::Commands commands(group.count);
  const std::uint32_t first = slot_of(group.first);
  for (std::unique_ptr<Command>& command : commands) command = std::make_unique<Command>();
  const BatchAccess::Changes at_once(*this);
  for (std::uint32_t i = 0; i < group.count; ++i) {
    commands[i]->kind = Command::Kind::remove;
    commands[i]->slot = first + i;
    impl.send(std::move(commands[i]));
    impl.records[first + i] = {};
  }
  impl.slots.give_back_run(first, group.count);
}

void PatchBatch::set_material(PatchId id, const Material& material) {
  Impl& impl = *impl_;
  const SteppingCall call(impl.adding_side);
  const Impl::Record& record = impl.record_of(id);
  FloatModeScope mode;
  auto command = std::make_unique<Command>();
  command->kind = Command::Kind::replace;
  command->slot = slot_of(id);
  command->patch = impl.make_replacement(impl.compiled(material), record);
  std::size_t has_scratch = impl.scratch_bytes;
  impl.prepare(*command, has_scratch);
  impl.send(std::move(command));
}

void PatchBatch::set_material(const PatchGroup& group, const Material& material) {
  Impl& impl = *impl_;
  const SteppingCall call(impl.adding_side);
  impl.record_of(group);
  const FloatModeScope mode;
  const std::shared_ptr<const CompiledMaterial> compiled = impl.compiled(material);
  const std::uint32_t first = slot_of(group.first);
  Impl::Commands commands = impl.make_group(Command::Kind::replace, group.count, [&](std::size_t i) {
    return impl.make_replacement(compiled, impl.records[first + i]);
  });
  const BatchAccess::Changes at_once(*this);
  for (std::uint32_t i = 0; i < group.count; ++i) {
    commands[i]->slot = first + i;
    impl.records[first + i].group = impl.last_group;
    impl.send(std::move(commands[i]));
  }
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

Outputs find_outputs(const PatchBatch& batch, PatchId id) noexcept {
  const BatchAccess::Impl::Call impl(BatchAccess::inside(batch));
  const Patch* p = impl->pool.find(id);
  return p != nullptr ? p->outputs : Outputs::end;
}

}  // namespace bristle
