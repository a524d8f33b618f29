#include "core/patches/lanes/brush_block.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "bristle/config.hpp"
#include "core/common/hashing.hpp"
#include "core/common/range_check.hpp"
#include "core/materials/brush_survival.hpp"
#include "core/materials/quantile_map.hpp"
#include "core/patches/travel.hpp"

namespace bristle::detail {
namespace {

constexpr const char* where = "PatchOptions with population infinite";

/// Access to one contact's numbers, which lie spread over the columns of its block. Lengths are scaled.
template <class T>
struct Lane {
  explicit Lane(const Patch& p) noexcept
      : block(static_cast<BrushBlock<T>&>(*lane_of(p).block)),
        columns(block.columns),
        state(block.state),
        lane(lane_of(p).lane) {}

  BrushBlock<T>& block;
  const BrushColumns<T>& columns;
  LaneState& state;
  std::uint32_t lane;

  std::uint32_t cohorts() const noexcept { return block.law.cohorts; }
  int axes() const noexcept { return columns.y != nullptr ? 2 : 1; }
  bool ages() const noexcept { return columns.birth != nullptr; }
  template <class Number>
  Number& at(LaneColumn<Number>* column, std::uint32_t cohort = 0) const noexcept {
    return column[cohort].lane[lane];
  }
  LaneColumn<T>* positions(int axis) const noexcept { return axis == 0 ? columns.x : columns.y; }
  double& stiffness() const noexcept { return state.stiffness.lane[lane]; }
  double& base(int axis) const noexcept { return state.base[axis].lane[lane]; }
  bool is_ranked() const noexcept { return at(columns.ranked) != T(0); }
  /// Whether a cohort has no bristles, or fewer than a normal number can tell.
  bool is_empty(std::uint32_t i) const noexcept { return is_none(at(columns.fresh, i)); }
  static bool is_none(T fresh) noexcept { return !(std::abs(fresh) >= std::numeric_limits<T>::min()); }
  /// Returns the share of the load that a cohort has.
  double share(std::uint32_t i) const noexcept {
    return static_cast<double>(at(columns.fresh, i)) * static_cast<double>(at(columns.left, i));
  }
  /// Returns the deflection of a cohort's bristles along an isotropic axis.
  double deflection(std::uint32_t i, int axis) const noexcept {
    return axis < axes() ? base(axis) - static_cast<double>(at(positions(axis), i)) : 0.0;
  }

  // Lists the numbers of a contact's saved state. Saving, restoring and hashing share these lists.

  template <class Visit>
  void contact_fields(Visit&& visit) const noexcept {
    visit(stiffness());
    visit(state.phase.lane[lane]);
    for (int axis = 0; axis < axes(); ++axis) {
      visit(base(axis));
      visit(at(columns.moment[axis]));
      for (int open = 0; open < 2; ++open) {
        visit(at(columns.begin[open][axis]));
        visit(at(columns.residue[open][axis]));
      }
    }
    for (LaneColumn<T>* column :
         {columns.owed, columns.owed_path, columns.slack, columns.spread, columns.pair, columns.ranked})
      visit(at(column));
  }
  template <class Visit, class VisitBirth>
  void cohort_fields(std::uint32_t i, Visit&& visit, VisitBirth&& visit_birth) const noexcept {
    for (int axis = 0; axis < axes(); ++axis) visit(at(positions(axis), i));
    for (LaneColumn<T>* column : {columns.reach, columns.fresh, columns.left}) visit(at(column, i));
    if (ages()) visit_birth(at(columns.birth, i));
  }
  template <class Visit>
  void rank_fields(std::uint32_t i, Visit&& visit) const noexcept {
    for (LaneColumn<T>* column : {columns.low, columns.high}) visit(at(column, i));
  }

