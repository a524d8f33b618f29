// Parts of a step of sixteen contacts in lanes that are computed once for each contact. Before its springs
// (lane_slide.hpp): directions, scales and the place of `base`. After them: forces, energies and state. In
// between: the path (`way`) of a contact that sliding softens.
#pragma once

#include "ageing.hpp"
#include "core/lane_table.hpp"
#include "engine.hpp"

namespace bristle::detail {
namespace {

/// Longest step, scaled, that is computed directly. After it every spring lies along the motion.
constexpr double longest_slide = 1048576.0;  // 2^20

/// Part of `base` along an axis, in scaled lengths, above which all springs take it over.
constexpr double farthest_base = 0.25;

/// Path per step, scaled, below which the rounding of stored forces is spread.
constexpr double creep = 0x1p-6;

using Wide = Engine<double>;

/// One number for each contact, within a step.
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

/// Numbers of the contacts in a step. Columns of T are read by the springs.
template <class T>
struct LaneMotion {
  using D = Wide::V;
  using V = typename Engine<T>::V;

  Lane16<T> ex, ey, length;
  Lane16<T> unit, per_unit;     ///< force of one scaled length in this step, N, and one over it
  Lane16<T> base[2];            ///< before the step, scaled
  Lane16<T> taken[2];           ///< force that all springs take over from `base`, N
  Lane16<T> left[2];            ///< `base` after the step, N
  Lane16<T> phase, named;       ///< filled if `creeps`, and unless `all_named`
  Lane16<T> per_length;         ///< age that a spring gains per length of path, in ageing times
  Lane16<double> direction[2];  ///< filled by widen_direction()
  Lane16<double> moved;         ///< displacement in scaled lengths
  Lane16<double> way;           ///< as `moved`, longer for a contact that is stiffer than its load
  Lane16<double> gain[2];       ///< force that a spring that sticks gains in the step, N
  Lane16<double> base_after[2];
  Lane16<double> stiffness;  ///< before sliding softens it, N per scaled length
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
      // The direction is found in T, from a displacement that a power of two has brought near 1.
      const D exponent = exponent_of(most(most(magnitude(along), magnitude(across)), D(1e-300)));
      const D down = power_of_two(none - exponent);
      Wide::put(x.lane + i, along * down);
      Wide::put(y.lane + i, across * down);
      Wide::put(scale.lane + i, power_of_two(exponent));
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
      Wide::put(way.lane + i, select_lanes(force > none, longer, none));
    }
    all_named = in.named == (1u << lane_count) - 1;
    if (!all_named) named.fill(in.named);
    place_base(law, state, in);
  }

  /// Finds what follows from `way` and `gain`.
  void place_base(const SlideLaw<T>& law, const LaneState& state, const LaneInput& in) {
    const D none(0.0);
    Lane16<double> short_way, shift[2];
    auto slow = none > none;
    for (std::uint32_t i = 0; i < lane_count; i += Wide::size) {
      const D path = Wide::get(way.lane + i), bound = D(farthest_base) * Wide::get(used.lane + i);
      const D x = Wide::get(state.base[0].lane + i) + Wide::get(gain[0].lane + i);
      const D y = Wide::get(state.base[1].lane + i) + Wide::get(gain[1].lane + i);
      const auto far = (magnitude(x) > bound) | (magnitude(y) > bound);
      slow = slow | ((path > none) & (path < D(creep)));
      Wide::put(short_way.lane + i, least(path, D(longest_slide)));
      Wide::put(shift[0].lane + i, select_lanes(far, x, none));
      Wide::put(shift[1].lane + i, select_lanes(far, y, none));
      Wide::put(base_after[0].lane + i, select_lanes(far, none, x));
      Wide::put(base_after[1].lane + i, select_lanes(far, none, y));
    }
    length.convert(short_way.lane);
    for (int axis = 0; axis < 2; ++axis) {
      taken[axis].convert(shift[axis].lane);
      left[axis].convert(base_after[axis].lane);
    }
    creeps = sizeof(T) == 4 && any_lane(slow);
    if (creeps)
      for (std::uint32_t i = 0; i < lane_count; ++i)
        phase.lane[i] = static_cast<T>(state.phase.lane[i] - 0.5);
    if (law.ageing_strength == 0.0) return;
    for (std::uint32_t i = 0; i < lane_count; ++i) {
      const double aged = least(in.duration * law.ageing_rate, oldest);
      const double path = way.lane[i];
      per_length.lane[i] = static_cast<T>(path > 0.0 ? least(aged / most(path, 1e-300), oldest) : 0.0);
    }
  }
  void widen_direction() {
    direction[0].convert(ex.lane);
    direction[1].convert(ey.lane);
  }
};

