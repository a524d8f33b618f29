// The cohorts of infinite brushes in lanes (lane_brush.hpp has the step): access to their columns, ages, and
// sums over them.
#pragma once

#include "lane_brush_motion.hpp"

namespace bristle::detail {
namespace {

/// Access to the cohorts of one vector of contacts, from the lane `first` on.
template <class E, class T, int axes, bool books>
class BrushCohorts {
 protected:
  using V = typename E::V;
  using Which = decltype(V() < V());
  using Vector = Plane<V, axes>;
  using Columns = LaneColumn<T>*;

  /// A cohort: see BrushColumns.
  struct Cohort {
    Vector position;
    V reach, fresh, left;

    V share() const { return fresh * left; }
  };
  BrushCohorts(const BrushLaw<T>& the_law, const BrushColumns<T>& the_columns, const LaneInput& the_input,
               const BrushMotion<T, axes>& the_motion, std::uint32_t the_first)
      : law(the_law), columns(the_columns), input(the_input), motion(the_motion), first(the_first) {
    for (double& t : time) t = 0.0;
    if (!ages) return;
    for (std::uint32_t k = 0; k < E::size; ++k) time[k] = input.start[first + k];
  }

  const BrushLaw<T>& law;
  const BrushColumns<T>& columns;
  const LaneInput& input;
  const BrushMotion<T, axes>& motion;
  const std::uint32_t first;
  std::uint32_t used = *columns.used < 2 ? 2 : *columns.used;  ///< cohorts from there on are empty
  const bool ages = law.ageing_strength != 0.0;
  const V none = V(T(0)), one = V(T(1)), half = V(T(0.5)), tiny = V(T(1e-30));
  const V residual = V(static_cast<T>(law.residual)), low_reach = V(law.survival->low);
  double time[E::size];  ///< time of each contact at the end of the present piece, s
  bool has_ranks = any_lane(get(*columns.ranked) > none);  ///< whether any of the contacts has them
  Vector end;                       ///< position of the patch at the end of the present piece
  V lost = none;                    ///< twice the energy that is lost, by the square of the deflection
  V spread = get(*columns.spread);  ///< BrushColumns::spread

  [[gnu::always_inline]] V get(const Lane16<T>& from) const { return E::get(from.lane + first); }
  [[gnu::always_inline]] V get(const LaneColumn<T>& from) const { return E::get(from.lane + first); }
  [[gnu::always_inline]] void put(LaneColumn<T>& to, V x) const { E::put(to.lane + first, x); }
  [[gnu::always_inline]] void put(Which which, LaneColumn<T>& to, V x) const {
    put(to, select_lanes(which, x, get(to)));
  }
  [[gnu::always_inline]] Vector get(const Lane16<T> (&from)[axes]) const {
    Vector out;
    for (int axis = 0; axis < axes; ++axis) out.of[axis] = get(from[axis]);
    return out;
  }
  [[gnu::always_inline]] Vector get(LaneColumn<T>* const (&from)[2]) const {
    Vector out;
    for (int axis = 0; axis < axes; ++axis) out.of[axis] = get(*from[axis]);
    return out;
  }
  [[gnu::always_inline]] void put(Which which, LaneColumn<T>* const (&to)[2], const Vector& x) const {
    for (int axis = 0; axis < axes; ++axis) put(which, *to[axis], x.of[axis]);
  }
  [[gnu::always_inline]] Vector position(std::uint32_t j) const {
    Vector out;
    out.of[0] = get(columns.x[j]);
    if constexpr (axes == 2) out.of[1] = get(columns.y[j]);
    return out;
  }
  [[gnu::always_inline]] Cohort cohort(std::uint32_t j) const {
    return {position(j), get(columns.reach[j]), get(columns.fresh[j]), get(columns.left[j])};
  }
  [[gnu::always_inline]] void put(Which which, std::uint32_t j, const Cohort& c) const {
    put(which, columns.x[j], c.position.of[0]);
    if constexpr (axes == 2) put(which, columns.y[j], c.position.of[1]);
    put(which, columns.reach[j], c.reach);
    put(which, columns.fresh[j], c.fresh);
    put(which, columns.left[j], c.left);
  }
  static V square(V a) { return a * a; }
  /// Returns the contacts whose bristles have ranks, because their load has risen.
  Which is_ranked() const { return get(*columns.ranked) > none; }
  Vector zero() const {
    Vector out;
    for (V& x : out.of) x = none;
    return out;
  }
  /// Returns S(R), at least what a cohort of bristles needs; for one contact or for a vector of contacts.
  template <class N>
  N reach_to_left(N reach) const {
    return most(survival(*law.survival, reach), N(static_cast<T>(least_left)));
  }
  static V mean_square(V low, V high) { return (low * low + low * high + high * high) * V(T(1.0 / 3)); }

