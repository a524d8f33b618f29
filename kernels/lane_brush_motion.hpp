// The parts of a step of sixteen infinite brushes in lanes that are computed once for each contact
// (lane_brush.hpp): directions, loads and positions before its cohorts are visited, forces and energies
// after.
#pragma once

#include "ageing.hpp"
#include "core/lane_table.hpp"
#include "lane_motion.hpp"
#include "lanes.hpp"

namespace bristle::detail {
namespace {

/// Vector of the plane, or of the line with one axis; for one contact or for a vector of contacts.
template <class V, int axes>
struct Plane {
  V of[axes];
};
template <class V, int axes>
[[gnu::always_inline]] inline Plane<V, axes> operator+(Plane<V, axes> a, const Plane<V, axes>& b) {
  for (int axis = 0; axis < axes; ++axis) a.of[axis] = a.of[axis] + b.of[axis];
  return a;
}
template <class V, int axes>
[[gnu::always_inline]] inline Plane<V, axes> operator-(Plane<V, axes> a, const Plane<V, axes>& b) {
  for (int axis = 0; axis < axes; ++axis) a.of[axis] = a.of[axis] - b.of[axis];
  return a;
}
template <class V, int axes>
[[gnu::always_inline]] inline Plane<V, axes> operator*(V factor, Plane<V, axes> a) {
  for (int axis = 0; axis < axes; ++axis) a.of[axis] = factor * a.of[axis];
  return a;
}
template <class V, int axes>
[[gnu::always_inline]] inline V dot(const Plane<V, axes>& a, const Plane<V, axes>& b) {
  if constexpr (axes == 1)
    return a.of[0] * b.of[0];
  else
    return a.of[0] * b.of[0] + a.of[1] * b.of[1];
}
template <class Which, class V, int axes>
[[gnu::always_inline]] inline Plane<V, axes> select_lanes(Which which, Plane<V, axes> a,
                                                          const Plane<V, axes>& b) {
  for (int axis = 0; axis < axes; ++axis) a.of[axis] = select_lanes(which, a.of[axis], b.of[axis]);
  return a;
}

template <class T>
inline T survival_entry(const T* table, T index, bool) {
  return table[static_cast<std::int32_t>(index)];
}
#if defined(BRISTLE_KERNEL_ISA)
template <class T>
inline Lanes<T> survival_entry(const T* table, Lanes<T> index, bool few) {
  return few ? small_table_entry(table, index) : table_entry(table, index);
}
#endif
/// Returns S(x), the share of the snap lengths above x, for numbers or vectors.
template <class T, class V>
[[gnu::always_inline]] inline V survival(const BrushSurvival<T>& s, V x) {
  const V one(T(1));
  V cell = (least(most(x, V(s.low)), V(s.high)) - V(s.low)) * V(s.per_length);
  if (s.per_octave > T(0)) {
    const V y = cell + one;
    cell = (exponent_of<T>(y) + mantissa_of<T>(y) - one) * V(s.per_octave);
  }
  const V index = least(whole_part(cell), V(static_cast<T>(s.cells - 1)));
  const V f = cell - index;
  const bool few = s.cells == few_brush_cells;
  return survival_entry(s.c0, index, few) +
         f * (survival_entry(s.c1, index, few) + f * survival_entry(s.c2, index, few));
}

/// Position of a patch along an axis, in scaled lengths from its lane's origin, beyond which the origin moves
/// to it. So positions of cohorts keep their digits in single precision.
constexpr double farthest_position = 4.0;

/// Relative change of the load that waits until changes have added up to it. Shares in single precision would
/// round smaller changes away.
template <class T>
constexpr double least_load_change = sizeof(T) == 4 ? 0x1p-20 : 0.0;

/// Numbers of the sixteen contacts in a step.
template <class T, int axes>
struct BrushMotion {
  using D = Wide::V;