/// Sums of weight x a quantity over the springs of a contact, in scaled lengths but for the forces. Steps
/// that ask for force and stiffness alone fill only those before lane_sums_of_end.
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
  Lane16<T> of[lane_sums];

  double at(LaneSum sum, std::uint32_t lane) const { return static_cast<double>(of[sum].lane[lane]); }
  /// Returns the force of a contact's springs along an isotropic axis, N.
  double force(const SlideLaw<T>& law, const LaneMotion<T>& m, int axis, std::uint32_t lane) const {
    return at(axis == 0 ? sum_force_x : sum_force_y, lane) + m.base_after[axis].lane[lane] * law.whole;
  }
  /// Returns the integral of the deflection over the way of the step.
  double integral(const SlideLaw<T>& law, const LaneMotion<T>& m, int axis, std::uint32_t lane) const {
    return force(law, m, axis, lane) / m.used.lane[lane] * m.way.lane[lane] -
           at(axis == 0 ? sum_missing_x : sum_missing_y, lane);
  }
};

/// Path (`way`) of a contact that sliding softens, at the start of the last piece of a step. `ease` is the
/// stiffness that belongs to the load over the contact's stiffness. It grows towards 1 as sliding dissipates
/// (core/MODEL.md, section 30), so the path exceeds the displacement by less and less. Springs depend on the
/// path alone.
struct LanePiece {
  bool cut = false;    ///< whether the step has pieces; if not, the ease at its start holds throughout
  double way = 0.0;    ///< path from the start of the step, scaled lengths
  double moved = 0.0;  ///< displacement so far, scaled lengths
  double ease = 1.0;
  double squares = 0.0, work = 0.0;  ///< sum_squares_end, sum_work
  double integral[2] = {0.0, 0.0};   ///< LaneSums::integral
  double impulse[2] = {0.0, 0.0};    ///< integral of the deflection over the displacement

  /// Returns the ease at the end of a piece that conserves energy: half the change of ease x `squares` equals
  /// the mean ease x the least energy that sliding dissipates.
  double ease_after(double squares_after, double least_lost) const {
    const double mean = 0.5 * (squares + squares_after);
    if (!(least_lost > 0.0)) return ease;
    return mean > least_lost ? least(ease * ((mean + least_lost) / (mean - least_lost)), 1.0) : 1.0;
  }
};

/// The contacts that sliding softens, in pieces or in one.
struct LanePieces {
  LanePiece of[lane_count];
  bool any_cut = false;
  // Of contacts with pieces, at the end of the step:
  Lane16<double> cut;        ///< 1 for a contact with pieces, else 0
  Lane16<double> stiffness;  ///< N per scaled length
  Lane16<double> mean[2];    ///< mean force of the springs, N
};

/// Length of a piece of way, scaled, and most pieces of a step before the rest is one piece.
constexpr double soft_piece = 0.125;
constexpr int most_soft_pieces = 128;
/// Path x (1 - ease) up to which a step is one piece. The path is then too long by less than this length.
constexpr double least_cut = 0x1p-7;

/// Makes the springs of a contact that has lost its load straight.
template <class T>
void straighten_lane(const SlideLaw<T>& law, const SlideColumns<T>& columns, std::uint32_t lane) {
  for (std::uint32_t i = 0; i < law.springs; ++i) {
    columns.x[i].lane[lane] = T(0);
    if (columns.y != nullptr) columns.y[i].lane[lane] = T(0);
  }
  for (LaneColumn<double>& base : columns.state->base) base.lane[lane] = 0.0;
}

