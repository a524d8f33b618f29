#include "core/patches/lanes/slide_block.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "bristle/config.hpp"
#include "core/common/hashing.hpp"
#include "core/common/range_check.hpp"
#include "core/materials/strata.hpp"
#include "core/patches/travel.hpp"

namespace bristle::detail {
namespace {

/// Record of a sliding contact, with the data from which a block for it is made.
struct SlideRecord : LaneRecord {
  const KernelTable* kernels = nullptr;

  std::uint32_t springs() const noexcept { return options.bristles; }
  bool has_times() const noexcept {
    return material->material.ageing_strength != 0.0 || material->material.drop != 0.0;
  }
};
SlideRecord& record_of(const Patch& p) noexcept { return static_cast<SlideRecord&>(*p.record); }

/// Access to one contact's numbers, which lie spread over the columns of its block.
template <class T>
struct Lane {
  explicit Lane(const Patch& p) noexcept
      : block(static_cast<SlideBlock<T>&>(*lane_of(p).block)), state(block.state), lane(lane_of(p).lane) {}

  SlideBlock<T>& block;
  LaneState& state;
  std::uint32_t lane;

  std::uint32_t springs() const noexcept { return block.law.springs; }
  int axes() const noexcept { return block.columns.y != nullptr ? 2 : 1; }
  T& stored(std::uint32_t i, int axis) const noexcept {
    return (axis == 0 ? block.columns.x : block.columns.y)[i].lane[lane];
  }
  double& since(std::uint32_t i) const noexcept { return block.columns.since[i].lane[lane]; }
  bool has_times() const noexcept { return block.columns.since != nullptr; }
  double weight(std::uint32_t i) const noexcept { return static_cast<double>(block.law.weight[i]); }
  double limit(std::uint32_t i) const noexcept { return static_cast<double>(block.law.limit[i]); }
  double& stiffness() const noexcept { return state.stiffness.lane[lane]; }
  double& base(int axis) const noexcept { return state.base[axis].lane[lane]; }
  double& phase() const noexcept { return state.phase.lane[lane]; }
  /// Returns the force of spring i over its weight, N, in isotropic axes.
  double force(std::uint32_t i, int axis) const noexcept {
    return axis < axes() ? static_cast<double>(stored(i, axis)) + base(axis) : 0.0;
  }
  /// Calls visit(number) for each number of a contact's saved state. Saving, restoring and hashing share this
  /// list.
  template <class Visit>
  void fields(Visit&& visit) const noexcept {
    visit(stiffness());
    visit(phase());
    for (int axis = 0; axis < axes(); ++axis) {
      visit(base(axis));
      for (std::uint32_t i = 0; i < springs(); ++i) visit(stored(i, axis));
    }
    for (std::uint32_t i = 0; has_times() && i < springs(); ++i) visit(since(i));
  }
};

template <class T>
void run(const LaneBlock& block, const LaneInput& in, const LaneOutput& out) noexcept {
  const auto& b = static_cast<const SlideBlock<T>&>(block);
  b.kernel(b.law, b.columns, in, out);
}

template <class T>
void clear(LaneBlock& block, std::uint32_t lane) noexcept {
  const auto& b = static_cast<SlideBlock<T>&>(block);
  block.motions.named &= ~(1u << lane);
  for (LaneColumn<double>& base : block.state.base) base.lane[lane] = 0.0;
  block.state.stiffness.lane[lane] = block.state.phase.lane[lane] = 0.0;
  for (std::uint32_t i = 0; i < b.law.springs; ++i) {
    b.columns.x[i].lane[lane] = T(0);
    if (b.columns.y != nullptr) b.columns.y[i].lane[lane] = T(0);
    if (b.columns.since != nullptr) b.columns.since[i].lane[lane] = 0.0;
  }
}

/// Makes a block for contacts that are of the same kind as the record's.
template <class T>
LanePlaces::Block make_block(const LaneRecord& like) {
  const auto& r = static_cast<const SlideRecord&>(like);
  const CompiledMaterial& m = *r.material;
  const std::uint32_t n = r.springs();
  const std::size_t column = sizeof(LaneColumn<T>), head = aligned(sizeof(SlideBlock<T>));
  const bool plane = r.options.axes == 2, times = r.has_times();
  const std::size_t bytes = head + n * ((plane ? 2 : 1) * column + (times ? sizeof(LaneColumn<double>) : 0)) +
                            3 * aligned(n * sizeof(T));
  auto* memory = static_cast<std::byte*>(::operator new (bytes, std::align_val_t{column_alignment}));
  std::memset(memory, 0, bytes);
  auto* block = new (memory) SlideBlock<T>;
  LanePlaces::Block owner(block, [](LaneBlock* freed) {
    static_cast<SlideBlock<T>*>(freed)->~SlideBlock<T>();
    ::operator delete (static_cast<void*>(freed), std::align_val_t{column_alignment});
  });
  std::byte* at = memory + head;
  const auto take = [&at](auto*& pointer, std::size_t size) {
    pointer = reinterpret_cast<std::remove_reference_t<decltype(pointer)>>(at);
    at += aligned(size);
  };
  SlideColumns<T>& c = block->columns;
  c.state = &block->state;
  take(c.x, n * column);
  if (plane) take(c.y, n * column);
  if (times) take(c.since, n * sizeof(LaneColumn<double>));
  T *limit = nullptr, *per_limit = nullptr, *weight = nullptr;
  take(limit, n * sizeof(T));
  take(per_limit, n * sizeof(T));
  take(weight, n * sizeof(T));

  SlideLaw<T>& law = block->law;
  const std::shared_ptr<const Strata> strata = m.strata(n);
  const double mean = m.material.snap_length.mean() * m.lengths_per_metre;
  for (std::uint32_t i = 0; i < n; ++i) {
    limit[i] = static_cast<T>(strata->length[i] * mean);
    per_limit[i] = T(1) / std::max(limit[i], T(1e-15));
    weight[i] = static_cast<T>(strata->share[i]);
    law.whole += static_cast<double>(weight[i]);
  }
  law.limit = limit;
  law.per_limit = per_limit;
  law.weight = weight;
  law.springs = n;
  law.metres_per_length = m.metres_per_length;
  law.stiffness_per_newton =
      m.material.bristles_in_contact(1.0) * m.material.bristle_stiffness * m.metres_per_length;
  const LayMap& lay = r.lay;
  const Turn& turn = lay.along;
  law.to[0][0] = m.lengths_per_metre * turn.cosine;
  law.to[0][1] = m.lengths_per_metre * turn.sine;
  law.to[1][0] = m.lengths_per_metre * lay.stretch * -turn.sine;
  law.to[1][1] = m.lengths_per_metre * lay.stretch * turn.cosine;
  law.from[0][0] = turn.cosine;
  law.from[0][1] = -turn.sine * lay.limit;
  law.from[1][0] = turn.sine;
  law.from[1][1] = turn.cosine * lay.limit;
  law.energy = lay.energy;
  law.lean = lay.lean;
  law.least_loss = lay.least_loss();
  law.kinetic = 1.0 - m.material.drop;
  law.ageing_rate = 1.0 / m.material.ageing_time;
  law.ageing_strength = m.material.ageing_strength;
  law.ageing_form = m.material.ageing_form == AgeingForm::saturating ? 1 : 0;

  const bool all = r.options.outputs != Outputs::end;
  block->kernel = lane_kernels_of<T>(*r.kernels->lanes).slide[r.options.axes - 1][times ? 2 : all ? 1 : 0];
  // Cost of a contact as a number of bristles (Sharing): a bristle takes 0.3 ns, a contact some 12 ns, and
  // each of its springs 1 ns.
  block->work = lane_count * (40 + 3 * n);
  block->columns_at = c.x;
  block->kernels = r.kernels->lanes;
  block->run = &run<T>;
  block->clear = &clear<T>;
  block->material = head_of(*const_cast<LaneRecord*>(&like)).material;
  block->lengths_per_metre = 1.0 / law.metres_per_length;
  block->stiffest = lay.stiffest;
  block->strongest = lay.strongest;
  block->springs = n;
  block->axes = r.options.axes;
  block->outputs = r.options.outputs;
  block->ages = times;
  block->damps = damps(m.material);
  return owner;
}

/// Takes a lane for the patch in a block of like contacts: material, number of springs, axes, outputs and lay
/// are equal. Contacts of a group share blocks only with each other.
template <class T>
void take_lane(Patch& p, LanePlaces& places) {
  SlideRecord& r = record_of(p);
  Hasher kind;
  kind.add(p.material().hash);
  kind.add(std::uint64_t{sizeof(T)} << 48 | std::uint64_t{r.springs()} << 16 |
           static_cast<std::uint64_t>(r.options.axes) << 8 | static_cast<std::uint64_t>(r.options.outputs));
  r.lay.add_to(kind);
  kind.add(std::uint64_t{r.group});
  places.take(r, kind.value(), &make_block<T>);
}

Patch shared_part(SlideRecord& r, const ContactModel& model) noexcept {
  Patch p = make_shared_part(r, model);
  p.in_lane = true;
  p.newtons_per_unit = 1.0;
  note_contact(p);
  return p;
}

template <class T>
void reset(Patch& p, std::uint32_t seed, std::uint64_t key) noexcept {
  SlideRecord& r = record_of(p);
  r.options.seed = seed;
  r.options.key = key;
  p = shared_part(r, *p.model);
  r.block->clear(*r.block, r.lane);
}

template <class T>
double stored_energy(const Patch& p) noexcept {
  const Lane<T> lane(p);
  if (!(lane.stiffness() > 0.0)) return 0.0;
  double sum = 0.0;
  for (std::uint32_t i = 0; i < lane.springs(); ++i) {
    const double x = lane.force(i, 0), y = lane.force(i, 1);
    sum += lane.weight(i) * (x * x + lane.block.law.energy * y * y);
  }
  return 0.5 * sum / lane.stiffness() * lane.block.law.metres_per_length;
}

/// Moves the state of a contact to another material. Deflections stay, and bristles bent beyond their new
/// limits slip.
template <class T>
void take_over(Patch& to, Patch& from) noexcept {
  const Lane<T> now(to), before(from);
  SlideRecord& r = record_of(to);
  r.options.seed = record_of(from).options.seed;
  set_load(to, from.normal_load);
  if (!(before.stiffness() > 0.0) || !(to.normal_load > 0.0)) return;
  const double of_load = before.block.law.stiffness_per_newton * from.normal_load;
  // Keeps the ratio of the contact's stiffness to the stiffness for its load, which is above 1 after a fall
  // of the load.
  now.stiffness() =
      now.block.law.stiffness_per_newton * to.normal_load * std::max(before.stiffness() / of_load, 1.0);
  const double scale = before.block.law.metres_per_length * now.stiffness() /
                       (before.stiffness() * now.block.law.metres_per_length);
  for (std::uint32_t i = 0; i < now.springs(); ++i) {
    for (int axis = 0; axis < now.axes(); ++axis)
      now.stored(i, axis) = static_cast<T>(before.force(i, axis) * scale);
    if (now.has_times()) now.since(i) = before.has_times() ? before.since(i) : 0.0;
  }
  now.phase() = before.phase();
  // Counts the change of stored energy as lost. Strata of another law weigh equal deflections differently.
  const bool energy = has(to.outputs, Outputs::energy);
  const double stored = energy ? stored_energy<T>(to) : 0.0;
  if (energy) to.pending_loss += stored_energy<T>(from) - stored;
  LaneMotions rest;
  rest.load.lane[now.lane] = to.normal_load;
  rest.start.lane[now.lane] = time_of(to);
  rest.named = 1u << now.lane;
  LaneAnswers answers;
  now.block.run(now.block, rest.input(true), answers.columns());
  if (energy) to.pending_dissipated += std::max(stored - stored_energy<T>(to), 0.0);
}

template <class T>
void describe(const Patch& p, PatchInfo& info) noexcept {
  const SlideRecord& r = record_of(p);
  info.representatives = r.springs();
  info.weight = r.full_weight;
  info.max_normal_load = p.material().material.load_on_bristles(r.full_weight * r.springs());
  info.active = p.zeta > 0.0 ? r.springs() : 0.0;
  const std::size_t bytes = sizeof(T) * (p.axes + 2u) + (r.has_times() ? sizeof(double) : 0);
  info.bytes_per_representative = static_cast<std::uint32_t>(bytes);
  info.memory_bytes += r.springs() * bytes;
  info.kernel = kernel_name(p, BristleKind::slide, r.has_times() ? 1u : 0u, sizeof(T) == sizeof(double));
}

template <class T>
void read_bristles(const Patch& p, std::size_t count, Span<double> zx, Span<double> zy,
                   Span<double> delta) noexcept {
  const Lane<T> lane(p);
  const SlideLaw<T>& law = lane.block.law;
  const double k = lane.stiffness(), of_load = p.normal_load * law.stiffness_per_newton;
  for (std::size_t j = 0; j < count; ++j) {
    const auto i = static_cast<std::uint32_t>(j);
    const bool in = i < lane.springs() && k > 0.0;
    const double per_newton = in ? law.metres_per_length / k : 0.0;
    if (!zx.empty()) zx[j] = in ? lane.force(i, 0) * per_newton : 0.0;
    if (!zy.empty()) zy[j] = in ? lane.force(i, 1) * per_newton : 0.0;
    if (!delta.empty())
      delta[j] = i < lane.springs() ? lane.limit(i) * law.metres_per_length * (in ? of_load / k : 1.0) : 0.0;
  }
}

template <class T>
std::uint64_t hash(const Patch& p) noexcept {
  const Lane<T> lane(p);
  Hasher hasher;
  hasher.add(p.material().hash);
  hasher.add(p.zeta);
  if (!(p.zeta > 0.0)) return hasher.value();
  hasher.add(lane.stiffness());
  hasher.add(lane.phase());
  for (int axis = 0; axis < lane.axes(); ++axis) {
    hasher.add(lane.base(axis));
    for (std::uint32_t i = 0; i < lane.springs(); ++i) hasher.add(lane.stored(i, axis));
  }
  for (std::uint32_t i = 0; lane.has_times() && i < lane.springs(); ++i)
    hasher.add(time_of(p) - lane.since(i));
  return hasher.value();
}

std::uint64_t signature(const Patch& p) noexcept {
  const SlideRecord& r = record_of(p);
  Hasher hasher;
  hasher.add(p.material().hash);
  hasher.add(r.full_weight);
  hasher.add(r.options.max_normal_load);
  hasher.add(std::uint64_t{r.springs()});
  hasher.add(static_cast<std::uint64_t>(p.axes) << 8 | static_cast<std::uint64_t>(p.outputs));
  return hasher.value();
}

template <class T>
void save(const Patch& p, ByteWriter& write) noexcept {
  // Saves the force at the end of the last step as well, because the stored forces of the springs give it
  // only to rounding.
  for (const double force : p.elastic) write(force);
  write(p.rests ? 1.0 : 0.0);
  // Saves a patch that has not taken a lane yet as a contact without load.
  if (lane_of(p).block != nullptr) return Lane<T>(p).fields([&write](const auto& number) { write(number); });
  const SlideRecord& r = record_of(p);
  for (int k = 0; k < 2 + r.options.axes; ++k) write(0.0);
  for (std::uint32_t k = 0; k < r.springs() * static_cast<std::uint32_t>(r.options.axes); ++k) write(T(0));
  for (std::uint32_t k = 0; r.has_times() && k < r.springs(); ++k) write(0.0);
}

template <class T>
const char* find_fault(const Patch& p, const Patch& contact, ByteReader read) noexcept {
  const Lane<T> lane(p);
  const SlideRecord& r = record_of(p);
  const Material& m = p.material().material;
  double stiffness = 0.0, phase = 0.0, elastic[2], rests = 0.0;
  for (double& force : elastic) read(force);
  read(rests);
  read(stiffness);
  read(phase);
  const double of_load = contact.normal_load * lane.block.law.stiffness_per_newton;
  const double most = highest_load * lane.block.law.stiffness_per_newton;
  if (!(stiffness >= of_load * (1.0 - 1e-9) && stiffness <= most * (1.0 + 1e-9)) && stiffness != 0.0)
    return "stiffness";
  if (contact.zeta == 0.0 && stiffness != 0.0) return "stiffness";
  if (!within(phase, 0.0, 1.0)) return "phase";
  const double excess = contact.zeta / (r.full_weight * r.springs());
  if (contact.overload != (is_overloaded(excess) ? excess : 1.0)) return "overload";
  const double growth = lane.has_times() ? m.ageing_factor(longest_time) : 1.0;
  const double largest =
      of_load * p.material().longest * growth * (1.0 + 1e-3) * (1.0 + std::abs(r.lay.lean));
  for (const double force : elastic)
    if (!within(force, -largest * r.lay.strongest, largest * r.lay.strongest)) return "the force";
  if (rests != 0.0 && rests != 1.0) return "rest";
  for (int axis = 0; axis < lane.axes(); ++axis) {
    double base = 0.0;
    read(base);
    if (!within(base, -largest, largest)) return "the sum";
    for (std::uint32_t i = 0; i < lane.springs(); ++i) {
      T force;
      read(force);
      if (!within(static_cast<double>(force) + base, -largest, largest)) return "a deflection";
    }
  }
  for (std::uint32_t i = 0; lane.has_times() && i < lane.springs(); ++i) {
    double since = 0.0;
    read(since);
    if (!within(since, -1.0, 1e18)) return "a time";
  }
  return nullptr;
}

template <class T>
void restore(Patch& p, std::uint32_t seed, ByteReader read) noexcept {
  record_of(p).options.seed = seed;
  note_contact(p);
  for (double& force : p.elastic) read(force);
  double rests = 0.0;
  read(rests);
  p.rests = rests != 0.0;
  Lane<T>(p).fields([&read](auto& number) { read(number); });
  p.stiffness = lane_of(p).block->stiffness(lane_of(p).lane);
}

template <class T>
constexpr ContactModel slide_model = {
    .name = sizeof(T) == sizeof(double) ? "sliders, double" : "sliders, single",
    .apply_load = nullptr,
    .advance = nullptr,
    .take_lane = &take_lane<T>,
    .reset = &reset<T>,
    .take_over = &take_over<T>,
    .copy = nullptr,
    .stored_energy = &stored_energy<T>,
    .hash = &hash<T>,
    .describe = &describe<T>,
    .read_bristles = &read_bristles<T>,
    .signature = &signature,
    .save = &save<T>,
    .find_fault = &find_fault<T>,
    .restore = &restore<T>};

template <class T>
Patch make_typed(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight) {
  SlideRecord made;
  made.material = material.get();
  made.options = options;
  made.options.bristles = options.bristles == 0 ? default_sliders : std::min(options.bristles, most_sliders);
  made.first_seed = options.seed;
  made.largest_work = made.springs();
  made.full_weight = weight > 0.0
                         ? weight
                         : material->material.bristles_in_contact(options.max_normal_load) / made.springs();
  made.kernels = &kernels;
  return shared_part(*make_record(std::move(material), made), slide_model<T>);
}

}  // namespace

Patch make_sliders(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                   const KernelTable& kernels, double weight) {
  if (options.population == Population::infinite)
    throw Error(
        "PatchOptions: population = infinite: the material has SnapRule::slide, whose bristles are strata of "
        "its law already: take Population::representatives (32 are within 0.05 % of infinitely many)");
#if BRISTLE_WITH_DOUBLE
  if (options.precision == Precision::double_)
    return make_typed<double>(std::move(material), options, kernels, weight);
#endif
  return make_typed<float>(std::move(material), options, kernels, weight);
}

}  // namespace bristle::detail
