// Energy, hash and saved bytes of an infinite brush, and the upkeep of the rows that hold its cohorts.
#include <algorithm>
#include <cmath>

#include "core/common/hashing.hpp"
#include "core/patches/cohorts/cohorts.hpp"
#include "core/patches/cohorts/fluctuation.hpp"

namespace bristle::detail {
namespace {

/// Lists the saved fields of an infinite brush besides its rows of cohorts and what all contact models save.
/// Reading and writing use the same list.
template <class Io, class Record, class NotedAt>
void cohort_fields(Io& io, Record& r, NotedAt& noted) noexcept {
  io(r.mass);
  io(r.run);
  io(r.snap_rest);
  io(r.spread);
  for (int axis = 0; axis < 2; ++axis) {
    io(r.base[axis]);
    io(r.moment[axis]);
    io(r.direction[axis]);
    io(r.slid_to[axis]);
    io(r.begin[0][axis]);
    io(r.begin[1][axis]);
    io(r.open[axis]);
    io(noted[axis]);
  }
  io(r.open[2]);
  io(r.layered);
  io(r.count);
  io(r.detail);
  for (int axis = 0; axis < 2; ++axis) {
    io(r.glide.direction[axis]);
    io(r.glide.node[axis]);
    io(r.glide.from[axis]);
  }
  io(r.glide.length);
  io(r.glide.way);
  io(r.glide.curve);
  io(r.glide.from_curve);
  io(r.glide.known);
  io(r.glide.on);
}

/// Lists the fields that an ageing patch saves besides the times when its cohorts were last straight.
template <class Io>
void ageing_fields(Io& io, CohortAgeing& a) noexcept {
  io(a.base);
  io(a.per_length);
  io(a.until);
  io(a.oldest);
}

/// Reads the value in one column of cohort i.
double read_entry(ByteReader rows, std::uint32_t i, CohortColumn column) noexcept {
  rows.skip((i / cohort_lanes * cohort_row + column * cohort_lanes + i % cohort_lanes) * sizeof(double));
  double value = 0.0;
  rows(value);
  return value;
}

const char* find_row_fault(const Cohorts& r, const double (&at)[2], const Cohorts& saved, ByteReader rows) {
  const double longest = r.law.end * (1.0 + 1e-3);
  // Allows for the growth of snap lengths by ageing at the largest age, a factor of 1 + 60 beta for the
  // logarithmic form.
  const Material& material = r.material->material;
  const double farthest = longest * material.ageing_factor(longest_ageing_time * 1e16) + r.law.residual;
  const SurvivalTable& survival = r.material->survival();
  double mass = 0.0;
  for (std::uint32_t i = 0; i < saved.count; ++i) {
    const auto read = [&](CohortColumn column) { return read_entry(rows, i, column); };
    const double zx = at[0] - read(cohort_x);
    const double zy = at[1] - read(cohort_y);
    if (!within(zx, -farthest, farthest) || !within(zy, -farthest, farthest)) return "a cohort's place";
    if (!within(read(cohort_reach), 0.0, longest)) return "a cohort's reach";
    // Refuses a stored survival S below that of the law at this reach R, because a later look-up of S would
    // then increase the cohort's mass.
    const double left = survival_at(survival, read(cohort_reach)).left;
    if (!within(read(cohort_left), std::max(left * (1.0 - 1e-12), 1e-30), 1.0)) return "a cohort's survival";
    if (!within(read(cohort_moment), 0.0, r.law.mean)) return "a cohort's moment";
    const double m = std::floor(read(cohort_fresh) * read(cohort_left));
    if (!within(m, 0.0, saved.mass)) return "a cohort's mass";
    if (!within(read(cohort_low), 0.0, full_mass) ||
        !within(read(cohort_high), read(cohort_low) + 0.25, 2.0 * full_mass))
      return "a cohort's ranks";
    mass += m;
  }
  return mass == saved.mass ? nullptr : "mass";
}

const char* find_glide_fault(const Cohorts& r, const Glide& saved, std::uint32_t count) noexcept {
  for (int axis = 0; axis < 2; ++axis)
    for (double x : {saved.direction[axis], saved.node[axis], saved.from[axis]})
      if (!within(x, -1.000001, 1.000001)) return "direction of its course";
  if (!within(saved.length, 0.0, 1e300) || !within(saved.way, 0.0, 1e300)) return "length of its course";
  for (double x : {saved.curve, saved.from_curve})
    if (!within(x * r.memory, -1.0, 1.0)) return "curvature of its course";
  if (saved.known > 1 || saved.on > 1) return "course";
  const bool unit = within(saved.from[0] * saved.from[0] + saved.from[1] * saved.from[1], 0.99, 1.01);
  if (saved.on != 0 && !(r.glides && unit && count > 0)) return "glide";
  return nullptr;
}

const char* find_ageing_fault(const Cohorts& r, std::uint32_t count, ByteReader read) noexcept {
  CohortAgeing saved;
  ageing_fields(read, saved);
  constexpr double ever = 1e17;  // time longer than any clock runs for, s
  if (saved.base < 0 || saved.base > static_cast<Int128>(ever * clock_units_per_second))
    return "base of time";
  if (!within(saved.per_length, 0.0, 1e300)) return "speed";
  if (!within(saved.until, -ever, ever) || !within(saved.oldest, -ever, ever)) return "time";
  for (std::uint32_t i = 0; i < r.capacity; ++i) {
    double birth = 0.0;
    read(birth);
    if (i < count && !within(birth, -ever, ever)) return "a cohort's birth";
  }
  return nullptr;
}

}  // namespace

void clear_cohorts(Cohorts& r) noexcept {
  for (std::uint32_t i = 0; i < r.capacity; ++i) clear_lane(r.rows, i);
  r.count = r.layered = 0;
  for (std::uint32_t& open : r.open) open = no_cohort;
  r.spread = r.mass = r.moment[0] = r.moment[1] = 0.0;
}

void remove_empty(CohortState& s, double* rows, double* births) noexcept {
  for (std::uint32_t i = s.count; i-- > 0;)
    if (entry(rows, i, cohort_fresh) == 0.0) remove_cohort(s, rows, births, i);
}
void remove_empty(Cohorts& r) noexcept {
  remove_empty(r, r.rows, r.ageing != nullptr ? r.births() : nullptr);
}

void find_moment(CohortState& s, const double* rows) noexcept {
  double x = 0.0;
  double y = 0.0;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double mass = mass_of(rows, i);
    x += mass * entry(rows, i, cohort_x);
    y += mass * entry(rows, i, cohort_y);
  }
  s.moment[0] = x;
  s.moment[1] = y;
}

