// The first part of a step of sixteen contacts in lanes, computed once for each contact before its springs
// move (lane_slide.hpp): checks, directions, scales and how `base` changes.
#pragma once

#include "ageing.hpp"
#include "core/lane_table.hpp"
#include "lanes.hpp"

namespace bristle::detail {
namespace {

/// Longest step, in scaled lengths, whose path is computed in full. A longer one is shortened, because it
/// ends in the same state: every spring lies along the motion.
constexpr double longest_slide = 1048576.0;  // 2^20

/// Size of `base` along an axis, in scaled lengths, above which it is added to the stored force of every
/// spring and set to 0. `base` is the force that sticking springs have gained since their forces were stored.
constexpr double farthest_base = 0.25;

/// Path per step, in scaled lengths, below which slow sliding would be lost in the rounding of stored forces;
/// their rounding is then spread evenly.
constexpr double creep = 0x1p-6;

using Wide = Engine<double>;

/// One number for each of the sixteen contacts, needed only during one step.
template <class Number>
struct alignas(64) Lane16 {
  Number lane[lane_count];

  void fill(std::uint32_t bits) {
    for (std::uint32_t i = 0; i < lane_count; ++i) lane[i] = static_cast<Number>(bits >> i & 1u);
  }
  template <class From>
  void convert(const From (&from)[lane_count]) {
    for (std::uint32_t i = 0; i < lane_count; ++i) lane[i] = static_cast<Number>(from[i]);
  }
};

/// Numbers of the sixteen contacts in a step. Columns of T are read in the loop over the springs.
template <class T>
struct LaneMotion {
  using D = Wide::V;
  using V = typename Engine<T>::V;

  Lane16<T> ex, ey, length;
  Lane16<T> unit, per_unit;     ///< force of one scaled length in this step, N, and one over it
  Lane16<T> base[2];            ///< `base` before the step, scaled
  Lane16<T> taken[2];           ///< force that all springs take over from `base`, N
  Lane16<T> left[2];            ///< `base` after the step, N
  Lane16<T> phase, named;       ///< filled if `creeps`; unless `all_named`
  Lane16<T> per_length;         ///< age that a spring gains per length of path, in ageing times
  Lane16<double> direction[2];  ///< filled by widen_direction()
  Lane16<double> moved;         ///< displacement in scaled lengths
  Lane16<double> scaled_path;   ///< as `moved`, longer for a contact that is stiffer than its load
  Lane16<double> gain[2];       ///< force that a spring that sticks gains in the step, N
  Lane16<double> base_after[2];
  Lane16<double> stiffness;  ///< stiffness before sliding softens it, N per scaled length
  Lane16<double> of_load;    ///< stiffness that belongs to the load; 0 = no contact
  Lane16<double> used;       ///< as `unit`
  bool any_softens = false, creeps = false, all_named = true;

