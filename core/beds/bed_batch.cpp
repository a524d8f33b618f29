#include <algorithm>
#include <string>
#include <vector>

#include "bristle/error.hpp"
#include "core/beds/bed.hpp"
#include "core/common/hashing.hpp"
#include "core/common/little_endian.hpp"
#include "core/common/saved_head.hpp"
#include "core/runtime/chosen_kernels.hpp"
#include "core/runtime/float_mode.hpp"
#include "core/runtime/sharing.hpp"
#include "core/runtime/slot_list.hpp"

namespace bristle {

using namespace detail;

namespace {

constexpr std::size_t fetched_lines = 15;
constexpr std::size_t cache_line = 64;
/// Fixed cost of a bed in a step, expressed as a number of its bristles, and time of one of its bristles over
/// that of a patch's bristle (`bristle_bench`, `beds/row/slide_32` and `in_cache/`).
constexpr std::uint64_t bed_overhead = 64;
constexpr std::uint64_t bed_bristle_cost = 8;

constexpr std::size_t state_numbers = 17;

std::size_t saved_bytes(const Bed& bed) {
  return 2 * sizeof(std::uint32_t) + sizeof(std::uint64_t) + state_numbers * sizeof(double) +
         std::size_t{bed_state_columns} * bed.count * sizeof(float);
}

/// Calls `visit` with those columns of each block of 16 bristles that are saved. They stand before the
/// columns of constants, which follow from the bed.
template <class Visit>
void for_each_block(float* columns, std::uint32_t count, Visit&& visit) {
  float* const end = columns + std::size_t{count} * bed_columns;
  for (float* block = columns; block != end; block += bed_columns * lane_count)
    visit(block, std::uint32_t{bed_state_columns} * lane_count);
}

std::uint64_t hash_of(const Bed& bed) noexcept {
  Hasher hasher;
  bed_fields(bed.state, {}, [&](double x, const FieldRule&) { hasher.add(x); });
  hasher.add(std::uint64_t{bed.state.rolled_last});
  for (const BedColumn c : {bed_tip_x, bed_tip_y, bed_slid, bed_along})
    for (std::uint32_t i = 0; i < bed.bristles; ++i) hasher.add(bed.at(c, i));
  return hasher.value();
}

}  // namespace

struct BRISTLE_PRIVATE BedBatch::Impl {
  explicit Impl(const BatchOptions& options)
      : table(choose_kernels(options.isa)), work(check_threads(options)) {}

  const KernelTable& table;
  const BedKernels& kernels = *table.beds;
  SharedWork work;
  SlotTable<Bed> beds;
  SlotList slots;
  BedMemory scratch;  ///< memory for a copy of any bed's columns, as large as the largest
  std::uint32_t scratch_count = 0;
  std::size_t count = 0;
  std::uint64_t step_number = 0;
  std::vector<std::uint32_t> moved;  ///< slots of the beds with a drop that the last step moved

  Bed* find(BedId id) noexcept { return beds.find(id); }

  void run(Span<const BedMotion> in, Span<BedResponse> out, std::size_t first, std::size_t last) noexcept {
    const FloatModeScope mode;
    for (std::size_t i = first; i < last; ++i) {
      if (i + 8 < last) fetch_record(in[i + 8].id);
      if (i + 4 < last) fetch_bristles(in[i + 4].id);
      if (out[i].status == Status::ok) step_bed(*find(in[i].id), kernels, in[i], out[i]);
    }
  }

  /// Lets beds rest that moved in the last step but not in this one, because the step does not name them or
  /// refuses their motion. Records the beds that this step moves, for the next step.
  void rest_others(Span<const BedMotion> in, Span<const BedResponse> out) noexcept {
    for (const std::uint32_t slot : moved)
      if (beds.at[slot].last_step != step_number) rest(beds.at[slot]);
    moved.clear();
    for (std::size_t i = 0; i < in.size(); ++i) {
      Bed* bed = find(in[i].id);
      if (bed == nullptr || !bed->drops || out[i].status == Status::repeated_id) continue;
      if (out[i].status == Status::ok)
        moved.push_back(beds.slot(*bed));
      else
        rest(*bed);
    }
  }

  /// Prefetches the struct of a bed that is stepped soon from memory.
  void fetch_record(BedId id) const noexcept {
    const std::uint32_t slot = slot_of(id);
    if (slot >= beds.at.size()) return;
    const char* record = reinterpret_cast<const char*>(&beds.at[slot]);
    for (std::size_t at = 0; at < sizeof(Bed); at += cache_line) __builtin_prefetch(record + at);
  }
  void fetch_bristles(BedId id) noexcept {
    const Bed* bed = find(id);
    if (bed == nullptr) return;
    const char* bristles = reinterpret_cast<const char*>(bed->columns.get());
    for (std::size_t i = 0; i < fetched_lines; ++i) __builtin_prefetch(bristles + i * cache_line);
  }