/// Finds the stiffness and the mean force of contacts with pieces from their last piece.
template <class T>
void finish_pieces(const SlideLaw<T>& law, const LaneMotion<T>& m, const LaneSums<T>& sums, bool all,
                   LanePieces& pieces) {
  for (std::uint32_t i = 0; i < lane_count; ++i) {
    const LanePiece& last = pieces.of[i];
    pieces.cut.lane[i] = last.cut ? 1.0 : 0.0;
    if (!last.cut) continue;
    const double way = m.way.lane[i], used = m.used.lane[i], squares = sums.at(sum_squares_end, i);
    const double force[2] = {sums.force(law, m, 0, i), sums.force(law, m, 1, i)};
    const double beyond = most(way - longest_slide, 0.0) / used *
                          (force[0] * m.direction[0].lane[i] + force[1] * m.direction[1].lane[i]);
    const double freed = law.least_loss * (sums.at(sum_work, i) + beyond - last.work);
    // Takes the mean ease of the last piece from its displacement, and the ease at its end from the energy.
    const double mean_ease = (m.moved.lane[i] - last.moved) / (way - last.way);
    const double energy = last.squares * last.ease + mean_ease * (squares - last.squares + 2.0 * freed);
    pieces.stiffness.lane[i] = used / (squares > 0.0 ? least(energy / squares, 1.0) : last.ease);
    for (int axis = 0; axis < 2 && all; ++axis) {
      const double more = sums.integral(law, m, axis, i) - last.integral[axis];
      pieces.mean[axis].lane[i] = (last.impulse[axis] + mean_ease * more) / m.moved.lane[i] * used;
    }
  }
}

/// Writes forces and energies of the contacts, and the state that belongs to no single spring.
template <class T, int axes, bool all>
void finish_lanes(const SlideLaw<T>& law, const SlideColumns<T>& columns, const LaneInput& in,
                  const LaneOutput& out, LaneMotion<T>& m, LanePieces& pieces, const LaneSums<T>& sums) {
  using D = Wide::V;
  LaneState& state = *columns.state;
  const D none(0.0), half(0.5), tiny(1e-300), whole(law.whole), metres(law.metres_per_length);
  const std::uint32_t count = all ? +lane_sums : m.any_softens ? +lane_sums_of_end : 2;
  Lane16<double> wide[lane_sums], named;
  for (std::uint32_t s = 0; s < count; ++s) wide[s].convert(sums.of[s].lane);
  if (all || m.any_softens) m.widen_direction();
  if (pieces.any_cut) finish_pieces(law, m, sums, all, pieces);
  if (!m.all_named) named.convert(m.named.lane);
  auto without = none > none;  // contacts that have lost their load
  for (std::uint32_t i = 0; i < lane_count; i += Wide::size) {
    const auto get = [i](const Lane16<double>& from) { return Wide::get(from.lane + i); };
    const auto sum = [&](LaneSum of) { return get(wide[of]); };
    const D load = get(m.of_load), k = get(m.stiffness), before = Wide::get(state.stiffness.lane + i);
    const D way = get(m.way), used = get(m.used);
    const auto loaded = load > none, is_named = m.all_named ? none == none : get(named) > none;
    const D x = sum(sum_force_x) + get(m.base_after[0]) * whole;
    const D y = axes == 2 ? sum(sum_force_y) + get(m.base_after[1]) * whole : none;
    // Writes a force on the body; +0 for a straight contact.
    const auto write = [&](double* const(&to)[2], D along, D across) {
      const auto turned = [&](const double(&row)[2]) {
        return select_lanes(loaded, none - (D(row[0]) * along + D(row[1]) * across), none);
      };
      Wide::put_any(to[0] + i, turned(law.from[0]));
      if constexpr (axes == 2) Wide::put_any(to[1] + i, turned(law.from[1]));
    };
    write(out.end, x, y);

    // Softens a contact that is stiffer than its load, at unchanged forces, by the least energy that sliding
    // dissipates. On the path beyond the length that was computed every spring slides along the motion.
    D soft = load, beyond = none;
    const auto cut = pieces.any_cut ? get(pieces.cut) > none : none > none;
    if (all || m.any_softens) {
      const D more = most(way - D(longest_slide), none);
      if (any_lane(more > none))
        beyond = divide(more * (x * get(m.direction[0]) + y * get(m.direction[1])), most(used, tiny));
    }
    if (m.any_softens) {
      const D squares = sum(sum_squares_end), freed = D(law.least_loss) * (sum(sum_work) + beyond);
      const D rest = divide(squares, most(squares + freed + freed, tiny));
      soft = select_lanes((k > load) & (freed > none) & (squares > none), k * rest, k);
      if (pieces.any_cut) soft = select_lanes(cut, get(pieces.stiffness), soft);
      soft = select_lanes(soft <= load * D(1.0 + 1e-9), load, soft);
      soft = select_lanes(loaded, soft, none);
    }
    if (out.stiffness != nullptr) Wide::put_any(out.stiffness + i, soft * D(1.0 / law.metres_per_length));
    if constexpr (all) {
      const D per_way = select_lanes(way > none, divide(used, most(way, tiny)), none);
      D mean_x = x - sum(sum_missing_x) * per_way;
      D mean_y = axes == 2 ? y - sum(sum_missing_y) * per_way : none;
      if (pieces.any_cut) {
        mean_x = select_lanes(cut, get(pieces.mean[0]), mean_x);
        mean_y = select_lanes(cut, get(pieces.mean[1]), mean_y);
      }
      write(out.mean, mean_x, mean_y);
      // Computes energies as half a square times force per length: scaled forces of `used` over a stiffness.
      const D joules = used * used * metres, squares = half * sum(sum_squares_end);
      const auto over = [&](D stiff) {
        return select_lanes(stiff > none, divide(joules, most(stiff, tiny)), none);
      };
      const D of_k = over(k), stored = squares * over(soft);
      const D start = select_lanes(loaded, half * sum(sum_squares_start) * of_k, none);
      Wide::put_any(out.contact_loss + i, half * sum(sum_squares_before) * over(before) - start);
      D dissipated = (sum(sum_lost) + beyond) * of_k - (stored - squares * of_k);
      const auto by_work = law.energy != 1.0 || law.lean != 0.0 ? none == none : cut;
      if (any_lane(by_work)) {
        const D work = mean_x * get(m.direction[0]) + D(law.energy) * mean_y * get(m.direction[1]);
        dissipated = select_lanes(by_work, work * get(m.moved) * metres + start - stored, dissipated);
      }
      dissipated = least(most(dissipated, none), D(1e300));
      Wide::put_any(out.dissipated + i, select_lanes(loaded, dissipated, none));
      Wide::put_any(out.slid + i, sum(sum_slid));
    }
    if (!in.stores) continue;
    without = without | (is_named & !loaded);
    const auto keep = [&](LaneColumn<double>& to, D value) {
      Wide::put(to.lane + i, select_lanes(is_named, value, Wide::get(to.lane + i)));
    };
    keep(state.stiffness, soft);
    for (int axis = 0; axis < axes; ++axis) keep(state.base[axis], get(m.base_after[axis]));
    const D phase = Wide::get(state.phase.lane + i), next = phase + D(0.6180339887498949);
    const D within = select_lanes(next < D(1.0), next, next - D(1.0));
    keep(state.phase, select_lanes(way > none, within, phase));
  }
  if (!in.stores || !any_lane(without)) return;
  for (std::uint32_t i = 0; i < lane_count; ++i)
    if ((in.named >> i & 1u) != 0 && m.of_load.lane[i] == 0.0) straighten_lane(law, columns, i);
}