  LaneMotion(const SlideLaw<T>& law, const LaneState& state, const LaneInput& in, int axes) {
    constexpr double least_stiffness = sizeof(T) == 4 ? 1e-36 : 1e-290;
    const D none(0.0), longest(1e150);  // longest displacement whose square stays finite
    Lane16<double> x, y, scale;
    auto softer = none > none;
    for (std::uint32_t i = 0; i < lane_count; i += Wide::size) {
      const D dx = Wide::get_any(in.displacement[0] + i);
      const D dy = axes == 2 ? Wide::get_any(in.displacement[1] + i) : none;
      const D along = least(most(D(law.to[0][0]) * dx + D(law.to[0][1]) * dy, none - longest), longest);
      const D across = least(most(D(law.to[1][0]) * dx + D(law.to[1][1]) * dy, none - longest), longest);
      // Computes the direction in T. A power of two first brings the displacement near 1, so that its square
      // neither overflows nor vanishes.
      const D exponent = exponent_of<double>(most(most(magnitude(along), magnitude(across)), D(1e-300)));
      const D down = power_of_two<double>(none - exponent);
      Wide::put(x.lane + i, along * down);
      Wide::put(y.lane + i, across * down);
      Wide::put(scale.lane + i, power_of_two<double>(exponent));
      const D asked = Wide::get_any(in.load + i) * D(law.stiffness_per_newton);
      const D before = Wide::get(state.stiffness.lane + i);
      const D load = select_lanes(asked > D(least_stiffness), asked, none);
      const D stiff = most(load, before);
      softer = softer | (stiff > load);
      Wide::put(of_load.lane + i, load);
      Wide::put(stiffness.lane + i, stiff);
      Wide::put(used.lane + i, select_lanes(load > none, load, before));
      Wide::put(gain[0].lane + i, stiff * along);
      Wide::put(gain[1].lane + i, stiff * across);
    }
    any_softens = any_lane(softer);
    ex.convert(x.lane);
    ey.convert(y.lane);
    unit.convert(used.lane);
    base[0].convert(state.base[0].lane);
    base[1].convert(state.base[1].lane);
    using E = Engine<T>;
    for (std::uint32_t i = 0; i < lane_count; i += E::size) {
      const V a = E::get(ex.lane + i), b = E::get(ey.lane + i), zero(T(0)), one(T(1));
      const V h = root(a * a + b * b), per = divide(one, most(h, V(T(1e-30))));
      E::put(length.lane + i, h);
      E::put(ex.lane + i, select_lanes(h > zero, a * per, one));
      E::put(ey.lane + i, b * per);
      const V force = E::get(unit.lane + i);
      const V inverse = select_lanes(force > zero, divide(one, most(force, V(T(least_stiffness)))), zero);
      E::put(per_unit.lane + i, inverse);
      for (Lane16<T>& each : base) E::put(each.lane + i, E::get(each.lane + i) * inverse);
    }
    moved.convert(length.lane);
    for (std::uint32_t i = 0; i < lane_count; i += Wide::size) {
      const D h = Wide::get(moved.lane + i) * Wide::get(scale.lane + i), force = Wide::get(used.lane + i);
      D longer = h;
      if (any_softens) longer = h * divide(Wide::get(stiffness.lane + i), most(force, D(least_stiffness)));
      Wide::put(moved.lane + i, h);
      Wide::put(scaled_path.lane + i, select_lanes(force > none, longer, none));
    }
    all_named = in.named == (1u << lane_count) - 1;
    if (!all_named) named.fill(in.named);
    update_base(state);
    if (law.ageing_strength == 0.0) return;
    for (std::uint32_t i = 0; i < lane_count; ++i) {
      const double aged = least(in.duration * law.ageing_rate, oldest);
      const double path = scaled_path.lane[i];
      per_length.lane[i] = static_cast<T>(path > 0.0 ? least(aged / most(path, 1e-300), oldest) : 0.0);
    }
  }

