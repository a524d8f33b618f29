// A live change of material of an infinite brush.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/patches/cohorts/cohorts.hpp"
#include "core/patches/cohorts/fluctuation.hpp"

namespace bristle::detail {
namespace {

/// Every cohort gets fresh lengths of the new law: bristles bent beyond theirs slip at once, each along its
/// own deflection, to straight or to what the law's residual leaves. They become one cohort.
void renew_all(Patch& p) noexcept {
  Cohorts& r = cohorts(p);
  double snapped = 0.0;
  double squares = r.spread;
  r.spread = 0.0;
  double bent[2] = {0.0, 0.0};  // sum of mass x deflection of those that slipped
  for (std::uint32_t i = 0; i < r.count; ++i) {
    const double mass = mass_of(r.rows, i);
    const double zx = place(p, r, 0) - entry(r.rows, i, cohort_x);
    const double zy = place(p, r, 1) - entry(r.rows, i, cohort_y);
    const double square = zx * zx + zy * zy;
    entry(r.rows, i, cohort_fresh) = mass + 0.5;
    const double length = std::sqrt(square);
    double kept = r.kernels->renew(r.law, r.rows, i, std::max(length - r.law.residual, 0.0));
    if (r.noise != nullptr) kept = draw_kept(r, i, mass, kept);
    snapped += mass - kept;
    squares += (mass - kept) * square;
    if (length > 0.0) {
      bent[0] += (mass - kept) * r.law.residual * (zx / length);
      bent[1] += (mass - kept) * r.law.residual * (zy / length);
    }
  }
  remove_empty(r, r.rows);
  if (snapped > 0.0) {
    const double at[2] = {place(p, r, 0), place(p, r, 1)};
    if (r.count == r.capacity) squares += r.kernels->make_room(r.law, r, r.rows, at);
    const double straight[2] = {at[0] - bent[0] / snapped, at[1] - bent[1] / snapped};
    squares -= (bent[0] * bent[0] + bent[1] * bent[1]) / snapped;
    r.kernels->enter(r.law, r, r.rows, straight, snapped, 0.0, r.mass, false);
    r.open[1] = no_cohort;
  }
  p.pending_dissipated += joules_per_unit(p) * squares;
  const double snaps = snapped / r.units_per_bristle() + r.snap_rest;
  p.pending_snaps += static_cast<std::uint64_t>(snaps);
  r.snap_rest = snaps - std::floor(snaps);
}

}  // namespace

void take_over_cohorts(Patch& to, Patch& from) noexcept {
  Cohorts& r = cohorts(to);
  const Cohorts& old = cohorts(from);
  r.options.key = old.options.key;
  r.options.seed = old.options.seed;
  to.pending_snaps = from.pending_snaps;
  to.pending_dissipated = from.pending_dissipated;
  to.pending_loss = from.pending_loss;
  to.overload = from.overload;
  set_pieces(r, old.detail);

  // Places from where the patch is, in the units of the new material.
  const std::uint32_t capacity = r.capacity;
  static_cast<CohortState&>(r) = old;
  r.capacity = capacity;
  r.snap_rest = old.snap_rest;
  std::memcpy(r.rows, old.rows, old.used_numbers() * sizeof(double));
  const Material& material = to.material().material;
  const Material& before = from.material().material;
  const bool same_law =
      material.snap_length == before.snap_length && material.residual_length == before.residual_length;
  if (!same_law) {
    const double ratio = from.material().metres_per_length * to.material().lengths_per_metre;  // power of two
    for (std::uint32_t i = 0; i < r.count; ++i)
      for (int axis = 0; axis < 2; ++axis) {
        double& x = entry(r.rows, i, axis == 0 ? cohort_x : cohort_y);
        x = (x - place(from, old, axis)) * ratio;
      }
    for (int axis = 0; axis < 2; ++axis) r.base[axis] = 0;
    for (std::uint32_t& open : r.open) open = no_cohort;
    r.spread *= ratio * ratio;
    renew_all(to);
  } else {
    for (int axis = 0; axis < 2; ++axis) to.position[axis] = from.position[axis];
  }
  find_moment(r, r.rows);
  // The same load may now mean another number of bristles.
  to.pending_loss += apply_cohort_load(to, from.normal_load);
}

}  // namespace bristle::detail