  /// Clears the response to a motion and returns the bed to step; if the motion is refused, writes the reason
  /// into the response and returns null.
  Bed* take(const BedMotion& motion, BedResponse& response) noexcept {
    response = BedResponse{};
    response.id = motion.id;
    Bed* bed = find(motion.id);
    if (bed == nullptr) {
      response.status = why_missing(motion.id.value);
    } else if (bed->last_step == step_number) {
      response.status = Status::repeated_id;
    } else if (bed->last_step = step_number; !accepts(*bed, motion)) {
      response.status = Status::bad_input;
    } else {
      return bed;
    }
    return nullptr;
  }
  /// Returns the cost of a bed's step, as SharedWork counts it.
  static std::uint64_t cost_of(const Bed& bed) noexcept {
    return (bed.count + bed_overhead) * bed_bristle_cost;
  }
};

BedBatch::BedBatch(const BatchOptions& options) : impl_(std::make_unique<Impl>(options)) {}
BedBatch::~BedBatch() = default;
BedBatch::BedBatch(BedBatch&&) noexcept = default;
BedBatch& BedBatch::operator=(BedBatch&&) noexcept = default;

BedId BedBatch::add(const BedMaterial& material, const BedShape& shape, const BedOptions& options) {
  const FloatModeScope mode;
  Impl& impl = *impl_;
  Bed bed = make_bed(material, shape, options, impl.kernels);
  if (bed.count > impl.scratch_count) {
    impl.scratch = make_columns(bed.count);
    impl.scratch_count = bed.count;
  }
  const SlotList::Slot slot = impl.slots.take();
  std::vector<Bed>& beds = impl.beds.at;
  if (beds.size() < impl.slots.size()) beds.resize(impl.slots.size());
  impl.moved.reserve(beds.capacity());
  bed.generation = slot.generation;
  beds[slot.number] = std::move(bed);
  ++impl.count;
  return make_id<BedId>(slot.number, slot.generation);
}

void BedBatch::remove(BedId id) {
  Bed* bed = impl_->find(id);
  if (bed == nullptr) throw Error("BedBatch::remove: there is no such bed");
  *bed = Bed{};
  impl_->slots.give_back(impl_->beds.slot(*bed));
  --impl_->count;
}

StepReport BedBatch::step(Span<const BedMotion> in, Span<BedResponse> out) noexcept {
  Impl& impl = *impl_;
  StepReport report;
  if (in.size() != out.size()) {
    for (BedResponse& response : out) response.status = Status::bad_input;
    report.status = Status::bad_input;
    return report;
  }
  ++impl.step_number;
  std::uint64_t cost = 0;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const Bed* bed = impl.take(in[i], out[i]);
    if (bed == nullptr) continue;
    cost += Impl::cost_of(*bed);
    ++report.patches_stepped;
    report.bristles_visited += bed->count;
  }
  impl.rest_others(in, out);
  impl.work.step_items(
      in.size(), cost,
      [&](std::size_t i) {
        return out[i].status == Status::ok ? Impl::cost_of(*impl.find(in[i].id)) : std::uint64_t{0};
      },
      [&](std::size_t first, std::size_t last) { impl.run(in, out, first, last); }, report);
  for (const BedResponse& response : out) report.status = report.status | response.status;
  return report;
}

BedResponse BedBatch::find_force(const BedMotion& motion) noexcept {
  Impl& impl = *impl_;
  BedResponse response;
  ++impl.step_number;
  Bed* const taken = impl.take(motion, response);
  if (taken == nullptr) return response;
  Bed& bed = *taken;
  const FloatModeScope mode;
  const BedState state = bed.state;
  const std::size_t numbers = std::size_t{bed.count} * bed_columns;
  std::copy_n(bed.columns.get(), numbers, impl.scratch.get());
  step_bed(bed, impl.kernels, motion, response);
  std::copy_n(impl.scratch.get(), numbers, bed.columns.get());
  bed.state = state;
  return response;
}

bool BedBatch::reset(BedId id) noexcept {
  Bed* bed = impl_->find(id);
  if (bed == nullptr) return false;
  const FloatModeScope mode;
  unbend(*bed, impl_->kernels);
  return true;
}