double cohort_squares(const Patch& p) noexcept {
  const Cohorts& r = cohorts(p);
  const double at[2] = {place(p, r, 0), place(p, r, 1)};
  double sum = r.spread + r.mass * glide_squares(r);
  for (std::uint32_t i = 0; i < r.count; ++i) {
    const double zx = at[0] - entry(r.rows, i, cohort_x);
    const double zy = p.axes == 2 ? at[1] - entry(r.rows, i, cohort_y) : 0.0;
    sum += mass_of(r.rows, i) * (zx * zx + zy * zy);
  }
  return sum;
}

double joules_per_unit(const Patch& p) noexcept {
  const CompiledMaterial& m = p.material();
  return 0.5 * m.material.bristle_stiffness * p.overload * m.metres_per_length * m.metres_per_length /
         cohorts(p).units_per_bristle();
}

Int128 deflections_at(const CohortState& s, double at, int axis) noexcept {
  const double sum = (s.mass * at - s.moment[axis]) * sum_per_mass_length;
  if (std::abs(sum) < 9e18) return std::llrint(sum);
  return static_cast<Int128>(sum);
}

/// Writes the patch's sum of deflections as it was noted earlier: computed exactly at the position `noted`,
/// and from there on changed by the motion to the present position.
void note_sum(Patch& p, int axis, std::int64_t noted) noexcept {
  const Cohorts& r = cohorts(p);
  const double at = to_lengths(difference(noted, r.base[axis]));
  p.sum[axis] = axis < p.axes ? deflections_at(r, at, axis) : 0;
  p.sum[axis] += Int128{p.whole} * difference(p.position[axis], noted);
  p.part_sum[axis] = 0;
  p.part_position[axis] = noted;
}

