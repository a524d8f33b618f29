// Changes the material of an infinite brush while it is in use.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/materials/quantile_map.hpp"
#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {
namespace {

/// Gives the bristles of cohort i snap lengths beyond `reach`, and leaves its mass as it is.
void set_reach(const Cohorts& r, std::uint32_t i, double reach) noexcept {
  const double mass = mass_of(r.rows, i);
  entry(r.rows, i, cohort_fresh) = mass + 0.5;
  r.kernels->renew(r.law, r.rows, i, reach);
  const double left = entry(r.rows, i, cohort_left);
  entry(r.rows, i, cohort_fresh) = left > 0.0 ? fresh_mass(mass, left) : 0.0;
}

/// Raises the reach of cohort i, its largest deflection so far, to `bent`. Returns the mass of those bristles
/// whose snap lengths allow that.
double hold_beyond(const Cohorts& r, std::uint32_t i, double bent) noexcept {
  const double mass = mass_of(r.rows, i);
  if (bent <= entry(r.rows, i, cohort_reach)) return mass;
  const double kept = r.kernels->renew(r.law, r.rows, i, bent);
  if (kept <= mass) return kept;
  entry(r.rows, i, cohort_fresh) = fresh_mass(mass, entry(r.rows, i, cohort_left));
  return mass;
}

/// Lets all bristles bent beyond their new snap length slip at once. Each slips along its own deflection
/// until it is straight or bent by the residual; together they then form one cohort.
void slip_all(Patch& p) noexcept {
  Cohorts& r = cohorts(p);
  const CohortTimes times = times_of(p);
  double snapped = 0.0;
  double squares = r.spread;
  r.spread = 0.0;
  double bent[2] = {0.0, 0.0};  // sum of mass x residual deflection after slipping, x and y
  for (std::uint32_t i = 0; i < r.count; ++i) {
    const double mass = mass_of(r.rows, i);
    const double zx = place(p, r, 0) - entry(r.rows, i, cohort_x);
    const double zy = place(p, r, 1) - entry(r.rows, i, cohort_y);
    const double square = zx * zx + zy * zy;
    const double length = std::sqrt(square);
    const double reach = std::max(length - r.law.residual, 0.0) / strength_of(p, times, i);
    const double kept = hold_beyond(r, i, reach);
    snapped += mass - kept;
    squares += (mass - kept) * square;
    if (length > 0.0) {
      bent[0] += (mass - kept) * r.law.residual * (zx / length);
      bent[1] += (mass - kept) * r.law.residual * (zy / length);
    }
  }
  remove_empty(r);
  if (snapped > 0.0) {
    const double at[2] = {place(p, r, 0), place(p, r, 1)};
    const int ages = r.ageing != nullptr ? 1 : 0;
    if (r.count == r.capacity) squares += r.kernels->make_room[ages](r.law, r, r.rows, at, times);
    const double straight[2] = {at[0] - bent[0] / snapped, at[1] - bent[1] / snapped};
    squares -= (bent[0] * bent[0] + bent[1] * bent[1]) / snapped;
    r.kernels->enter[ages](r.law, r, r.rows, straight, snapped, 0.0, r.mass, false, times);
    r.open[1] = no_cohort;
  }
  p.pending_dissipated += joules_per_unit(p) * squares;
  const double snaps = snapped / r.units_per_bristle() + r.snap_fraction;
  p.pending_snaps += static_cast<std::uint64_t>(snaps);
  r.snap_fraction = snaps - std::floor(snaps);
}

/// Copies the ages of bristles to a patch of the new material. If the old material did not age, they begin at
/// 0.
void take_over_ages(Patch& to, const Cohorts& old) noexcept {
  const Cohorts& r = cohorts(to);
  if (r.ageing == nullptr) return;
  begin_time(to);
  if (old.ageing == nullptr) return;
  r.ageing->base = old.ageing->base;
  std::memcpy(r.births(), old.births(), old.count * sizeof(double));
}

bool same_ageing(const Material& a, const Material& b) noexcept {
  if (a.ageing_strength == 0.0 && b.ageing_strength == 0.0) return true;
  return a.ageing_form == b.ageing_form && a.ageing_strength == b.ageing_strength &&
         a.ageing_time == b.ageing_time;
}

}  // namespace

void take_over_cohorts(Patch& to, Patch& from) noexcept {
  Cohorts& r = cohorts(to);
  end_glide(from);
  const Cohorts& old = cohorts(from);
  r.options.seed = old.options.seed;
  to.overload = from.overload;

  // Converts the places of cohorts to scaled lengths of the new material, relative to the patch's present
  // position.
  const std::uint32_t capacity = r.capacity;
  static_cast<CohortState&>(r) = old;
  r.capacity = capacity;
  r.snap_fraction = old.snap_fraction;
  std::memcpy(r.rows, old.rows, old.used_numbers() * sizeof(double));
  take_over_ages(to, old);
  const Material& material = to.material().material;
  const Material& before = from.material().material;
  const bool same_law =
      material.snap_length == before.snap_length && material.residual_length == before.residual_length;
  if (!same_law) {
    // Ratio of the scaled length (unit of length) of the old material to that of the new one, a power of two,
    // so that conversion is exact.
    const double ratio = from.material().metres_per_length * to.material().lengths_per_metre;
    for (std::uint32_t i = 0; i < r.count; ++i)
      for (int axis = 0; axis < 2; ++axis) {
        double& x = entry(r.rows, i, axis == 0 ? cohort_x : cohort_y);
        x = (x - place(from, old, axis)) * ratio;
      }
    for (int axis = 0; axis < 2; ++axis) r.base[axis] = 0;
    for (std::uint32_t& open : r.open) open = no_cohort;
    r.spread *= ratio * ratio;
    const QuantileMap of_equal_quantile(before.snap_length, material.snap_length);
    for (std::uint32_t i = 0; i < r.count && before.snap_length != material.snap_length; ++i) {
      const double reach = entry(r.rows, i, cohort_reach) * from.material().metres_per_length;
      set_reach(r, i, of_equal_quantile(reach, 1.0) * to.material().lengths_per_metre);
    }
    slip_all(to);
  } else {
    for (int axis = 0; axis < 2; ++axis) to.position[axis] = from.position[axis];
    if (!same_ageing(material, before)) slip_all(to);
  }
  find_moment(r, r.rows);
  // Applies the present load again, because under the new material it may bring another number of bristles
  // into contact.
  to.pending_loss += apply_cohort_load(to, from.normal_load);
}

}  // namespace bristle::detail
