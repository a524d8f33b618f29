// Beds: a step of all bristles, and their places under a load or after rolling (core/beds/BEDS.md). One text
// for vectors and for numbers: E::V is either.
#pragma once

#include "engine.hpp"
#include "slide.hpp"

#include "core/bed_table.hpp"

namespace bristle::detail {
namespace {

using BedEngine = Engine<float>;

/// The columns of a bed at one vector of its bristles.
template <class E>
struct BedAt {
  float* columns;
  std::uint32_t count, first;
  using V = typename E::V;
  V operator[](BedColumn c) const { return E::get(columns + c * count + first); }
  void put(BedColumn c, V x) const { E::put(columns + c * count + first, x); }
};

template <class E, std::uint32_t variant>
void step_bed(const BedStep& step, float* columns, BedSums& sums) {
  using V = typename E::V;
  constexpr bool spins = (variant & bed_spins) != 0;
  constexpr bool carried = (variant & bed_carried) != 0;
  constexpr bool all = (variant & bed_all_outputs) != 0;
  constexpr bool drops = (variant & bed_drops) != 0;
  const V none(0.0f);
  const V one(1.0f);
  const V smallest(1e-30f);
  const V limit_of_pressure(step.limit_of_pressure);
  const auto rebase = V(step.rebase ? 1.0f : 0.0f) > none;
  typename E::Sum force_x, force_y, torque, slipping;
  typename E::Sum mean_x, mean_y, mean_torque, energy_x, energy_y, start_energy, dissipated;
  typename E::Sum stuck, stuck_x, stuck_y, stuck_xx, stuck_yy;

  for (std::uint32_t block = 0; block < step.count; block += lane_count)
    for (std::uint32_t part = 0; part < lane_count / E::size; ++part) {
      const BedAt<E> at{columns, step.count, block + part * E::size};
      const V k = at[bed_stiffness];
      const V limit = at[bed_pressure] * limit_of_pressure;
      V x = none, y = none, moved = one, kept = one;
      if (spins || all || step.torque) {
        x = at[bed_x];
        y = at[bed_y];
      }
      if constexpr (carried) {
        moved = at[bed_moved];
        kept = at[bed_kept];
      }

      // Deflection, and the motion of the root.
      const V tip_x = at[bed_tip_x];
      const V tip_y = at[bed_tip_y];
      V zx = V(step.root[0]) - tip_x;
      V zy = V(step.root[1]) - tip_y;
      V dx(step.motion[0]), dy(step.motion[1]);
      V anchor_x(step.anchor[0]), anchor_y(step.anchor[1]);
      if constexpr (spins) {
        zx = (V(step.root[0]) - V(step.root[2]) * y) - tip_x;
        zy = (V(step.root[1]) + V(step.root[3]) * x) - tip_y;
        anchor_x = anchor_x - V(step.anchor[2]) * y;
        anchor_y = anchor_y + V(step.anchor[3]) * x;
        V middle_x = x, middle_y = y;
        if constexpr (carried) {
          middle_x = x + moved * V(step.half_rolled[0]);
          middle_y = y + moved * V(step.half_rolled[1]);
        }
        dx = dx - V(step.motion[2]) * middle_y;
        dy = dy + V(step.motion[3]) * middle_x;
      }
      V hold = limit;
      if constexpr (drops) {
        const auto slid = at[bed_slid] * kept > none;
        hold = select_lanes(slid, limit, limit * V(step.hold_over_limit));
      }
      if constexpr (carried) {
        dx = dx * moved;
        dy = dy * moved;
        zx = zx * kept;
        zy = zy * kept;
      }
      const V z2 = zx * zx + zy * zy;
      if constexpr (carried && all) start_energy.add(part, k * z2);
      // A limit that falls within the step counts by its mean for the slide; the deflection beyond the new
      // limit is dropped last.
      V reach = hold;
      V slide_limit = limit;
      if constexpr (carried) {
        const auto falls = z2 > hold * hold;
        if (any_lane(falls)) {
          reach = select_lanes(falls, root(z2), hold);
          slide_limit = select_lanes(falls, V(0.5f) * (reach + limit), limit);
        }
      }

      V end_x = zx + dx;
      V end_y = zy + dy;
      auto slides = none > one;
      V length = none, over_length = none, integral_x = none, integral_y = none, lost = none;
      if constexpr (all) {
        length = root(dx * dx + dy * dy);
        over_length = divide(one, most(length, smallest));
        const V ex = dx * over_length;
        const V ey = dy * over_length;
        const SlideStart<V> start = slide_start<float, 2>(zx, zy, ex, ey);
        const V path = least(way_to_slide<float, 2>(start, reach), length);
        const Slid<V> end =
            slide_after<float, 2, true, true>(start, path, reach, slide_limit, ex, ey, length);
        slides = path < length;
        end_x = end.x;
        end_y = end.y;
        integral_x = end.integral_x;
        integral_y = end.integral_y;
        lost = end.dissipated;
      } else {
        const V gap = most(reach * reach - z2, none);
        slides = end_x * end_x + end_y * end_y > most(z2, reach * reach);
        if (any_lane(slides)) {
          // In units of the limit at which it slides; a bristle without a limit has no deflection.
          V over_limit = at[bed_over_pressure] * V(step.pressure_of_limit);
          V over_reach = over_limit;
          if constexpr (carried || drops) {
            const auto has_limit = over_limit > none;
            over_reach = select_lanes(has_limit, divide(one, most(reach, smallest)), none);
            if constexpr (carried)
              over_limit = select_lanes(has_limit, divide(one, most(slide_limit, smallest)), none);
          }
          V ux = zx, uy = zy, left_x = dx, left_y = dy;
          const V along = zx * dx + zy * dy;
          const auto sticks_first = (gap > V(1e-6f) * along) & slides;
          if (any_lane(sticks_first)) {
            const V sticks = share_that_sticks(gap, along, dx * dx + dy * dy);
            const V share = select_lanes(sticks_first, sticks, none);
            ux = ux + dx * share;
            uy = uy + dy * share;
            left_x = dx - dx * share;
            left_y = dy - dy * share;
          }
          ux = ux * over_reach;
          uy = uy * over_reach;
          turn_into(ux, uy, left_x * over_limit, left_y * over_limit);
          end_x = select_lanes(slides, ux * limit, end_x);
          end_y = select_lanes(slides, uy * limit, end_y);
        }
      }
      if constexpr (carried) {
        const V bound = select_lanes(slides, limit, hold);
        const V n2 = end_x * end_x + end_y * end_y;
        const auto beyond = n2 > bound * bound * V(1.000001f);
        if (any_lane(beyond)) {
          // Reduces a deflection beyond its limit to the limit. Such a bristle has slid and holds no more
          // than the kinetic limit.
          const V n = root(n2);
          const V back = select_lanes(beyond, divide(limit, most(n, smallest)), one);
          end_x = end_x * back;
          end_y = end_y * back;
          if constexpr (all) lost = lost + select_lanes(beyond, V(0.5f) * ((n - limit) * (n + limit)), none);
          slides = slides | beyond;
        }
      }
      auto writes = slides | rebase;
      if constexpr (carried) writes = writes | (kept < one);
      at.put(bed_tip_x, select_lanes(writes, anchor_x - end_x, tip_x));
      at.put(bed_tip_y, select_lanes(writes, anchor_y - end_y, tip_y));
      if constexpr (drops) at.put(bed_slid, select_lanes(slides, one, none));

      const V fx = k * end_x;
      const V fy = k * end_y;
      force_x.add(part, fx);
      force_y.add(part, fy);
      if (spins || all || step.torque) torque.add(part, x * fy - y * fx);
      if constexpr (all) {
        slipping.add(part, select_lanes(slides, k, none));
        const auto moves = length > smallest;
        const V mx = k * select_lanes(moves, integral_x * over_length, end_x);
        const V my = k * select_lanes(moves, integral_y * over_length, end_y);
        mean_x.add(part, mx);
        mean_y.add(part, my);
        mean_torque.add(part, x * my - y * mx);
        energy_x.add(part, fx * end_x);
        energy_y.add(part, fy * end_y);
        dissipated.add(part, k * lost);
        const V held = select_lanes(slides, none, k);
        const V held_x = held * x;
        const V held_y = held * y;
        stuck.add(part, held);
        stuck_x.add(part, held_x);
        stuck_y.add(part, held_y);
        stuck_xx.add(part, held_x * x);
        stuck_yy.add(part, held_y * y);
      }
    }
  sums.force[0] = force_x.total();
  sums.force[1] = force_y.total();
  sums.torque = torque.total();
  if constexpr (all) {
    sums.slipping = slipping.total();
    sums.mean[0] = mean_x.total();
    sums.mean[1] = mean_y.total();
    sums.mean_torque = mean_torque.total();
    sums.energy[0] = energy_x.total();
    sums.energy[1] = energy_y.total();
    sums.start_energy = start_energy.total();
    sums.dissipated = dissipated.total();
    sums.stuck = stuck.total();
    sums.stuck_x = stuck_x.total();
    sums.stuck_y = stuck_y.total();
    sums.stuck_xx = stuck_xx.total();
    sums.stuck_yy = stuck_yy.total();
  }
}

/// Relative pressure where `inside` is 1 at the centre of the contact and 0 at its edge.
template <class V>
inline V pressure_at(BedProfile profile, V inside) {
  if (profile == BedProfile::uniform) return V(1.0f);
  const V positive = most(inside, V(0.0f));
  return profile == BedProfile::parabolic ? positive : root(positive);
}

template <class E>
inline void put_pressure(const BedAt<E>& at, typename E::V pressure) {
  using V = typename E::V;
  const auto tiny = V(1e-6f) > pressure;
  at.put(bed_pressure, select_lanes(tiny, V(0.0f), pressure));
  at.put(bed_over_pressure, select_lanes(tiny, V(0.0f), divide(V(1.0f), most(pressure, V(1e-6f)))));
}

template <class E>
double place_bed(const BedPlaces& places, float* columns) {
  using V = typename E::V;
  const V none(0.0f), one(1.0f);
  const V size2(places.size2);
  typename E::Sum sum;
  for (std::uint32_t block = 0; block < places.count; block += lane_count)
    for (std::uint32_t part = 0; part < lane_count / E::size; ++part) {
      const BedAt<E> at{columns, places.count, block + part * E::size};
      const V inner = at[bed_inner];
      const V outer = at[bed_outer];
      const V in_contact = least(most(divide(size2 - inner, outer - inner), none), one);
      const V before = at[bed_stiffness];
      const V k = at[bed_own] * in_contact;
      at.put(bed_kept, least(divide(before, most(k, V(1e-30f))), one));
      at.put(bed_stiffness, k);
      const V middle = V(0.5f) * (inner + least(outer, size2));
      V pressure = at[bed_share] * pressure_at(places.profile, one - middle * V(places.inverse_size2));
      pressure = select_lanes(k > none, pressure, none);
      put_pressure<E>(at, pressure);
      sum.add(part, k * pressure);
    }
  return sum.total();
}

template <class E>
double roll_bed(const BedPlaces& places, float* columns) {
  using V = typename E::V;
  const V none(0.0f), one(1.0f);
  const V half_cell(0.5f * places.cell);
  const V ring(2.0f + places.cell);
  const V sign(places.rolled < 0.0f ? -1.0f : 1.0f);
  const V rolled(places.rolled < 0.0f ? -places.rolled : places.rolled);
  const V inverse_size2(places.inverse_size2);
  const bool rolls = places.rolled != 0.0f;
  typename E::Sum sum;
  for (std::uint32_t block = 0; block < places.count; block += lane_count)
    for (std::uint32_t part = 0; part < lane_count / E::size; ++part) {
      const BedAt<E> at{columns, places.count, block + part * E::size};
      const V across = at[bed_inner];
      const V half_length = at[bed_outer];
      const V before = at[bed_stiffness];

      // The part in contact, seen from the leading edge, whichever it is.
      V edge(places.edge);
      if (places.chords && places.size2 < 1.0f)
        edge = divide(root(most(V(places.size2) - across * across, none)), half_length);
      const V carried = rolled * at[bed_share];
      V place = at[bed_along] * sign;
      if (rolls) {
        V within = carried;
        if (any_lane(carried >= ring)) within = carried - whole_part(divide(carried, ring)) * ring;
        place = place - within;
        place = select_lanes(place < none - (one + half_cell), place + ring, place);
        at.put(bed_along, place * sign);
      }
      const V low = most(place - half_cell, none - edge);
      const V high = least(place + half_cell, edge);
      const V overlap = most(high - low, none);
      const V k = at[bed_own] * (overlap * V(1.0f / places.cell));
      const V middle = V(0.5f) * (low + high) * sign;
      const V along = middle * half_length;
      V inside = one - along * along * inverse_size2;
      if (places.chords) inside = inside - across * across * inverse_size2;
      const V pressure = select_lanes(k > none, pressure_at(places.profile, inside), none);
      const V x = along * V(places.axes[0]) - across * V(places.axes[1]);
      const V y = along * V(places.axes[2]) + across * V(places.axes[3]);

      const V tip_x = at[bed_tip_x];
      const V tip_y = at[bed_tip_y];
      const V old_x = at[bed_x];
      const V old_y = at[bed_y];
      V kept, moved = one;
      if (rolls) {
        // Distances from the leading edge, `near` to `far`: what is within `carried` has come in.
        const V near = edge - high;
        const V far = edge - low;
        const V border = least(most(near, carried), far);
        const auto enters = carried > near;
        kept = one;
        if (any_lane(enters)) {
          const V over = divide(one, most(overlap, V(1e-30f)));
          const V old_part = least((far - border) * over, one);
          const V fresh = most(border - near, none) * (border + near) * (V(0.5f) * over);
          const V share = least(old_part + divide(fresh, most(carried, V(1e-30f))), one);
          kept = select_lanes(enters, old_part, one);
          moved = select_lanes(enters, share, one);
        }
        at.put(bed_tip_x, tip_x - (V(places.root[0]) - V(places.root[2]) * old_y));
        at.put(bed_tip_y, tip_y - (V(places.root[1]) + V(places.root[3]) * old_x));
      } else {
        kept = least(divide(before, most(k, V(1e-30f))), one);
        at.put(bed_tip_x, tip_x + V(places.root[2]) * (old_y - y));
        at.put(bed_tip_y, tip_y + V(places.root[3]) * (x - old_x));
      }
      at.put(bed_kept, kept);
      at.put(bed_moved, moved);
      at.put(bed_stiffness, k);
      put_pressure<E>(at, pressure);
      at.put(bed_x, x);
      at.put(bed_y, y);
      sum.add(part, k * pressure);
    }
  return sum.total();
}

#define BRISTLE_BED_STEPS                                                                                   \
  {                                                                                                         \
    &step_bed<BedEngine, 0>, &step_bed<BedEngine, 1>, &step_bed<BedEngine, 2>, &step_bed<BedEngine, 3>,     \
        &step_bed<BedEngine, 4>, &step_bed<BedEngine, 5>, &step_bed<BedEngine, 6>, &step_bed<BedEngine, 7>, \
        &step_bed<BedEngine, 8>, &step_bed<BedEngine, 9>, &step_bed<BedEngine, 10>,                         \
        &step_bed<BedEngine, 11>, &step_bed<BedEngine, 12>, &step_bed<BedEngine, 13>,                       \
        &step_bed<BedEngine, 14>, &step_bed<BedEngine, 15>                                                  \
  }

}  // namespace
}  // namespace bristle::detail