BedInfo BedBatch::info(BedId id) const noexcept {
  BedInfo info;
  const Bed* bed = impl_->find(id);
  if (bed == nullptr) return info;
  info.bristles = bed->bristles;
  info.half[0] = bed->half[0] * bed->state.size;
  info.half[1] = bed->half[1] * (bed->growth == BedGrowth::cube_root ? bed->state.size : 1.0);
  info.normal_load = bed->state.load;
  info.stiffness = bed->stiffness * bed->gain[0];
  info.longest_deflection = bed->deflection;
  info.memory_bytes = sizeof(Bed) + std::size_t{bed->count} * bed_columns * sizeof(float);
  return info;
}

std::size_t BedBatch::read_bristles(BedId id, Span<BedBristle> out) const noexcept {
  const Bed* bed = impl_->find(id);
  if (bed == nullptr) return 0;
  const std::size_t n = std::min<std::size_t>(out.size(), bed->bristles);
  const BedState& s = bed->state;
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = [&](BedColumn c) { return static_cast<double>(bed->at(c, i)); };
    const double x = at(bed_x), y = at(bed_y);
    BedBristle& b = out[i];
    b.position[0] = x * bed->length;
    b.position[1] = y * bed->length;
    b.deflection[0] = (s.root[0] - s.root[2] * y - at(bed_tip_x)) * bed->deflection;
    b.deflection[1] = (s.root[1] + s.root[3] * x - at(bed_tip_y)) * bed->deflection;
    b.stiffness = at(bed_stiffness) * bed->stiffness;
    b.limit = at(bed_pressure) * s.limit_of_pressure * bed->deflection;
  }
  return n;
}

std::uint64_t BedBatch::state_hash(BedId id) const noexcept {
  const Bed* bed = impl_->find(id);
  return bed != nullptr ? hash_of(*bed) : 0;
}

std::uint64_t BedBatch::state_hash() const noexcept {
  Hasher hasher;
  impl_->beds.for_each([&](const Bed& bed) { hasher.add(hash_of(bed)); });
  return hasher.value();
}

std::size_t BedBatch::state_size() const noexcept {
  std::size_t bytes = saved_head_size;
  impl_->beds.for_each([&bytes](const Bed& bed) { bytes += saved_bytes(bed); });
  return bytes;
}

std::size_t BedBatch::save_state(Span<std::byte> to) const noexcept {
  const std::size_t bytes = state_size();
  if (to.size() < bytes) return 0;
  ByteWriter write(to.data() + saved_head_size);
  impl_->beds.for_each([&](const Bed& bed) {
    write(impl_->beds.slot(bed));
    write(bed.count);
    write(std::uint64_t{bed.state.rolled_last});
    bed_fields(bed.state, {}, write);
    for_each_block(bed.columns.get(), bed.count,
                   [&](const float* block, std::uint32_t n) { write.column(block, n); });
  });
  seal(SavedKind::beds, impl_->count, {to.data(), bytes});
  return bytes;
}

void BedBatch::restore_state(Span<const std::byte> from) {
  constexpr const char* where = "BedBatch";
  const std::uint64_t count = open_sealed(where, SavedKind::beds, from);
  if (count != impl_->count || from.size() != state_size()) refuse_saved(where, "is of other beds");
  // Restores in two passes over the bytes: the first checks all values, the second writes, so that bad data
  // change nothing.
  for (const bool writes : {false, true}) {
    ByteReader read(from.data() + saved_head_size);
    impl_->beds.for_each([&](Bed& bed) {
      std::uint32_t its_slot = 0, its_count = 0;
      std::uint64_t rolled_last = 0;
      BedState state;
      read(its_slot);
      read(its_count);
      if (its_slot != impl_->beds.slot(bed) || its_count != bed.count)
        refuse_saved(where, "is of other beds, or added in another order");
      read(rolled_last);
      bed_fields(state, {}, read);
      state.rolled_last = rolled_last != 0;
      float* const columns = writes ? bed.columns.get() : impl_->scratch.get();
      for_each_block(columns, bed.count, [&](float* block, std::uint32_t n) { read.column(block, n); });
      if (writes) {
        bed.state = state;
        return;
      }
      const char* fault = rolled_last > 1 ? "rolled_last" : find_bed_fault(bed, state, columns);
      if (fault != nullptr)
        refuse_saved(where, std::string("has a value that no bed can have (") + fault + ")");
    });
  }
  // Lets a restored bed rest: if it slid just before it was saved, its bristles have kinetic limits, and get
  // their static ones here.
  impl_->moved.clear();
  impl_->beds.for_each([this](const Bed& bed) {
    if (bed.drops) impl_->moved.push_back(impl_->beds.slot(bed));
  });
}

std::size_t BedBatch::bed_count() const noexcept { return impl_->count; }
int BedBatch::threads() const noexcept { return impl_->work.workers.count(); }
const char* BedBatch::isa() const noexcept { return impl_->table.name; }

}  // namespace bristle