  /// Raises the number of cohorts that kernels visit until it covers all cohorts of this lane with bristles.
  void note_used() const noexcept {
    for (std::uint32_t i = block.used; i < cohorts(); ++i)
      if (!is_empty(i)) block.used = i + 1;
  }
};

template <class T>
void clear(LaneBlock& block, std::uint32_t lane) noexcept {
  auto& b = static_cast<BrushBlock<T>&>(block);
  LaneRecord like;
  like.options.bristles = b.springs;
  like.options.axes = b.axes;
  like.material = b.material.get();
  BrushBlock<T>::list(b, like, [lane](auto* column, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) column[i].lane[lane] = 0;
  });
}

/// Counts times from the present after 2^20 ageing times.
template <class T>
void follow_time(const Patch& p) noexcept {
  constexpr double longest = 0x1p20;
  const Lane<T> lane(p);
  LaneRecord& r = lane_of(p);
  const double now = lane_time(p);
  if (!(now > longest * r.material->material.ageing_time)) return;
  r.times_from = *r.clock - r.epoch;
  for (std::uint32_t i = 0; i < lane.cohorts(); ++i) lane.at(lane.columns.birth, i) -= now;
}

/// Makes a block for contacts that are of the same kind as the record's.
template <class T>
LanePool::Block make_block(const LaneRecord& r) {
  const std::shared_ptr<BrushBlock<T>> block = allocate_block<BrushBlock<T>>(r);
  const Material& m = r.material->material;
  fill_block(*block, r);
  BrushLaw<T>& law = block->law;
  fill_law(law, *r.material, r.lay);
  fill_brush_law(*r.material, r.options.resolution, law, block->survival);
  law.snaps_per_newton = m.bristles_in_contact(1.0);
  law.cohorts = r.springs();
  block->kernel = lane_kernels_of<T>(*r.kernels->lanes)
                      .brush[r.options.axes - 1][r.options.outputs != Outputs::end ? 1 : 0];
  // Cost of a contact as a number of bristles (Sharing): a bristle takes 0.3 ns, a contact some 12 ns, and
  // each of its cohorts 2 ns.
  block->work = lane_count * (40 + 6 * law.cohorts);
  block->columns.state = &block->state;
  block->columns.used = &block->used;
  block->columns_at = block->columns.x;
  block->run = &run_kernel<BrushBlock<T>>;
  block->clear = &clear<T>;
  block->follow_time = &follow_time<T>;
  return block;
}

template <class T>
double stored_energy(const Patch& p) noexcept {
  const Lane<T> lane(p);
  double sum = static_cast<double>(lane.at(lane.columns.spread));
  for (std::uint32_t i = 0; i < lane.cohorts(); ++i) {
    const double x = lane.deflection(i, 0), y = lane.deflection(i, 1);
    if (!lane.is_empty(i)) sum += lane.share(i) * (x * x + lane.block.law.energy * y * y);
  }
  return 0.5 * lane.stiffness() * sum * lane.block.law.metres_per_length;
}

/// Gives cohort i the snap lengths beyond `reach` of the law of its present block. Its share of the load
/// stays.
template <class T>
void set_reach(const Lane<T>& lane, std::uint32_t i, double share, T reach) noexcept {
  T& its = lane.at(lane.columns.reach, i);
  its = std::max(reach, lane.block.survival.low);
  T& left = lane.at(lane.columns.left, i);
  left = std::max(survival_at(lane.block.survival, its), static_cast<T>(least_left));
  lane.at(lane.columns.fresh, i) = static_cast<T>(share) / left;
}

/// Steps a contact by a negligible path along its deflection, so that bristles snap that are bent beyond
/// their snap length, and adds what they lose and their number to what the next step reports.
template <class T>
void slip(Patch& p) noexcept {
  constexpr double path = 1e-18;  // scaled lengths
  const Lane<T> lane(p);
  double z[2] = {0.0, 0.0};
  for (int axis = 0; axis < lane.axes(); ++axis)
    z[axis] = lane.base(axis) - static_cast<double>(lane.at(lane.columns.moment[axis]));
  const double length = std::sqrt(z[0] * z[0] + z[1] * z[1]);
  double motion[2] = {1.0, 0.0};
  if (length > 0.0)
    for (int axis = 0; axis < 2; ++axis) motion[axis] = z[axis] / length;
  if (p.laid) p.record->lay.to_real_length(motion[0], motion[1]);
  for (double& x : motion) x *= path * p.material().metres_per_length;
  LaneMotions creep;
  creep.set(lane.lane, motion, p.normal_load, 0.0);
  creep.start.lane[lane.lane] = lane_time(p);
  LaneAnswers answers;
  lane.block.run(lane.block, creep.input(true), answers.columns());
  if (!has(p.outputs, Outputs::energy)) return;
  p.pending_dissipated += answers.dissipated.lane[lane.lane];
  p.pending_snaps += static_cast<std::uint64_t>(answers.slid.lane[lane.lane]);
}

/// Moves the state of a contact to another material. Deflections stay, each bristle keeps its rank in the
/// order of snap lengths, and those bent beyond their new length snap.
template <class T>
void take_over(Patch& to, Patch& from) noexcept {
  const Lane<T> now(to), before(from);
  const Material &material = to.material().material, &old = from.material().material;
  lane_of(to).options.seed = lane_of(from).options.seed;
  lane_of(to).times_from = from.ages ? lane_of(from).times_from : 0;
  set_load(to, from.normal_load);
  now.state.phase.lane[now.lane] = before.state.phase.lane[before.lane];
  if (!(before.stiffness() > 0.0)) return;
  // Ratio of the units of length, a power of two.
  const T ratio = static_cast<T>(before.block.law.metres_per_length / now.block.law.metres_per_length);
  now.stiffness() = now.block.law.stiffness_per_newton * to.normal_load;
  for (int axis = 0; axis < now.axes(); ++axis) {
    now.base(axis) = before.base(axis) * static_cast<double>(ratio);
    now.at(now.columns.moment[axis]) = before.at(before.columns.moment[axis]) * ratio;
    for (int open = 0; open < 2; ++open) {
      now.at(now.columns.begin[open][axis]) = before.at(before.columns.begin[open][axis]) * ratio;
      now.at(now.columns.residue[open][axis]) = before.at(before.columns.residue[open][axis]) * ratio;
    }
  }
  now.at(now.columns.owed) = before.at(before.columns.owed);
  now.at(now.columns.owed_path) = before.at(before.columns.owed_path) * ratio;
  now.at(now.columns.ranked) = before.at(before.columns.ranked);
  now.at(now.columns.pair) = before.at(before.columns.pair);
  now.at(now.columns.spread) = before.at(before.columns.spread) * ratio * ratio;
  const QuantileMap of_equal_quantile(old.snap_length, material.snap_length);
  for (std::uint32_t i = 0; i < now.cohorts(); ++i) {
    if (before.is_empty(i)) continue;
    for (int axis = 0; axis < now.axes(); ++axis)
      now.at(now.positions(axis), i) = before.at(before.positions(axis), i) * ratio;
    now.at(now.columns.low, i) = before.at(before.columns.low, i);
    now.at(now.columns.high, i) = before.at(before.columns.high, i);
    if (now.ages()) now.at(now.columns.birth, i) = before.ages() ? before.at(before.columns.birth, i) : 0.0;
    T reach = before.at(before.columns.reach, i) * ratio;
    if (!(old.snap_length == material.snap_length)) {
      const double metres = static_cast<double>(reach) * now.block.law.metres_per_length;
      reach = static_cast<T>(of_equal_quantile(metres, 1.0) * to.lengths_per_metre);
    }
    set_reach(now, i, before.share(i), reach);
  }
  now.note_used();
  if (has(to.outputs, Outputs::energy)) to.pending_loss += stored_energy<T>(from) - stored_energy<T>(to);
  slip<T>(to);
}

double pieces_of(const Patch& p) noexcept { return std::ceil(p.record->options.resolution); }

template <class T>
void describe(const Patch& p, PatchInfo& info) noexcept {
  const LaneRecord& r = lane_of(p);
  const double bristles = r.full_weight * r.springs(), pieces = pieces_of(p);
  info.representatives = static_cast<std::uint32_t>(pieces);
  info.weight = 0.0;
  info.max_normal_load = p.material().material.load_on_bristles(bristles);
  info.active = std::min(p.zeta / bristles, 1.0) * pieces;
  const std::size_t bytes = r.springs() * (sizeof(T) * (p.axes + 5u) + (p.ages ? sizeof(double) : 0));
  info.bytes_per_representative = static_cast<std::uint32_t>(static_cast<double>(bytes) / pieces);
  info.memory_bytes += bytes;
  info.kernel = kernel_name(p, BristleKind::infinite, 0u, sizeof(T) == sizeof(double));
}

template <class T>
void read_bristles(const Patch& p, std::size_t count, Span<double> zx, Span<double> zy,
                   Span<double> delta) noexcept {
  const Lane<T> lane(p);
  const double metres = lane.block.law.metres_per_length, now = lane_time(p);
  const Material& m = p.material().material;
  double all = 0.0;
  for (std::uint32_t i = 0; i < lane.cohorts(); ++i) all += lane.is_empty(i) ? 0.0 : lane.share(i);
  // Distributes the bristles asked for over the cohorts in proportion to their shares.
  std::uint32_t at = 0;
  double passed = 0.0;
  for (std::size_t j = 0; j < count; ++j) {
    const double wanted = (static_cast<double>(j) + 0.5) / static_cast<double>(count) * all;
    while (at + 1 < lane.cohorts() && (lane.is_empty(at) || passed + lane.share(at) < wanted))
      passed += lane.is_empty(at) ? 0.0 : lane.share(at), ++at;
    const bool in = all > 0.0;
    if (!zx.empty()) zx[j] = in ? lane.deflection(at, 0) * metres : 0.0;
    if (!zy.empty()) zy[j] = in ? lane.deflection(at, 1) * metres : 0.0;
    if (delta.empty()) continue;
    const double growth = in && lane.ages() ? m.ageing_factor(now - lane.at(lane.columns.birth, at)) : 1.0;
    delta[j] = in ? static_cast<double>(lane.at(lane.columns.reach, at)) * growth * metres : 0.0;
  }
}

template <class T>
std::uint64_t hash(const Patch& p) noexcept {
  const Lane<T> lane(p);
  Hasher hasher;
  const auto add = [&hasher](const auto& number) { hasher.add(number); };
  hasher.add(p.material().hash);
  hasher.add(p.zeta);
  hasher.add(lane.state.phase.lane[lane.lane]);
  if (!(p.zeta > 0.0)) return hasher.value();
  hasher.add(p.record->options.resolution);
  lane.contact_fields(add);
  for (std::uint32_t i = 0; i < lane.cohorts(); ++i) {
    hasher.add(std::uint64_t{lane.is_empty(i) ? 0u : 1u});
    if (lane.is_empty(i)) continue;
    lane.cohort_fields(i, add, [&](double birth) { hasher.add(lane_time(p) - birth); });
    if (lane.is_ranked()) lane.rank_fields(i, add);
  }
  return hasher.value();
}

std::uint64_t signature(const Patch& p) noexcept {
  Hasher hasher;
  hasher.add(signature_of_lane(p));
  hasher.add(p.record->options.resolution);
  return hasher.value();
}

template <class T>
void save(const Patch& p, ByteWriter& write) noexcept {
  const Lane<T> lane(p);
  const auto as_is = [&write](const auto& number) { write(number); };
  const auto zero = [&write](const auto& number) { write(std::decay_t<decltype(number)>{}); };
  save_rest(p, write);
  lane.contact_fields(as_is);
  // Writes zeros for what no step reads: empty cohorts, and ranks before the first change of load.
  for (std::uint32_t i = 0; i < lane.cohorts(); ++i) {
    if (lane.is_empty(i))
      lane.cohort_fields(i, zero, zero);
    else
      lane.cohort_fields(i, as_is, as_is);
    if (lane.is_empty(i) || !lane.is_ranked())
      lane.rank_fields(i, zero);
    else
      lane.rank_fields(i, as_is);
  }
  if (lane.ages()) write(lane_of(p).times_from);
}

/// A cohort of a saved state.
template <class T>
struct SavedCohort {
  T position[2] = {T(0), T(0)}, reach = T(0), fresh = T(0), left = T(0), low = T(0), high = T(0);
  double birth = 0.0;