/// What a step should know of its motions before it runs.
inline LaneChecks check_lanes(const LaneInput& in, const double* const (&velocity)[2],
                              const LaneColumn<double>& loads, const LaneColumn<double>& light,
                              double highest_load) {
  using D = Wide::V;
  const D none(0.0);
  auto bad = none > none, still = bad, moves = bad, above = bad;
  for (std::uint32_t i = 0; i < lane_count; i += Wide::size) {
    const D x = Wide::get_any(in.displacement[0] + i), y = Wide::get_any(in.displacement[1] + i);
    const D load = Wide::get_any(in.load + i);
    // A number that is 0 for a good motion: a difference of a number from itself is NaN if it is not finite.
    D odd = (x - x) + (y - y) + (load - least(most(load, none), D(highest_load)));
    for (const double* column : velocity)
      if (column != nullptr) odd = odd + (Wide::get_any(column + i) - Wide::get_any(column + i));
    bad = bad | !(odd == none);
    const auto rests = magnitude(x) + magnitude(y) + magnitude(load - Wide::get(loads.lane + i)) == none;
    still = still | rests;
    moves = moves | !rests;
    above = above | (load > Wide::get(light.lane + i));
  }
  return {any_lane(bad), any_lane(still), !any_lane(moves), any_lane(above)};
}

}  // namespace
}  // namespace bristle::detail
