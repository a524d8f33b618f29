#include "core/patches/lanes/slide_block.hpp"

#include <algorithm>
#include <cmath>

#include "bristle/config.hpp"
#include "core/common/hashing.hpp"
#include "core/common/range_check.hpp"
#include "core/materials/strata.hpp"
#include "core/patches/travel.hpp"

namespace bristle::detail {
namespace {

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
void clear(LaneBlock& block, std::uint32_t lane) noexcept {
  const auto& b = static_cast<SlideBlock<T>&>(block);
  for (std::uint32_t i = 0; i < b.law.springs; ++i) {
    b.columns.x[i].lane[lane] = T(0);
    if (b.columns.y != nullptr) b.columns.y[i].lane[lane] = T(0);
    if (b.columns.since != nullptr) b.columns.since[i].lane[lane] = 0.0;
  }
}

/// Makes a block for contacts that are of the same kind as the record's.
template <class T>
LanePool::Block make_block(const LaneRecord& r) {
  const std::shared_ptr<SlideBlock<T>> block = allocate_block<SlideBlock<T>>(r);
  const CompiledMaterial& m = *r.material;
  const std::uint32_t n = r.springs();
  fill_block(*block, r);
  SlideLaw<T>& law = block->law;
  fill_law(law, m, r.lay);
  const std::shared_ptr<const Strata> strata = m.strata(n);
  const double mean = m.material.snap_length.mean() * m.lengths_per_metre;
  for (std::uint32_t i = 0; i < n; ++i) {
    block->limit[i] = static_cast<T>(strata->length[i] * mean);
    block->per_limit[i] = T(1) / std::max(block->limit[i], T(1e-15));
    block->weight[i] = static_cast<T>(strata->share[i]);
    law.whole += static_cast<double>(block->weight[i]);
  }
  law.limit = block->limit;
  law.per_limit = block->per_limit;
  law.weight = block->weight;
  law.springs = n;
  law.lean = r.lay.lean;
  law.least_loss = r.lay.least_loss();
  law.kinetic = 1.0 - m.material.drop;

  const bool all = r.options.outputs != Outputs::end;
  block->kernel = lane_kernels_of<T>(*r.kernels->lanes)
                      .slide[r.options.axes - 1][block->ages ? 2
                                                 : all       ? 1
                                                             : 0];
  // Cost of a contact as a number of bristles (Sharing): a bristle takes 0.3 ns, a contact some 12 ns, and
  // each of its springs 1 ns.
  block->work = lane_count * (40 + 3 * n);
  block->columns.state = &block->state;
  block->columns_at = block->columns.x;
  block->run = &run_kernel<SlideBlock<T>>;
  block->clear = &clear<T>;
  return block;
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
  lane_of(to).options.seed = lane_of(from).options.seed;
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
  const LaneRecord& r = lane_of(p);
  info.representatives = r.springs();
  info.weight = r.full_weight;
  info.max_normal_load = p.material().material.load_on_bristles(r.full_weight * r.springs());
  info.active = p.zeta > 0.0 ? r.springs() : 0.0;
  const std::size_t bytes = sizeof(T) * (p.axes + 2u) + (p.ages ? sizeof(double) : 0);
  info.bytes_per_representative = static_cast<std::uint32_t>(bytes);
  info.memory_bytes += r.springs() * bytes;
  info.kernel = kernel_name(p, BristleKind::slide, p.ages ? 1u : 0u, sizeof(T) == sizeof(double));
}

template <class T>
void read_bristles(const Patch& p, std::size_t count, Span<double> zx, Span<double> zy,
                   Span<double> delta) noexcept {
  const Lane<T> lane(p);
  const SlideLaw<T>& law = lane.block.law;
  const double k = lane.stiffness(), of_load = p.normal_load * law.stiffness_per_newton;
  const bool in = k > 0.0;
  const double per_newton = in ? law.metres_per_length / k : 0.0;
  for (std::size_t j = 0; j < count; ++j) {
    const auto i = static_cast<std::uint32_t>(j);
    if (!zx.empty()) zx[j] = in ? lane.force(i, 0) * per_newton : 0.0;
    if (!zy.empty()) zy[j] = in ? lane.force(i, 1) * per_newton : 0.0;
    if (!delta.empty()) delta[j] = lane.limit(i) * law.metres_per_length * (in ? of_load / k : 1.0);
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

template <class T>
void save(const Patch& p, ByteWriter& write) noexcept {
  save_rest(p, write);
  Lane<T>(p).fields([&write](const auto& number) { write(number); });
}

template <class T>
const char* find_fault(const Patch& p, const Patch& contact, ByteReader read) noexcept {
  const Lane<T> lane(p);
  const LaneRecord& r = lane_of(p);
  const double growth = lane.has_times() ? r.material->material.ageing_factor(longest_time) : 1.0;
  const double of_load = contact.normal_load * lane.block.law.stiffness_per_newton;
  const double largest = of_load * r.material->longest * growth * (1.0 + 1e-3) * (1.0 + std::abs(r.lay.lean));
  if (const char* fault = find_rest_fault(p, contact, largest * r.lay.strongest, read)) return fault;
  double stiffness = 0.0, phase = 0.0;
  read(stiffness);
  read(phase);
  const double most = highest_load * lane.block.law.stiffness_per_newton;
  if (!(stiffness >= of_load * (1.0 - 1e-9) && stiffness <= most * (1.0 + 1e-9)) && stiffness != 0.0)
    return "stiffness";
  if (contact.zeta == 0.0 && stiffness != 0.0) return "stiffness";
  if (!within(phase, 0.0, 1.0)) return "phase";
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
  restore_rest(p, seed, read);
  Lane<T>(p).fields([&read](auto& number) { read(number); });
  p.stiffness = lane_of(p).block->stiffness(lane_of(p).lane);
}

template <class T>
constexpr ContactModel slide_model = {
    .name = sizeof(T) == sizeof(double) ? "sliders, double" : "sliders, single",
    .take_lane = [](Patch& p, LanePool& pool) { assign_lane(p, pool, &make_block<T>); },
    .reset = &reset_lane,
    .take_over = &take_over<T>,
    .stored_energy = &stored_energy<T>,
    .hash = &hash<T>,
    .describe = &describe<T>,
    .read_bristles = &read_bristles<T>,
    .signature = &signature_of_lane,
    .save = &save<T>,
    .find_fault = &find_fault<T>,
    .restore = &restore<T>};

template <class T>
Patch make_typed(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight) {
  LaneRecord made;
  made.options = options;
  made.options.bristles = options.bristles == 0 ? default_sliders : std::min(options.bristles, most_sliders);
  return make_lane_patch(std::move(material), made, kernels, weight, slide_model<T>);
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