  friend bool operator==(const SavedCohort&, const SavedCohort&) = default;
};

template <class T>
const char* find_fault(const Patch& p, const Patch& contact, ByteReader read) noexcept {
  const Lane<T> lane(p);
  const LaneRecord& r = lane_of(p);
  const BrushLaw<T>& law = lane.block.law;
  const auto wide = [](T number) { return static_cast<double>(number); };
  constexpr double rounding = sizeof(T) == sizeof(float) ? 1e-3 : 1e-6;
  const double growth = lane.ages() ? r.material->material.ageing_factor(longest_time) : 1.0;
  const double longest = wide(lane.block.survival.high) * (1.0 + rounding);
  const double farthest = (longest * growth + law.residual) * (1.0 + rounding);
  const double of_load = contact.normal_load * law.stiffness_per_newton;
  if (const char* fault = find_rest_fault(p, contact, of_load * farthest * r.lay.strongest, read))
    return fault;
  double stiffness = 0.0, phase = 0.0, base[2] = {0.0, 0.0};
  T moment[2] = {T(0), T(0)};
  read(stiffness);
  read(phase);
  // A change of load that single precision cannot tell waits until it is larger.
  if (!within(stiffness, of_load * (1.0 - 2e-6), of_load * (1.0 + 2e-6)) && stiffness != 0.0)
    return "stiffness";
  if (!within(phase, 0.0, 1.0)) return "phase";
  const double near = 16.0 + 2.0 * farthest;  // the origin of positions follows the patch
  for (int axis = 0; axis < lane.axes(); ++axis) {
    read(base[axis]);
    read(moment[axis]);
    if (!within(base[axis], -near, near) || !within(wide(moment[axis]), -near, near)) return "the position";
    for (int k = 0; k < 4; ++k) {
      T number;
      read(number);
      if (!within(wide(number), -1e30, 1e30)) return "an open cohort";
    }
  }
  double slack = 0.0;
  for (const char* name : {"owed", "owed_path", "slack", "spread", "pair", "ranked"}) {
    T number;
    read(number);
    // Allows a slack of -1, which is not known since the load changed. Its upper bound follows from the
    // cohorts.
    const bool is_slack = std::string_view(name) == "slack";
    const double most = is_slack ? 2e30 : std::string_view(name) == "spread" ? farthest * farthest : 8.0;
    if (!within(wide(number), is_slack ? -1.0 : 0.0, most)) return name;
    if (is_slack) slack = wide(number);
  }
  double all = 0.0, sum[2] = {0.0, 0.0};
  for (std::uint32_t i = 0; i < lane.cohorts(); ++i) {
    SavedCohort<T> c;
    for (int axis = 0; axis < lane.axes(); ++axis) read(c.position[axis]);
    for (T* number : {&c.reach, &c.fresh, &c.left}) read(*number);
    if (lane.ages()) read(c.birth);
    for (T* number : {&c.low, &c.high}) read(*number);
    const double share = wide(c.fresh) * wide(c.left);
    if (!within(wide(c.left), 0.0, 1.0)) return "a cohort's survival";
    if (!within(share, 0.0, 1.0 + rounding) || !within(wide(c.fresh), 0.0, 2e7)) return "a cohort's share";
    if (!within(wide(c.low), 0.0, 1.0 + rounding) || !within(wide(c.high), wide(c.low), 1.0 + rounding))
      return "a cohort's ranks";
    if (!within(c.birth, -1e18, 1e18)) return "a cohort's birth";
    if (!within(wide(c.reach), 0.0, longest)) return "a cohort's reach";
    if (Lane<T>::is_none(c.fresh)) {
      // Refuses numbers in an empty cohort, which kernels multiply by 0.
      if (!(c == SavedCohort<T>{})) return "an empty cohort";
      continue;
    }
    if (!(wide(c.left) >= 1e-30)) return "a cohort's survival";
    double square = 0.0;
    for (int axis = 0; axis < lane.axes(); ++axis) {
      const double z = base[axis] - wide(c.position[axis]);
      square += z * z;
      sum[axis] += share * wide(c.position[axis]);
    }
    const double to_snap = wide(c.reach) * growth + law.residual - std::sqrt(square);
    // Refuses a cohort bent beyond its reach: its bristles would have snapped. Takes the greatest strength
    // that ageing gives.
    if (!(to_snap >= -rounding * farthest)) return "a cohort's position";
    if (slack > std::max(to_snap, 0.0) + rounding * farthest) return "slack";
    all += share;
  }
  if (!within(all, stiffness > 0.0 ? 1.0 - rounding : 0.0, stiffness > 0.0 ? 1.0 + rounding : 0.0))
    return "the shares";
  // Refuses a moment that the cohorts do not have, because the force follows from it.
  for (int axis = 0; axis < lane.axes(); ++axis)
    if (!within(sum[axis] - wide(moment[axis]), -rounding * near, rounding * near)) return "the moment";
  Int128 times_from = 0;
  if (lane.ages()) read(times_from);
  return times_from >= 0 && times_from <= *contact.record->clock ? nullptr : "a time";
}

template <class T>
void restore(Patch& p, std::uint32_t seed, ByteReader read) noexcept {
  const Lane<T> lane(p);
  restore_rest(p, seed, read);
  const auto number_from = [&read](auto& number) { read(number); };
  lane.contact_fields(number_from);
  for (std::uint32_t i = 0; i < lane.cohorts(); ++i) {
    lane.cohort_fields(i, number_from, number_from);
    lane.rank_fields(i, number_from);
  }
  if (lane.ages()) read(lane_of(p).times_from);
  lane.note_used();
  p.stiffness = lane.block.stiffness(lane.lane);
}

template <class T>
constexpr ContactModel brush_model = {
    .name = sizeof(T) == sizeof(double) ? "infinite, double" : "infinite, single",
    .take_lane = [](Patch& p, LanePool& pool) { assign_lane(p, pool, &make_block<T>); },
    .reset = &reset_lane,
    .take_over = &take_over<T>,
    .stored_energy = &stored_energy<T>,
    .hash = &hash<T>,
    .describe = &describe<T>,
    .read_bristles = &read_bristles<T>,
    .signature = &signature,
    .save = &save<T>,
    .find_fault = &find_fault<T>,
    .restore = &restore<T>};

void check(const Material& material, const PatchOptions& options) {
  if (material.snap_rule != SnapRule::redraw)
    throw Error(std::string(where) +
                ": the material has SnapRule::keep, whose bristles never forget their phases; infinite needs "
                "SnapRule::redraw (or use Population::representatives)");
  const double cv = material.snap_length.cv();
  if (cv < least_brush_spread)
    refuse(where, "snap_length.cv", cv,
           "at least 0.05: bristles of nearly one length snap in step (or use Population::representatives)");
  if (options.resolution != 0.0)
    require_within(where, "resolution", options.resolution, 1.0, highest_resolution,
                   "pieces per mean snap length; 0 = automatic");
}

template <class T>
Patch make_typed(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight) {
  LaneRecord made;
  made.options = options;
  if (options.resolution == 0.0) made.options.resolution = default_resolution;
  if (!(weight > 0.0)) made.options.bristles = choose_cohorts(*material, made.options.resolution);
  made.endless = true;
  return make_lane_patch(std::move(material), made, kernels, weight, brush_model<T>);
}

}  // namespace

bool allows_brush(const Material& material) noexcept {
  return material.snap_rule == SnapRule::redraw && material.snap_length.cv() >= least_brush_spread;
}

Patch make_brush(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight) {
  check(material->material, options);
#if BRISTLE_WITH_DOUBLE
  if (options.precision == Precision::double_)
    return make_typed<double>(std::move(material), options, kernels, weight);
#endif
  return make_typed<float>(std::move(material), options, kernels, weight);
}

}  // namespace bristle::detail