  /// Computes the columns that depend on `scaled_path` and `gain`. Leaves out `per_length`: springs age alike
  /// in all trials of a step (lane_soften.hpp), so that the pieces of its path fit together.
  void update_base(const LaneState& state) {
    const D none(0.0);
    Lane16<double> short_path, shift[2];
    auto slow = none > none;
    for (std::uint32_t i = 0; i < lane_count; i += Wide::size) {
      const D path = Wide::get(scaled_path.lane + i), farthest = D(farthest_base) * Wide::get(used.lane + i);
      const D x = Wide::get(state.base[0].lane + i) + Wide::get(gain[0].lane + i);
      const D y = Wide::get(state.base[1].lane + i) + Wide::get(gain[1].lane + i);
      const auto far = (magnitude(x) > farthest) | (magnitude(y) > farthest);
      slow = slow | ((path > none) & (path < D(creep)));
      Wide::put(short_path.lane + i, least(path, D(longest_slide)));
      Wide::put(shift[0].lane + i, select_lanes(far, x, none));
      Wide::put(shift[1].lane + i, select_lanes(far, y, none));
      Wide::put(base_after[0].lane + i, select_lanes(far, none, x));
      Wide::put(base_after[1].lane + i, select_lanes(far, none, y));
    }
    length.convert(short_path.lane);
    for (int axis = 0; axis < 2; ++axis) {
      taken[axis].convert(shift[axis].lane);
      left[axis].convert(base_after[axis].lane);
    }
    creeps = sizeof(T) == 4 && any_lane(slow);
    if (creeps)
      for (std::uint32_t i = 0; i < lane_count; ++i)
        phase.lane[i] = static_cast<T>(state.phase.lane[i] - 0.5);
  }
  void widen_direction() {
    direction[0].convert(ex.lane);
    direction[1].convert(ey.lane);
  }
};

/// Indices of the sums over the springs of a contact, each of weight x a quantity, in scaled lengths except
/// the forces. A step that is asked only for force and stiffness fills those before lane_sums_of_end.
enum LaneSum : std::uint32_t {
  sum_force_x,  ///< stored forces after the step, N: a force is what the springs store, to the last bit
  sum_force_y,
  sum_work,         ///< work done by sliding, drops not included
  sum_squares_end,  ///< squared deflection at the end, after the change of load and before it
  lane_sums_of_end,
  sum_squares_start = lane_sums_of_end,
  sum_squares_before,
  sum_missing_x,  ///< integral of the deflection at the end less the present one along the path of the step
  sum_missing_y,
  sum_lost,  ///< energy that sliding dissipates
  sum_slid,  ///< number of springs that slid
  lane_sums
};
template <class T>
struct LaneSums {
  Lane16<double> of[lane_sums];

  double at(LaneSum sum, std::uint32_t lane) const { return of[sum].lane[lane]; }
  /// Returns the force of all springs of a contact along an isotropic axis, N.
  double force(const SlideLaw<T>& law, const LaneMotion<T>& m, int axis, std::uint32_t lane) const {
    return at(axis == 0 ? sum_force_x : sum_force_y, lane) + m.base_after[axis].lane[lane] * law.whole;
  }
  /// Returns the integral of the deflection over the path `scaled_path` of the step, from which the mean
  /// force follows.
  double integral(const SlideLaw<T>& law, const LaneMotion<T>& m, int axis, std::uint32_t lane) const {
    return force(law, m, axis, lane) / m.used.lane[lane] * m.scaled_path.lane[lane] -
           at(axis == 0 ? sum_missing_x : sum_missing_y, lane);
  }
};

/// Classifies the motions of a step before it runs, so that the step can skip what none of them needs.
inline LaneChecks check_lanes(const LaneInput& in, const double* const (&velocity)[2],
                              const LaneColumn<double>& loads, double light, double highest_load) {
  using D = Wide::V;
  const D none(0.0);
  auto bad = none > none, still = bad, moves = bad, above = bad;
  for (std::uint32_t i = 0; i < lane_count; i += Wide::size) {
    const D x = Wide::get_any(in.displacement[0] + i), y = Wide::get_any(in.displacement[1] + i);
    const D load = Wide::get_any(in.load + i);
    // Computes a number that is 0 for a valid motion: x - x is NaN unless x is finite, and the last term is 0
    // for loads from 0 to the highest.
    D odd = (x - x) + (y - y) + (load - least(most(load, none), D(highest_load)));
    for (const double* column : velocity)
      if (column != nullptr) odd = odd + (Wide::get_any(column + i) - Wide::get_any(column + i));
    bad = bad | !(odd == none);
    const auto rests = magnitude(x) + magnitude(y) + magnitude(load - Wide::get(loads.lane + i)) == none;
    still = still | rests;
    moves = moves | !rests;
    above = above | (load > D(light));
  }
  return {any_lane(bad), any_lane(still), !any_lane(moves), any_lane(above)};
}

}  // namespace
}  // namespace bristle::detail