void note_cohorts(Patch& p) noexcept {
  const Cohorts& r = cohorts(p);
  const CompiledMaterial& m = p.material();
  const double counts = r.mass / mass_per_count;
  p.whole = static_cast<std::uint32_t>(counts);
  p.part = counts - p.whole;
  for (int axis = 0; axis < 2; ++axis) note_sum(p, axis, p.position[axis]);
  p.newtons_per_unit = m.material.bristle_stiffness * p.overload * m.metres_per_length * length_per_fixed *
                       (mass_per_count / r.units_per_bristle());
  note_contact(p);
}

double find_cohort_energy(const Patch& p) noexcept { return joules_per_unit(p) * cohort_squares(p); }

std::uint64_t hash_cohorts(const Patch& p) noexcept {
  const Cohorts& r = cohorts(p);
  Hasher hasher;
  hasher.add(p.material().hash);
  for (double x : {r.zeta_max(), r.mass, p.overload, r.run, r.law.piece, r.snap_rest, r.spread})
    hasher.add(x);
  for (int axis = 0; axis < 2; ++axis) {
    hasher.add(static_cast<std::uint64_t>(difference(p.position[axis], r.base[axis])));
    hasher.add(static_cast<std::uint64_t>(difference(p.position[axis], r.slid_to[axis])));
    hasher.add(static_cast<std::uint64_t>(difference(p.position[axis], p.part_position[axis])));
    for (double x : {r.moment[axis], r.direction[axis], r.begin[0][axis], r.begin[1][axis]}) hasher.add(x);
    hasher.add(std::uint64_t{r.open[axis]});
  }
  hasher.add(std::uint64_t{r.open[2]} << 32 | r.layered);
  const Glide& g = r.glide;
  for (int axis = 0; axis < 2; ++axis)
    for (double x : {g.direction[axis], g.node[axis], g.from[axis]}) hasher.add(x);
  for (double x : {g.length, g.way, g.curve, g.from_curve}) hasher.add(x);
  hasher.add(std::uint64_t{g.known} << 32 | g.on);
  if (r.noise != nullptr) {
    hasher.add(r.law.draw_key);
    hasher.add(r.draws);
    hasher.add(r.draws_due);
  }
  for (std::uint32_t i = 0; i < r.count; ++i)
    for (std::uint32_t c = 0; c < cohort_columns; ++c)
      hasher.add(entry(r.rows, i, static_cast<CohortColumn>(c)));
  if (r.ageing != nullptr && r.count > 0) {
    hasher.add(times_of(p).now);
    for (double x : {r.ageing->per_length, r.ageing->until, r.ageing->oldest}) hasher.add(x);
    for (std::uint32_t i = 0; i < r.count; ++i) hasher.add(r.births()[i]);
  }
  return hasher.value();
}

void read_cohorts(const Patch& p, std::size_t count, Span<double> zx, Span<double> zy,
                  Span<double> delta) noexcept {
  const Cohorts& r = cohorts(p);
  const double metres = p.material().metres_per_length;
  const CohortTimes times = times_of(p);
  // Assigns the bristles asked for to cohorts in the order of their rows, in proportion to their mass.
  std::uint32_t at = 0;
  double passed = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double wanted = (static_cast<double>(i) + 0.5) / static_cast<double>(count) * r.mass;
    while (at + 1 < r.count && passed + mass_of(r.rows, at) < wanted) passed += mass_of(r.rows, at++);
    const bool in = at < r.count;
    double z[2] = {0.0, 0.0};
    if (in) find_deflection(p, at, z);
    if (!zx.empty()) zx[i] = z[0] * metres;
    if (!zy.empty()) zy[i] = p.axes == 2 ? z[1] * metres : 0.0;
    if (!delta.empty())
      delta[i] = in ? entry(r.rows, at, cohort_reach) * strength_of(p, times, at) * metres : 0.0;
  }
}

std::uint64_t cohort_signature(const Patch& p) noexcept {
  const Cohorts& r = cohorts(p);
  Hasher hasher;
  hasher.add(p.material().hash);
  for (double x : {r.zeta_max(), r.options.max_normal_load, r.options.resolution}) hasher.add(x);
  hasher.add(std::uint64_t{r.capacity} << 32 | r.first_seed);
  if (r.noise != nullptr) hasher.add(std::uint64_t{r.options.fluctuation});
  hasher.add(static_cast<std::uint64_t>(p.axes) << 8 | static_cast<std::uint64_t>(p.outputs));
  return hasher.value();
}

