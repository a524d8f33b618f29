#include "bristle/patch_batch.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "bristle/error.hpp"
#include "core/common/assert.hpp"
#include "core/common/hashing.hpp"
#include "core/common/saved_head.hpp"
#include "core/patches/representatives/representatives.hpp"
#include "core/patches/saved_state.hpp"
#include "core/runtime/batch_impl.hpp"
#include "core/runtime/chosen_kernels.hpp"
#include "core/runtime/float_mode.hpp"

namespace bristle {

using namespace detail;

namespace {

/// Returns whether a time step is allowed. Denormal ones are not: whether they read as 0 depends on the
/// caller's floating-point mode.
bool is_good_time(double dt_s) noexcept {
  return dt_s >= std::numeric_limits<double>::min() && dt_s <= std::numeric_limits<double>::max();
}

}  // namespace

PatchBatch::Impl::Impl(const BatchOptions& options)
    : kernels(choose_kernels(options.isa)), scheduler(check_threads(options)) {
  name_kernels();
  pool.put(0, std::make_unique<PatchChunk>(PatchPool::first_slots));
}
PatchBatch::Impl::~Impl() {
  for (std::uint32_t slot = 0; slot < pool.capacity(); ++slot) release(pool.patch(slot).record);
}

StepReport PatchBatch::Impl::step(double dt_s, const StepItems& items) noexcept {
  StepReport report;
  if (!is_good_time(dt_s) || items.motions.size() != items.responses.size()) {
    const Span<const Motion> motions = items.motions;
    const Span<Response> responses = items.responses;
    report.status = Status::bad_input;
    for (std::size_t i = 0; i < responses.size(); ++i) {
      if (i < motions.size()) responses[i].id = motions[i].id;
      const Patch* p = i < motions.size() ? pool.find(motions[i].id) : nullptr;
      write_refusal(p != nullptr ? p->outputs : Outputs::all, Status::bad_input, responses[i]);
    }
    for (const GroupStep& group : items.groups)
      std::fill(group.status.begin(), group.status.end(), report.status);
    return report;
  }
  trial.of = nullptr;
  report = scheduler.step(dt_s, items);
  if (!stands_still(clock)) {
    const double units = std::min(dt_s, longest_time) * clock_units_per_second;
    // Adds a short step without the conversion from double to 128 bits, which is slow.
    clock += units < 9e18 ? Int128{static_cast<std::int64_t>(units)} : static_cast<Int128>(units);
  }
  BRISTLE_ASSERT(is_sound());
  return report;
}

bool PatchBatch::Impl::reset(PatchId id, std::uint32_t seed, std::uint64_t key) noexcept {
  Patch* p = find(id);
  if (p == nullptr) return false;
  const FloatModeScope mode;
  trial.of = nullptr;
  const Patch before = *p;
  p->record->epoch = clock;
  p->model->reset(*p, seed, key);
  p->record->stuck = {};
  p->record->remainder[0] = p->record->remainder[1] = 0.0;
  keep_slot_fields(*p, before);
  return true;
}

std::size_t PatchBatch::Impl::state_size() const noexcept {
  std::size_t size = saved_head_size;
  for_each_patch([&](std::uint32_t, const Patch& p) { size += saved_size_of(p); });
  return size;
}

bool PatchBatch::Impl::is_sound() noexcept {
  if (scheduler.step_number() > 16 && scheduler.step_number() % 64 != 0) return true;
  const FloatModeScope mode;  // rounds denormal numbers to zero, as in the steps that made the state
  bool sound = true;
  trial.of = nullptr;
  for_each_patch([&](std::uint32_t, const Patch& p) {
    sound = sound && find_present_fault(p, scratch.memory.get()) == nullptr;
  });
  return sound;
}

PatchBatch::PatchBatch(const BatchOptions& options, const BuildSignature& headers) {
  check_build(headers);
  impl_ = std::make_unique<Impl>(options);
}
PatchBatch::~PatchBatch() = default;
PatchBatch::PatchBatch(PatchBatch&&) noexcept = default;
PatchBatch& PatchBatch::operator=(PatchBatch&&) noexcept = default;

void PatchBatch::warm_up() {
  const Impl::Call impl(*impl_);
  impl->scheduler.work.workers.warm_up();
}

StepReport PatchBatch::step(double dt_s, Span<const Motion> in, Span<Response> out,
                            Span<const GroupStep> groups) noexcept {
  const Impl::Call impl(*impl_);
  return impl->step(dt_s, {groups, in, out});
}

bool PatchBatch::reset(PatchId id) noexcept {
  const Impl::Call impl(*impl_);
  const Patch* p = impl->find(id);
  return p != nullptr && impl->reset(id, p->record->options.seed, p->record->options.key);
}

bool PatchBatch::reset(PatchId id, std::uint32_t seed, std::uint64_t key) noexcept {
  const Impl::Call impl(*impl_);
  return impl->reset(id, seed, key);
}

Response PatchBatch::find_force(double dt_s, const Motion& motion) noexcept {
  const Impl::Call impl(*impl_);
  const FloatModeScope mode;
  return impl->find_force(dt_s, motion);
}

StepReport PatchBatch::find_force(double dt_s, const GroupStep& group) noexcept {
  const Impl::Call impl(*impl_);
  StepReport report;
  report.status = is_good_time(dt_s) ? impl->scheduler.find_fault(group) : Status::bad_input;
  if (report.status != Status::ok) {
    std::fill(group.status.begin(), group.status.end(), report.status);
    return report;
  }
  report.tasks = report.threads = 1;
  const FloatModeScope mode;
  if (impl->scheduler.try_group(dt_s, group, report)) return report;
  const Outputs computed = impl->pool.find(group.group.first)->outputs;
  for_each_named(group, [&](std::size_t contact) {
    const Response response = impl->find_force(dt_s, motion_of(group, contact));
    write_response(group, contact, computed, response);
    report.status = report.status | response.status;
    if (was_stepped(response.status)) ++report.patches_stepped;
  });
  return report;
}

Response PatchBatch::Impl::find_force(double dt_s, const Motion& motion) noexcept {
  Response response;
  response.id = motion.id;
  Patch* p = find(motion.id);
  if (p == nullptr) {
    write_refusal(Outputs::all, why_missing(motion.id.value), response);
    return response;
  }
  if (!is_good_time(dt_s) || !is_good_motion(p->axes, motion)) {
    write_refusal(p->outputs, Status::bad_input, response);
    return response;
  }
  if (p->in_lane && find_bound(*p, motion) == Bound::rest) {
    answer_at_rest(*p, response);
    return response;
  }
  if (p->in_lane) {
    Patch copy = *p;
    step_lane(copy, motion, dt_s, false, response);
    return response;
  }
  if (motion.normal_load == p->normal_load && !needs_copy(*p, motion)) {
    try_step(*p, motion, dt_s, 0.0, response);
    return response;
  }
  // Runs the trial on a copy: applying a load moves bristles in and out of contact, and some trials change a
  // patch. The copy serves all trials under that load up to the first that changes it.
  if (trial.of != p || trial.normal_load != motion.normal_load) {
    p->model->copy(*p, trial.patch, scratch.memory.get());
    trial.contact_loss = motion.normal_load != p->normal_load
                             ? trial.patch.model->apply_load(trial.patch, motion.normal_load)
                             : 0.0;
    trial.of = p;
    trial.normal_load = motion.normal_load;
  }
  if (!needs_copy(trial.patch, motion)) {
    try_step(trial.patch, motion, dt_s, trial.contact_loss, response);
    return response;
  }
  trial.of = nullptr;
  step_patch(trial.patch, motion, dt_s, response);
  if (has(p->outputs, Outputs::energy)) response.contact_loss += trial.contact_loss;
  return response;
}

double PatchBatch::strengthening_damping(PatchId id, double normal_load_n,
                                         double speed_m_per_s) const noexcept {
  const Impl::Call impl(*impl_);
  const Patch* p = impl->find(id);
  return p != nullptr && normal_load_n > 0.0
             ? normal_load_n * p->material().material.strengthening_damping(speed_m_per_s)
             : 0.0;
}

bool PatchBatch::ages(PatchId id) const noexcept {
  const Impl::Call impl(*impl_);
  const Patch* p = impl->find(id);
  return p != nullptr && (p->ages || p->laid);
}

PatchInfo PatchBatch::info(PatchId id) const noexcept {
  const Impl::Call impl(*impl_);
  // Masks floating-point exceptions that the caller may have unmasked, since a division here may raise them.
  const FloatModeScope mode;
  PatchInfo info;
  const Patch* p = impl->find(id);
  if (p == nullptr) return info;
  info.key = p->record->options.key;
  info.normal_load = p->normal_load;
  info.memory_bytes = p->record->bytes + sizeof(Patch);
  p->model->describe(*p, info);
  return info;
}

double PatchBatch::stored_energy(PatchId id) const noexcept {
  const Impl::Call impl(*impl_);
  FloatModeScope mode;
  const Patch* p = impl->find(id);
  return p != nullptr ? p->model->stored_energy(*p) : 0.0;
}

std::uint64_t PatchBatch::state_hash(PatchId id) const noexcept {
  const Impl::Call impl(*impl_);
  const Patch* p = impl->find(id);
  return p != nullptr ? hash_of(*p) : 0;
}

std::uint64_t PatchBatch::state_hash() const noexcept {
  const Impl::Call impl(*impl_);
  Hasher hasher;
  impl->for_each_patch([&](std::uint32_t, const Patch& p) { hasher.add(hash_of(p)); });
  return hasher.value();
}

std::size_t PatchBatch::read_bristles(PatchId id, Span<double> zx, Span<double> zy,
                                      Span<double> delta) const noexcept {
  const Impl::Call impl(*impl_);
  const Patch* p = impl->find(id);
  if (p == nullptr) return 0;
  std::size_t largest = 0;
  for (const Span<double>& column : {zx, zy, delta}) largest = std::max(largest, column.size());
  std::size_t count = p->record->endless ? largest : p->record->options.bristles;
  for (const Span<double>& column : {zx, zy, delta})
    if (!column.empty()) count = std::min(count, column.size());
  if (p->laid && zx.empty() != zy.empty()) return 0;
  p->model->read_bristles(*p, count, zx, zy, delta);
  for (std::size_t i = 0; p->laid && !zx.empty() && i < count; ++i)
    p->record->lay.to_real_length(zx[i], zy[i]);
  return count;
}

std::size_t PatchBatch::state_size() const noexcept {
  const Impl::Call impl(*impl_);
  return impl->state_size();
}

std::size_t PatchBatch::save_state(Span<std::byte> to) const noexcept {
  const Impl::Call impl(*impl_);
  const std::size_t size = impl->state_size();
  if (to.size() < size) return 0;
  std::size_t at = saved_head_size;
  impl->for_each_patch([&](std::uint32_t slot, const Patch& p) {
    save_patch(p, slot, to.data() + at);
    at += saved_size_of(p);
  });
  seal(SavedKind::patches, impl->patches, {to.data(), size});
  return size;
}

void PatchBatch::restore_state(Span<const std::byte> from) {
  const Impl::Call impl(*impl_);
  const FloatModeScope mode;  // sets the kernels' mode, because first snap lengths may be recomputed
  constexpr const char* where = "PatchBatch";
  const std::uint64_t count = open_sealed(where, SavedKind::patches, from);
  if (count != impl->patches)
    refuse_saved(
        where, "has " + std::to_string(count) + " patches; this batch has " + std::to_string(impl->patches));
  // Checks the whole saved state before it changes any patch, so that a bad state leaves the batch as it is.
  std::size_t at = saved_head_size;
  impl->for_each_patch([&](std::uint32_t slot, const Patch& p) {
    const std::size_t left = from.size() - at;
    const auto fail = [slot](const std::string& why) {
      refuse_saved(where, "of patch " + std::to_string(slot + 1) + why);
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
  if (at != from.size()) refuse_saved(where, "has more than its patches");
  impl->trial.of = nullptr;
  at = saved_head_size;
  impl->for_each_patch([&](std::uint32_t, Patch& p) {
    restore_patch(p, from.data() + at);
    at += saved_size_of(p);
  });
}

std::size_t PatchBatch::patch_count() const noexcept {
  const Impl::Call impl(*impl_);
  return impl->patches;
}

int PatchBatch::threads() const noexcept { return impl_->scheduler.work.workers.count(); }
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