  Lane16<T> direction[axes];
  Lane16<T> length;          ///< path that is computed, scaled; 0 for a contact that rests or is not named
  Lane16<T> position[axes];  ///< position of the patch at the start, from the lane's origin
  Lane16<T> end[axes];       ///< position at the end of the path that is computed
  Lane16<T> shift[axes];     ///< distance by which the origin moves
  Lane16<T> per_length;      ///< age that bristles gain per length of path, in ageing times
  Lane16<T> load_ratio;  ///< the lower over the higher of the loads before and now; 0 where contact begins
  Lane16<T> rises, falls, leaves;  ///< 1 where the load rises, falls to a load above 0, or becomes 0
  Lane16<double> position_after[axes];
  Lane16<double> stiffness, stiffness_before;  ///< with the load of the step, and before
  Lane16<double> moved;                        ///< path of the step
  Lane16<double> dragged;  ///< part of the path that is not computed because the force is steady
  Lane16<double> named;
  bool any_shift = false, any_load = false, any_dragged = false, any_moves = false;

  BrushMotion(const BrushLaw<T>& law, const BrushColumns<T>& columns, const LaneInput& in) {
    const LaneState& state = *columns.state;
    const D none(0.0), one(1.0), longest(1e150), tiny(1e-300);
    constexpr double least_stiffness = 1e-290;
    named.fill(in.named);
    Lane16<double> computed, unit[axes], shifted[axes], ratio, rising, falling, leaving;
    auto shifts = none > none, changes = shifts, goes_on = shifts, moves = shifts;
    for (std::uint32_t i = 0; i < lane_count; i += Wide::size) {
      const auto is_named = Wide::get(named.lane + i) > none;
      // Load. The shares of the cohorts belong to the load of `stiffness`.
      const D before = Wide::get(state.stiffness.lane + i);
      const D asked =
          select_lanes(is_named, Wide::get_any(in.load + i) * D(law.stiffness_per_newton), before);
      const D least_change = before * D(least_load_change<T>);
      const auto empty = asked <= D(least_stiffness);
      const auto rise = (!empty) & (asked > before + least_change);
      const auto fall = (!empty) & (asked < before - least_change);
      const D now = select_lanes(empty, none, select_lanes(rise | fall, asked, before));
      Wide::put(stiffness.lane + i, now);
      Wide::put(stiffness_before.lane + i, before);
      Wide::put(ratio.lane + i, divide(least(now, before), most(most(now, before), tiny)));
      Wide::put(rising.lane + i, select_lanes(rise, one, none));
      Wide::put(falling.lane + i, select_lanes(fall, one, none));
      Wide::put(leaving.lane + i, select_lanes(empty & (before > none), one, none));
      changes = changes | rise | fall | (empty & (before > none));

      // Path, in isotropic axes. A contact without load does not move, as it has no bristles.
      const auto steps = is_named & (now > none);
      D d[2] = {none, none};
      const D dx = Wide::get_any(in.displacement[0] + i);
      const D dy = axes == 2 ? Wide::get_any(in.displacement[1] + i) : none;
      for (int axis = 0; axis < axes; ++axis) {
        const D x = D(law.to[axis][0]) * dx + D(law.to[axis][1]) * dy;
        d[axis] = select_lanes(steps, least(most(x, none - longest), longest), none);
      }
      const D path = axes == 1 ? magnitude(d[0]) : root(d[0] * d[0] + d[1] * d[1]);
      const D per_path = divide(one, most(path, tiny));
      const D short_path = least(path, computed_path(law, columns, in, i, path));
      const auto is_moving = path > none, is_long = path > short_path;
      moves = moves | is_moving;
      goes_on = goes_on | is_long;
      Wide::put(moved.lane + i, path);
      Wide::put(computed.lane + i, short_path);
      Wide::put(dragged.lane + i, path - short_path);
      for (int axis = 0; axis < axes; ++axis) {
        const D start = Wide::get(state.base[axis].lane + i);
        const D far = select_lanes(is_moving & (magnitude(start) > D(farthest_position)), start, none);
        const D e = axis == 0 ? select_lanes(is_moving, d[0] * per_path, one) : d[axis] * per_path;
        shifts = shifts | (magnitude(far) > none);
        Wide::put(shifted[axis].lane + i, far);
        Wide::put(position_after[axis].lane + i, start);
        Wide::put(unit[axis].lane + i, e);
      }
    }
    any_shift = any_lane(shifts);
    any_load = any_lane(changes);
    any_dragged = any_lane(goes_on);
    any_moves = any_lane(moves);
    length.convert(computed.lane);
    load_ratio.convert(ratio.lane);
    rises.convert(rising.lane);
    falls.convert(falling.lane);
    leaves.convert(leaving.lane);
    for (int axis = 0; axis < axes; ++axis) {
      direction[axis].convert(unit[axis].lane);
      shift[axis].convert(shifted[axis].lane);
      // Moves the origin by a number that T represents, so that the positions of cohorts move by as much.
      for (std::uint32_t i = 0; i < lane_count; ++i)
        position_after[axis].lane[i] -= static_cast<double>(shift[axis].lane[i]);
      position[axis].convert(position_after[axis].lane);
      for (std::uint32_t i = 0; i < lane_count; ++i)
        position_after[axis].lane[i] += computed.lane[i] * unit[axis].lane[i];
      end[axis].convert(position_after[axis].lane);
    }
    if (law.ageing_strength == 0.0) return;
    const double aged = least(in.duration * law.ageing_rate, oldest);
    for (std::uint32_t i = 0; i < lane_count; ++i)
      per_length.lane[i] = static_cast<T>(least(aged / most(moved.lane[i], 1e-300), oldest));
  }

