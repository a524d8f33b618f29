// Energy, hash and saved bytes of an infinite brush, and the care of the rows that hold its cohorts.
#include <algorithm>
#include <cmath>

#include "core/common/hashing.hpp"
#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {
namespace {

// Lists the saved scalars of an infinite brush, in the order of the saved bytes. `r`: the brush whose
// material and options bound them.

template <class State, class Visit>
void slide_fields(State& s, const Cohorts& r, Visit&& visit) noexcept {
  visit(s.mass, FieldRule{.hashed = Hashed::apart});
  visit(s.run, FieldRule{"run", 0.0, r.follow, Hashed::apart});
  visit(s.snap_fraction, FieldRule{"snap_fraction", 0.0, 1.0, Hashed::apart});
  visit(s.spread, FieldRule{"spread", 0.0, full_mass * 1e8, Hashed::apart});
}

/// Lists the saved scalars along one axis, for writing and for reading. `noted`: position at which the sum of
/// deflections was computed exactly.
template <class State, class Noted, class Visit>
void axis_fields(State& s, Noted& noted, int axis, Visit&& visit) noexcept {
  visit(s.base[axis], placed(axis));
  visit(s.moment[axis], FieldRule{"moment", -full_mass * 2e4, full_mass * 2e4});
  visit(s.direction[axis], FieldRule{"direction", -1.0, 1.0});
  visit(s.slid_to[axis], placed(axis));
  for (auto& begin : s.begin) visit(begin[axis], FieldRule{"begin", -1e12, 1e12});
  visit(s.open[axis]);
  visit(noted[axis], placed(axis));
}

template <class State, class Visit>
void count_fields(State& s, const Cohorts& r, Visit&& visit) noexcept {
  visit(s.open[2], FieldRule{.hashed = Hashed::high_half});
  visit(s.layered, FieldRule{"layered", 0.0, 1.0});
  visit(s.count, FieldRule{"count", 0.0, static_cast<double>(r.capacity), Hashed::apart});
}

template <class AnyGlide, class Visit>
void glide_fields(AnyGlide& g, const Cohorts& r, Visit&& visit) noexcept {
  constexpr FieldRule unit{"direction of its course", -1.000001, 1.000001};
  constexpr FieldRule path{"length of its course", 0.0, 1e300};
  const FieldRule bend{"curvature of its course", -1.0 / r.memory, 1.0 / r.memory};
  for (int axis = 0; axis < 2; ++axis) {
    visit(g.direction[axis], unit);
    visit(g.node[axis], unit);
    visit(g.from[axis], unit);
  }
  visit(g.length, path);
  visit(g.way, path);
  visit(g.curve, bend);
  visit(g.from_curve, bend);
  visit(g.known, FieldRule{"course", 0.0, 1.0, Hashed::high_half});
  visit(g.on, FieldRule{"course", 0.0, 1.0});
}

template <class State, class Noted, class Visit>
void cohort_fields(State& s, Noted& noted, const Cohorts& r, Visit&& visit) noexcept {
  slide_fields(s, r, visit);
  for (int axis = 0; axis < 2; ++axis) axis_fields(s, noted, axis, visit);
  count_fields(s, r, visit);
  glide_fields(s.glide, r, visit);
}

constexpr double ever = 1e17;  ///< time longer than any clock runs for, s

/// Lists the fields that an ageing patch saves in addition to the birth times of its cohorts.
template <class Ageing, class Visit>
void ageing_fields(Ageing& a, Visit&& visit) noexcept {
  visit(a.base, FieldRule{"base of time", 0.0, ever * clock_units_per_second, Hashed::apart});
  visit(a.per_length, FieldRule{"speed", 0.0, 1e300});
  visit(a.until, FieldRule{"time", -ever, ever});
  visit(a.oldest, FieldRule{"time", -ever, ever});
}

/// Reads, from saved rows of cohorts, the value in one column of cohort i.
double read_entry(ByteReader rows, std::uint32_t i, CohortColumn column) noexcept {
  rows.skip((i / cohort_lanes * cohort_row + column * cohort_lanes + i % cohort_lanes) * sizeof(double));
  double value = 0.0;
  rows(value);
  return value;
}

const char* find_row_fault(const Cohorts& r, const double (&at)[2], const Cohorts& saved, ByteReader rows) {
  const double longest = r.law.end * (1.0 + 1e-3);
  // Allows for the growth of snap lengths by ageing up to the largest age: a factor of 1 + 60 beta for the
  // logarithmic form.
  const Material& material = r.material->material;
  const double farthest = longest * material.ageing_factor(longest_ageing_time * 1e16) + r.law.residual;
  const SurvivalTable& survival = r.material->survival();
  double mass = 0.0;
  double moment[2] = {0.0, 0.0};
  for (std::uint32_t i = 0; i < saved.count; ++i) {
    const auto read = [&](CohortColumn column) { return read_entry(rows, i, column); };
    const double zx = at[0] - read(cohort_x);
    const double zy = at[1] - read(cohort_y);
    if (!within(zx, -farthest, farthest) || !within(zy, -farthest, farthest)) return "a cohort's place";
    if (!within(read(cohort_reach), 0.0, longest)) return "a cohort's reach";
    // Refuses a stored survival S that is below that of the law at this reach R. A later look-up of S would
    // increase the cohort's mass.
    const double left = survival_at(survival, read(cohort_reach)).left;
    if (!within(read(cohort_left), std::max(left * (1.0 - 1e-12), 1e-30), 1.0)) return "a cohort's survival";
    if (!within(read(cohort_moment), 0.0, r.law.mean)) return "a cohort's moment";
    const double m = std::floor(read(cohort_fresh) * read(cohort_left));
    if (!within(m, 0.0, saved.mass)) return "a cohort's mass";
    if (!within(read(cohort_low), 0.0, full_mass) ||
        !within(read(cohort_high), read(cohort_low) + 0.25, 2.0 * full_mass))
      return "a cohort's ranks";
    mass += m;
    moment[0] += m * read(cohort_x);
    moment[1] += m * read(cohort_y);
  }
  if (mass != saved.mass) return "mass";
  // Refuses a moment that its cohorts do not have, because the force follows from it.
  const double rounding = 1e-3 * mass * longest;
  for (int axis = 0; axis < 2; ++axis)
    if (!within(saved.moment[axis] - moment[axis], -rounding, rounding)) return "moment";
  return nullptr;
}

const char* find_ageing_fault(const Cohorts& r, std::uint32_t count, ByteReader read) noexcept {
  CohortAgeing saved;
  FieldCheck check{read};
  ageing_fields(saved, check);
  if (check.fault != nullptr) return check.fault;
  for (std::uint32_t i = 0; i < r.capacity; ++i) {
    double birth = 0.0;
    read(birth);
    // Checks the births behind the last cohort too, since kernels step whole rows and need numbers there.
    // They are saved as 0.
    if (!(i < count ? within(birth, -ever, ever) : birth == 0.0)) return "a cohort's birth";
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

double squares_at(const CohortState& s, const double* rows, const double (&at)[2], double sum) noexcept {
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double zx = at[0] - entry(rows, i, cohort_x);
    const double zy = at[1] - entry(rows, i, cohort_y);
    sum += mass_of(rows, i) * (zx * zx + zy * zy);
  }
  return sum;
}

double cohort_squares(const Patch& p) noexcept {
  const Cohorts& r = cohorts(p);
  const double at[2] = {place(p, r, 0), p.axes == 2 ? place(p, r, 1) : 0.0};
  return squares_at(r, r.rows, at, r.spread + r.mass * glide_squares(r));
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

/// Writes the patch's sum of deflections as an exact computation at the position `noted` and the motion since
/// then give it, so that a restored patch has the same bits.
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
  for (double x : {r.zeta_max(), r.mass, p.overload, r.run, r.law.piece, r.snap_fraction, r.spread})
    hasher.add(x);
  FieldHash hash{hasher, p};
  for (int axis = 0; axis < 2; ++axis)
    for (const bool places : {true, false})
      axis_fields(r, p.part_position, axis, [&](const auto& value, const FieldRule& rule = {}) {
        if ((rule.hashed == Hashed::place) == places) hash(value, rule);
      });
  count_fields(r, r, hash);
  glide_fields(r.glide, r, hash);
  for (std::uint32_t i = 0; i < r.count; ++i)
    for (std::uint32_t c = 0; c < cohort_columns; ++c)
      hasher.add(entry(r.rows, i, static_cast<CohortColumn>(c)));
  if (r.ageing != nullptr && r.count > 0) {
    hasher.add(times_of(p).now);
    ageing_fields(*r.ageing, hash);
    for (std::uint32_t i = 0; i < r.count; ++i) hasher.add(r.births()[i]);
  }
  return hasher.value();
}

void read_cohorts(const Patch& p, std::size_t count, Span<double> zx, Span<double> zy,
                  Span<double> delta) noexcept {
  const Cohorts& r = cohorts(p);
  const double metres = p.material().metres_per_length;
  const CohortTimes times = times_of(p);
  // Distributes the bristles asked for over the cohorts, in the order of their rows and in proportion to
  // their mass.
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
  hasher.add(static_cast<std::uint64_t>(p.axes) << 8 | static_cast<std::uint64_t>(p.outputs));
  return hasher.value();
}

void save_cohorts(const Patch& p, ByteWriter& write) noexcept {
  const Cohorts& r = cohorts(p);
  cohort_fields(r, p.part_position, r, write);
  write.column(r.rows, r.used_numbers());
  write.zeros<double>(r.capacity * cohort_columns - r.used_numbers());
  if (r.ageing == nullptr) return;
  ageing_fields(*r.ageing, write);
  write.column(r.births(), r.count);
  write.zeros<double>(r.capacity - r.count);
}

const char* find_cohort_fault(const Patch& p, const Patch& contact, ByteReader read) noexcept {
  const Cohorts& r = cohorts(p);
  Cohorts saved;
  std::int64_t noted[2];
  FieldCheck check{read};
  cohort_fields(saved, noted, r, check);
  if (check.fault != nullptr) return check.fault;
  const double share = contact.zeta / r.zeta_max();
  if (!(contact.overload == (share > 1.0 + 1e-14 ? share : 1.0))) return "overload";
  if (saved.mass != std::floor(std::min(share, 1.0) * full_mass + 0.5)) return "mass";
  for (std::uint32_t open : saved.open)
    if (open != no_cohort && open >= saved.count) return "open";
  // Allows any place for a patch out of contact. Its next contact resets the base of its places.
  const double near = saved.count > 0 ? 1e4 : 1e300;
  double at[2];
  for (int axis = 0; axis < 2; ++axis) {
    at[axis] = to_lengths(difference(contact.position[axis], saved.base[axis]));
    if (!within(at[axis], -near, near)) return "base";
    if (!within(to_lengths(difference(contact.position[axis], noted[axis])), -near, near))
      return "noted place";
  }
  const double(&from)[2] = saved.glide.from;
  const bool unit = within(from[0] * from[0] + from[1] * from[1], 0.99, 1.01);
  if (saved.glide.on != 0 && !(r.glides && unit && saved.count > 0)) return "glide";
  if (const char* fault = find_row_fault(r, at, saved, read)) return fault;
  if (r.ageing == nullptr) return nullptr;
  read.skip(std::size_t{r.capacity} * cohort_columns * sizeof(double));
  return find_ageing_fault(r, saved.count, read);
}

void restore_cohorts(Patch& p, std::uint32_t seed, ByteReader read) noexcept {
  Cohorts& r = cohorts(p);
  r.options.seed = seed;
  std::int64_t noted[2];
  cohort_fields(r, noted, r, read);
  read.column(r.rows, r.capacity * cohort_columns);
  for (std::uint32_t i = r.count; i < r.capacity; ++i) clear_lane(r.rows, i);
  if (r.ageing != nullptr) {
    *r.ageing = CohortAgeing{};
    ageing_fields(*r.ageing, read);
    read.column(r.births(), r.capacity);
  }
  p.known = Bound::none;
  note_cohorts(p);
  for (int axis = 0; axis < 2; ++axis) note_sum(p, axis, noted[axis]);
  if (r.glide.on == 0) return;
  find_glide_means(p, r.glide);
  note_glide(p);
}

}  // namespace bristle::detail
