// Changes the load of an infinite brush. When the load falls, the bristles that came into contact last leave
// first.
#include <algorithm>
#include <cmath>

#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {
namespace {

/// Finds the rank above which the mass `wanted` lies: the bristles above it leave contact. Uses Newton's
/// method on a piecewise linear sum, between bounds that close in. The rank of a bristle is the mass that
/// came into contact before it.
double find_cut(const Cohorts& r, double first, double wanted) noexcept {
  double low = 0.0;
  double high = r.mass;
  double cut = first;
  for (int i = 0; i < 100; ++i) {
    double mass, density;
    r.kernels->mass_above(r, r.rows, cut, &mass, &density);
    const double excess = mass - wanted;
    if (std::abs(excess) < 0.5) break;
    (excess > 0.0 ? low : high) = cut;
    double next = density > 0.0 ? cut + excess / density : low;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next == cut) break;
    cut = next;
  }
  return cut;
}

/// Removes the bristles with ranks above `cut`, which came into contact last, from cohort i, and returns the
/// mass left. `all`: highest rank after the fall of the load.
double cut_cohort(double* rows, std::uint32_t i, double cut, double all) noexcept {
  double& low = entry(rows, i, cohort_low);
  double& high = entry(rows, i, cohort_high);
  double kept = mass_of(rows, i);
  if (high > cut) {
    kept = std::floor(kept * std::clamp((cut - low) / (high - low), 0.0, 1.0) + 0.5);
    high = std::max(cut, low);
  }
  if (high > all) {
    low = std::max(0.0, low - (high - all));
    high = all;
  }
  if (high - low < 0.5) low = std::max(0.0, high - 0.5);
  if (high - low < 0.5) high = low + 0.5;
  return kept;
}

/// Removes the mass that a fallen load cannot hold in contact, and adds its sum of mass x squared deflection
/// to `lost`.
void shed(Patch& p, double mass_now, double& lost) noexcept {
  Cohorts& r = cohorts(p);
  if (mass_now == 0.0) {
    lost += cohort_squares(p);
    clear_cohorts(r);
    return;
  }
  const double spread = r.spread * (mass_now / r.mass);
  lost += r.spread - spread;
  r.spread = spread;
  const double at[2] = {place(p, r, 0), place(p, r, 1)};
  const double cut = find_cut(r, mass_now, r.mass - mass_now);
  double kept_of[most_cohorts];
  for (std::uint32_t i = 0; i < r.count; ++i) kept_of[i] = cut_cohort(r.rows, i, cut, mass_now);
  double missing = mass_now;
  std::uint32_t largest = 0;
  for (std::uint32_t i = 0; i < r.count; ++i) {
    missing -= kept_of[i];
    if (kept_of[i] > kept_of[largest]) largest = i;
  }
  // Corrects the masses to the wanted sum, from which rounding and bristles of nearly equal ranks (which
  // cannot be divided further) make them differ. The largest cohort takes the difference; those after it take
  // what it cannot.
  for (std::uint32_t k = 0; k < r.count && missing != 0.0; ++k) {
    const std::uint32_t i = (largest + k) % r.count;
    const double kept = std::clamp(kept_of[i] + missing, 0.0, mass_of(r.rows, i));
    missing -= kept - kept_of[i];
    kept_of[i] = kept;
  }
  for (std::uint32_t i = 0; i < r.count; ++i) {
    const double before = mass_of(r.rows, i);
    const double kept = kept_of[i];
    if (kept == before) continue;
    const double zx = at[0] - entry(r.rows, i, cohort_x);
    const double zy = at[1] - entry(r.rows, i, cohort_y);
    lost += (before - kept) * (zx * zx + zy * zy);
    entry(r.rows, i, cohort_fresh) = kept > 0.0 ? fresh_mass(kept, entry(r.rows, i, cohort_left)) : 0.0;
  }
  remove_empty(r);
  r.mass = mass_now;
  find_moment(r, r.rows);
}

/// Moves the base from which places are counted to the patch, if the patch has moved far away while out of
/// contact.
void come_near(const Patch& p, Cohorts& r) noexcept {
  constexpr double far = 4096.0;
  for (int axis = 0; axis < 2; ++axis)
    if (std::abs(place(p, r, axis)) > far) r.base[axis] = p.position[axis];
}

/// Adds straight bristles after a rise of the load. They are the last to come into contact, so they get the
/// highest ranks.
void admit(Patch& p, double mass_now, double& lost) noexcept {
  Cohorts& r = cohorts(p);
  if (r.count == 0) come_near(p, r);
  const double at[2] = {place(p, r, 0), place(p, r, 1)};
  const double low = r.mass;
  const double entered = mass_now - low;
  r.mass = mass_now;
  if (low > 0.0) r.layered = 1;
  const double dx = at[0] - r.begin[1][0];
  const double dy = at[1] - r.begin[1][1];
  // Lets entering bristles join the last cohort only if the patch has hardly moved since that cohort entered.
  // A larger distance would mix bristles of different ranks.
  const double near = r.law.piece / 16.0;
  bool joins = r.open[1] != no_cohort && dx * dx + dy * dy <= near * near;
  if (r.count == 0) begin_time(p);
  const int ages = r.ageing != nullptr ? 1 : 0;
  const CohortTimes times = times_of(p);
  // Keeps new bristles apart from a cohort that has noticeably aged.
  if (joins && ages) joins = (strength_of(p, times, r.open[1]) - 1.0) * r.law.mean <= r.law.piece / 8.0;
  if (!joins && r.count == r.capacity) lost += r.kernels->make_room[ages](r.law, r, r.rows, at, times);
  lost += r.kernels->enter[ages](r.law, r, r.rows, at, entered, low, mass_now, joins, times);
  for (int axis = 0; axis < 2; ++axis) r.moment[axis] += entered * at[axis];
}

/// Scales deflections when the load rises above the maximum, or further above it. Each bristle in contact
/// then carries more load, but the force of a patch at rest must not change.
void scale_deflections(Patch& p, double factor) noexcept {
  Cohorts& r = cohorts(p);
  const double at[2] = {place(p, r, 0), place(p, r, 1)};
  for (std::uint32_t i = 0; i < r.count; ++i)
    for (int axis = 0; axis < 2; ++axis) {
      double& x = entry(r.rows, i, axis == 0 ? cohort_x : cohort_y);
      x = at[axis] - (at[axis] - x) * factor;
    }
  r.spread *= factor * factor;
  find_moment(r, r.rows);
}

}  // namespace

double apply_cohort_load(Patch& p, double normal_load_n) noexcept {
  Cohorts& r = cohorts(p);
  end_glide(p);
  p.normal_load = normal_load_n;
  p.zeta = p.material().material.bristles_in_contact(normal_load_n);
  const double share = p.zeta / r.zeta_max();
  // Keeps rounding from turning the maximum load itself into an overload.
  const double overload = share > 1.0 + 1e-14 ? share : 1.0;
  const double mass = std::floor(std::min(share, 1.0) * full_mass + 0.5);
  const double joules = joules_per_unit(p);
  double lost = 0.0;
  if (mass < r.mass)
    shed(p, mass, lost);
  else if (mass > r.mass)
    admit(p, mass, lost);
  double loss = joules * lost;
  if (overload != p.overload) {
    const double before = joules * cohort_squares(p);
    if (overload > p.overload) scale_deflections(p, p.overload / overload);
    p.overload = overload;
    loss += before - joules_per_unit(p) * cohort_squares(p);
  }
  r.run = 0.0;
  p.known = Bound::none;
  note_cohorts(p);
  return loss;
}

}  // namespace bristle::detail