 private:
  /// Returns the path that is computed at most: that after which a slide is steady, of bristles that have
  /// grown as long as the oldest ones, or as those that slide at the speed of the step.
  D computed_path(const BrushLaw<T>& law, const BrushColumns<T>& columns, const LaneInput& in,
                  std::uint32_t i, D path) const {
    const D forget(law.forget);
    if (law.ageing_strength == 0.0 || !any_lane(path > forget)) return forget;
    alignas(64) double age[Wide::size];
    Wide::put(age, D(2.0 * law.forget * in.duration * law.ageing_rate) * divide(D(1.0), path));
    for (std::uint32_t k = 0; k < Wide::size; ++k)
      for (std::uint32_t j = 0; j < *columns.used; ++j)
        if (columns.fresh[j].lane[i + k] > T(0))
          age[k] = most(age[k], (in.start[i + k] - columns.birth[j].lane[i + k]) * law.ageing_rate);
    const D oldest_age = least(most(Wide::get(age), D(0.0)), D(oldest));
    return forget * growth<double>(AgeingLaw<double, double>{law.ageing_strength, 0.0, law.ageing_form == 1},
                                   oldest_age);
  }
};

/// Sums of a step over the cohorts of each contact, which have shares of its load; lengths are scaled.
template <class T, int axes>
struct BrushSums {
  Lane16<T> integral[axes];  ///< integral of the deflection along the path that is computed
  Lane16<T> lost;            ///< twice the energy lost on this path, by the square of the deflection
  Lane16<T> load_lost;       ///< as `lost`, by the change of the load; shares are those of the higher load
  Lane16<T> snapped;         ///< bristles that snapped
  Lane16<T> late_snaps;      ///< those of them that snapped on the last part of a path that is dragged on
  Lane16<T> late_path;       ///< length of that part
  Lane16<T> squares[3];      ///< sum of share x |z|^2 weighted by LayMap::energy: before the change of load,
                             ///< after it, at the end; filled if that is not 1
};

/// Writes forces, energies and the state that the cohorts of a contact have in common.
template <class T, int axes, bool books>
void finish_brushes(const BrushLaw<T>& law, const BrushColumns<T>& columns, const LaneInput& in,
                    const LaneOutput& out, const BrushMotion<T, axes>& m, const BrushSums<T, axes>& sums) {
  using D = Wide::V;
  LaneState& state = *columns.state;
  const D none(0.0), half(0.5), tiny(1e-300), metres(law.metres_per_length), most_energy(1e300);
  Lane16<double> moment[axes], direction[axes], integral[axes];
  for (int axis = 0; axis < axes; ++axis) {
    moment[axis].convert(columns.moment[axis]->lane);
    direction[axis].convert(m.direction[axis].lane);
    if constexpr (books) integral[axis].convert(sums.integral[axis].lane);
  }
  Lane16<double> lost, load_lost, snapped, late_snaps, late_path, squares[3];
  const bool by_work = books && law.energy != 1.0;
  if constexpr (books) {
    lost.convert(sums.lost.lane);
    load_lost.convert(sums.load_lost.lane);
    snapped.convert(sums.snapped.lane);
    late_snaps.convert(sums.late_snaps.lane);
    late_path.convert(sums.late_path.lane);
    for (int k = 0; by_work && k < 3; ++k) squares[k].convert(sums.squares[k].lane);
  }
  for (std::uint32_t i = 0; i < lane_count; i += Wide::size) {
    const auto get = [i](const Lane16<double>& from) { return Wide::get(from.lane + i); };
    const D stiffness = get(m.stiffness), before = get(m.stiffness_before);
    const auto loaded = stiffness > none, is_named = get(m.named) > none;
    Plane<D, axes> bent, position;  // mean deflection at the end
    for (int axis = 0; axis < axes; ++axis) {
      position.of[axis] = get(m.position_after[axis]);
      bent.of[axis] = select_lanes(loaded, position.of[axis] - get(moment[axis]), none);
    }
    // Writes the force on the body, which points against the deflection. A straight contact gets +0, not -0.
    const auto write = [&](double* const(&to)[2], const Plane<D, axes>& z) {
      for (int row = 0; row < axes; ++row) {
        D force = D(law.from[row][0]) * (stiffness * z.of[0]);
        if constexpr (axes == 2) force = force + D(law.from[row][1]) * (stiffness * z.of[1]);
        Wide::put_any(to[row] + i, none - force);
      }
    };
    write(out.end, bent);
    if (out.stiffness != nullptr)
      Wide::put_any(out.stiffness + i, stiffness * D(1.0 / law.metres_per_length));
    if constexpr (books) {
      const D dragged = get(m.dragged), moved = get(m.moved);
      Plane<D, axes> mean = bent, e;
      for (int axis = 0; axis < axes; ++axis) {
        e.of[axis] = get(direction[axis]);
        const D all = get(integral[axis]) + dragged * bent.of[axis];
        mean.of[axis] = select_lanes(moved > none, divide(all, most(moved, tiny)), mean.of[axis]);
      }
      write(out.mean, mean);
      const D joules = half * stiffness * metres;
      D dissipated = joules * (get(lost) + (dragged + dragged) * dot(bent, e));
      D of_load = half * most(stiffness, before) * metres * get(load_lost);
      if (by_work) {
        if constexpr (axes == 2) e.of[1] = D(law.energy) * e.of[1];
        const D work = stiffness * metres * moved * dot(mean, e);
        of_load = half * before * metres * get(squares[0]) - joules * get(squares[1]);
        dissipated = work + joules * (get(squares[1]) - get(squares[2]));
      }
      Wide::put_any(out.dissipated + i, least(most(dissipated, none), most_energy));
      Wide::put_any(out.contact_loss + i, of_load);
      // Counts whole snaps, and keeps the remainder of one for the next step. Dragged path has as many snaps
      // per length as the late part of the computed path.
      const D rate = divide(get(late_snaps), most(get(late_path), tiny));
      const D per_share = stiffness * D(law.snaps_per_newton / law.stiffness_per_newton);
      const D snaps =
          least((get(snapped) + dragged * rate) * per_share + Wide::get(state.phase.lane + i), D(9e18));
      const D whole = whole_part(most(snaps, none));
      Wide::put_any(out.slid + i, whole);
      if (in.stores)
        Wide::put(state.phase.lane + i,
                  select_lanes(is_named, snaps - whole, Wide::get(state.phase.lane + i)));
    }
    if (!in.stores) continue;
    Wide::put(state.stiffness.lane + i, stiffness);
    for (int axis = 0; axis < axes; ++axis)
      Wide::put(state.base[axis].lane + i,
                select_lanes(is_named, select_lanes(loaded, position.of[axis], none),
                             Wide::get(state.base[axis].lane + i)));
  }
}

}  // namespace
}  // namespace bristle::detail
