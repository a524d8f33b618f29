// The last part of a step of sixteen contacts in lanes, computed once for each contact after its springs have
// moved (lane_slide.hpp): forces, energies and state.
#pragma once

#include "lane_soften.hpp"

namespace bristle::detail {
namespace {

/// Straightens the springs of a contact whose load has become zero: it begins its next touch as a new
/// contact.
template <class T>
void straighten_lane(const SlideLaw<T>& law, const SlideColumns<T>& columns, std::uint32_t lane) {
  for (std::uint32_t i = 0; i < law.springs; ++i) {
    columns.x[i].lane[lane] = T(0);
    if (columns.y != nullptr) columns.y[i].lane[lane] = T(0);
  }
  for (LaneColumn<double>& base : columns.state->base) base.lane[lane] = 0.0;
}

/// Writes forces and energies of the contacts, and the part of their state that the springs have in common.
template <class T, int axes, bool all>
void finish_lanes(const SlideLaw<T>& law, const SlideColumns<T>& columns, const LaneInput& in,
                  const LaneOutput& out, LaneMotion<T>& m, LanePieces& pieces, const LaneSums<T>& sums) {
  using D = Wide::V;
  LaneState& state = *columns.state;
  const D none(0.0), half(0.5), tiny(1e-300), whole(law.whole), metres(law.metres_per_length);
  Lane16<double> named;
  if (all || m.any_softens) m.widen_direction();
  if (pieces.any_cut) finish_pieces(law, m, sums, all, pieces);
  if (!m.all_named) named.convert(m.named.lane);
  auto without = none > none;  // contacts whose load has become zero
  for (std::uint32_t i = 0; i < lane_count; i += Wide::size) {
    const auto get = [i](const Lane16<double>& from) { return Wide::get(from.lane + i); };
    const auto sum = [&](LaneSum of) { return get(sums.of[of]); };
    const D load = get(m.of_load), k = get(m.stiffness), before = Wide::get(state.stiffness.lane + i);
    const D path = get(m.scaled_path), used = get(m.used);
    const auto loaded = load > none, is_named = m.all_named ? none == none : get(named) > none;
    const D x = sum(sum_force_x) + get(m.base_after[0]) * whole;
    const D y = axes == 2 ? sum(sum_force_y) + get(m.base_after[1]) * whole : none;
    // Writes the force on the body, which points against the deflection. A straight contact gets +0, not -0.
    const auto write = [&](double* const(&to)[2], D along, D across) {
      const auto rotated = [&](const double(&row)[2]) {
        return select_lanes(loaded, none - (D(row[0]) * along + D(row[1]) * across), none);
      };
      Wide::put_any(to[0] + i, rotated(law.from[0]));
      if constexpr (axes == 2) Wide::put_any(to[1] + i, rotated(law.from[1]));
    };
    write(out.end, x, y);

    // Softens a contact that is stiffer than its load because the load fell. Its forces stay, so its stored
    // energy grows, by the least energy that sliding dissipates. If the path is longer than the one that was
    // computed, every spring slides along the motion.
    D soft = load, beyond = none;
    const auto cut = pieces.any_cut ? get(pieces.cut) > none : none > none;
    if (all || m.any_softens) {
      const D more = most(path - D(longest_slide), none);
      if (any_lane(more > none))
        beyond = divide(more * (x * get(m.direction[0]) + y * get(m.direction[1])), most(used, tiny));
    }
    if (m.any_softens) {
      const D squares = sum(sum_squares_end), freed = D(law.least_loss) * (sum(sum_work) + beyond);
      const D left = divide(squares, most(squares + freed + freed, tiny));
      soft = select_lanes((k > load) & (freed > none) & (squares > none), k * left, k);
      if (pieces.any_cut) soft = select_lanes(cut, get(pieces.stiffness), soft);
      soft = select_lanes(soft <= load * D(1.0 + 1e-9), load, soft);
      soft = select_lanes(loaded, soft, none);
    }
    if (out.stiffness != nullptr) Wide::put_any(out.stiffness + i, soft * D(1.0 / law.metres_per_length));
    if constexpr (all) {
      const D per_path = select_lanes(path > none, divide(used, most(path, tiny)), none);
      // Takes the middle of the forces at start and end as the mean force while all springs stick, which
      // avoids the rounding of sums in single precision.
      const auto sticks = sum(sum_slid) == none;
      const auto mean_of = [&](D end, const Lane16<double>& gain, LaneSum missing) {
        return end - select_lanes(sticks, half * get(gain) * whole, sum(missing) * per_path);
      };
      D mean_x = mean_of(x, m.gain[0], sum_missing_x);
      D mean_y = axes == 2 ? mean_of(y, m.gain[1], sum_missing_y) : none;
      if (pieces.any_cut) {
        mean_x = select_lanes(cut, get(pieces.mean[0]), mean_x);
        mean_y = select_lanes(cut, get(pieces.mean[1]), mean_y);
      }
      write(out.mean, mean_x, mean_y);
      // Computes energies as half the squared force over the stiffness. Forces in scaled lengths times the
      // stiffness `used` are newtons.
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
    if (!m.creeps) continue;
    const D phase = Wide::get(state.phase.lane + i), next = phase + D(0.6180339887498949);
    const D within = select_lanes(next < D(1.0), next, next - D(1.0));
    keep(state.phase, select_lanes((path > none) & (path < D(creep)), within, phase));
  }
  if (!in.stores || !any_lane(without)) return;
  for (std::uint32_t i = 0; i < lane_count; ++i)
    if ((in.named >> i & 1u) != 0 && m.of_load.lane[i] == 0.0) straighten_lane(law, columns, i);
}

}  // namespace
}  // namespace bristle::detail