  template <class N>
  N growth_at(N age) const {
    return growth<T>(AgeingLaw<T>{static_cast<T>(law.ageing_strength), T(0), law.ageing_form == 1}, age);
  }
  T age(std::uint32_t j, std::uint32_t k) const {
    const double since = (time[k] - columns.birth[j].lane[first + k]) * law.ageing_rate;
    return static_cast<T>(least(most(since, 0.0), oldest));
  }
  /// Returns the ages of cohort j's bristles, in ageing times.
  V age_of(std::uint32_t j) const {
    alignas(64) T ages_of[E::size];
    for (std::uint32_t k = 0; k < E::size; ++k) ages_of[k] = age(j, k);
    return E::get(ages_of);
  }
  /// Returns the factor by which ageing has lengthened the snap lengths of cohort j.
  V growth_of(std::uint32_t j) const { return growth_at(age_of(j)); }
  /// Returns the age, in ageing times, at which the growth factor is `factor`.
  double age_of_growth(double factor) const {
    const double grown = most(factor - 1.0, 0.0) / law.ageing_strength;
    if (law.ageing_form == 1) return -natural_log<double>(most(1.0 - grown, 1e-17));
    return exponential<double>(least(grown, 75.0)) - 1.0;
  }

  /// Moves the origins of the contacts' positions.
  void shift_origin() {
    const Vector shift = get(motion.shift);
    for (std::uint32_t j = 0; j < law.cohorts; ++j) {
      put(columns.x[j], get(columns.x[j]) - shift.of[0]);
      if constexpr (axes == 2) put(columns.y[j], get(columns.y[j]) - shift.of[1]);
    }
    for (int axis = 0; axis < axes; ++axis) {
      LaneColumn<T>* const positions[] = {columns.begin[0][axis], columns.begin[1][axis],
                                          columns.moment[axis]};
      for (LaneColumn<T>* const c : positions) put(*c, get(*c) - shift.of[axis]);
    }
  }
  /// Makes births later by the time of the path along which the cohorts are dragged.
  void age_dragged() {
    for (std::uint32_t k = 0; k < E::size; ++k) {
      const double path = motion.dragged.lane[first + k];
      if (!(path > 0.0)) continue;
      const double later = input.duration * (path / motion.moved.lane[first + k]);
      for (std::uint32_t j = 0; j < used; ++j) columns.birth[j].lane[first + k] += later;
    }
  }
  /// Returns the sum of share x |z|^2, weighted by LayMap::energy.
  V weighted_squares() const {
    V sum = spread;
    for (std::uint32_t j = 0; j < used; ++j) {
      const Cohort c = cohort(j);
      Vector z = end - c.position, weighted = z;
      if constexpr (axes == 2) weighted.of[1] = V(static_cast<T>(law.energy)) * z.of[1];
      sum = sum + c.share() * dot(z, weighted);
    }
    return sum;
  }
};

}  // namespace
}  // namespace bristle::detail