void save_cohorts(const Patch& p, ByteWriter& write) noexcept {
  const Cohorts& r = cohorts(p);
  cohort_fields(write, r, p.part_position);
  if (r.noise != nullptr) fluctuation_fields(write, r);
  write.column(r.rows, r.used_numbers());
  write.zeros<double>(r.capacity * cohort_columns - r.used_numbers());
  if (r.ageing == nullptr) return;
  ageing_fields(write, *r.ageing);
  write.column(r.births(), r.count);
  write.zeros<double>(r.capacity - r.count);
}

const char* find_cohort_fault(const Patch& p, const Patch& contact, ByteReader read) noexcept {
  const Cohorts& r = cohorts(p);
  Cohorts saved;
  std::int64_t noted[2];
  cohort_fields(read, saved, noted);
  if (r.noise != nullptr) fluctuation_fields(read, saved);
  const double share = contact.zeta / r.zeta_max();
  if (!(contact.overload == (share > 1.0 + 1e-14 ? share : 1.0))) return "overload";
  if (saved.mass != std::floor(std::min(share, 1.0) * full_mass + 0.5)) return "mass";
  if (saved.count > r.capacity) return "count";
  if (saved.detail < 1 || saved.detail > r.pieces) return "detail";
  if (!within(saved.run, 0.0, r.follow)) return "run";
  if (!within(saved.snap_rest, 0.0, 1.0)) return "snap_rest";
  if (!within(saved.draws_due, 0.0, 1.0)) return "renewals due";
  if (saved.layered > 1) return "layered";
  if (!within(saved.spread, 0.0, full_mass * 1e8)) return "spread";
  for (std::uint32_t open : saved.open)
    if (open != no_cohort && open >= saved.count) return "open";
  // Allows any place for a patch out of contact, because the next contact resets the base of its places.
  const double near = saved.count > 0 ? 1e4 : 1e300;
  double at[2];
  for (int axis = 0; axis < 2; ++axis) {
    at[axis] = to_lengths(difference(contact.position[axis], saved.base[axis]));
    if (!within(at[axis], -near, near)) return "base";
    if (!within(to_lengths(difference(contact.position[axis], noted[axis])), -near, near))
      return "noted place";
    const double farthest = full_mass * 2e4;
    if (!within(saved.moment[axis], -farthest, farthest)) return "moment";
    if (!within(saved.direction[axis], -1.0, 1.0)) return "direction";
    for (const auto& begin : saved.begin)
      if (!within(begin[axis], -1e12, 1e12)) return "begin";
  }
  if (const char* fault = find_glide_fault(r, saved.glide, saved.count)) return fault;
  if (const char* fault = find_row_fault(r, at, saved, read)) return fault;
  if (r.ageing == nullptr) return nullptr;
  read.skip(std::size_t{r.capacity} * cohort_columns * sizeof(double));
  return find_ageing_fault(r, saved.count, read);
}

void restore_cohorts(Patch& p, std::uint32_t seed, ByteReader read) noexcept {
  Cohorts& r = cohorts(p);
  r.options.seed = seed;
  std::int64_t noted[2];
  cohort_fields(read, r, noted);
  if (r.noise != nullptr) fluctuation_fields(read, r);
  set_pieces(r, r.detail);
  read.column(r.rows, r.capacity * cohort_columns);
  for (std::uint32_t i = r.count; i < r.capacity; ++i) clear_lane(r.rows, i);
  if (r.ageing != nullptr) {
    *r.ageing = CohortAgeing{};
    ageing_fields(read, *r.ageing);
    read.column(r.births(), r.capacity);
  }
  p.bound.reach = no_reach;
  note_cohorts(p);
  for (int axis = 0; axis < 2; ++axis) note_sum(p, axis, noted[axis]);
  if (r.glide.on == 0) return;
  find_glide_means(p, r.glide);
  note_glide(p);
}

}  // namespace bristle::detail
