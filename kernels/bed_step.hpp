// Kernels of beds, the bristles under an elastic body (core/beds/BEDS.md): a step of all bristles, and the
// positions of bristles when load or rolling change the contact. E::V is a vector of any width.
#pragma once

#include <limits>

#include "bed_slide.hpp"
#include "lanes.hpp"

#include "core/bed_table.hpp"

namespace bristle::detail {
namespace {

using BedEngine = Engine<float>;

/// Access to the columns of a bed for one vector of bristles: at[column] loads the column's entries for these
/// bristles.
template <class E>
struct BedAt {
  float* block;
  using V = typename E::V;
  V operator[](BedColumn c) const { return E::get(block + c * lane_count); }
  void put(BedColumn c, V x) const { E::put(block + c * lane_count, x); }
};

/// Calls `visit` for each vector of bristles, with its columns and its index within a block of 16.
template <class E, class Visit>
inline void for_each_vector(std::uint32_t count, float* columns, const Visit& visit) {
  float* const end = columns + std::size_t{count} * bed_columns;
  for (float* block = columns; block != end; block += bed_columns * lane_count)
    for (std::uint32_t part = 0; part < lane_count / E::size; ++part)
      visit(BedAt<E>{block + part * E::size}, part);
}

template <class E, std::uint32_t variant>
void step_bed(const BedStep& given, float* columns, BedSums& sums) {
  using V = typename E::V;
  constexpr bool spins = (variant & bed_spins) != 0;
  constexpr bool reloaded = (variant & bed_reloaded) != 0;
  constexpr bool all = (variant & bed_all_outputs) != 0;
  constexpr bool drops = (variant & bed_drops) != 0;
  const BedStep step = given;
  const V none(0.0f);
  const V one(1.0f);
  const V smallest(1e-30f);
  const V limit_of_pressure(step.limit_of_pressure);
  const bool with_torque = spins || all || step.torque;
  const bool askew = step.gain != 1.0f;
  const bool creeps = all && !reloaded && step.creeps;
  [[maybe_unused]] constexpr float eps = std::numeric_limits<float>::epsilon();
  // Factor of the stored tip positions: 1, or 0 if the step recomputes all tips relative to roots at
  // displacement zero (BedStep::rolled).
  const V stands(reloaded && step.rolled ? 0.0f : 1.0f);
  [[maybe_unused]] const auto always = one > stands;
  typename E::Sum force_x, force_y, torque, slipping;
  typename E::Sum mean_x, mean_y, mean_torque, energy_x, energy_y, dissipated;
  typename E::Sum start_energy, start_x, start_y, start_torque, entered, entered_stuck;
  typename E::Sum stuck, stuck_x, stuck_y, stuck_xx, stuck_yy;

  for_each_vector<E>(step.count, columns, [&](const BedAt<E>& at, std::uint32_t part) {
    const V k = at[bed_stiffness];
    const V limit = at[bed_pressure] * limit_of_pressure;
    V x = none, y = none, moved = one, kept = one;
    if (with_torque) {
      x = at[bed_x];
      y = at[bed_y];
    }
    if constexpr (reloaded) {
      moved = at[bed_moved];
      kept = at[bed_kept];
    }

    // Loads the deflections of the bristles at the start of the step, and computes the motion of their roots
    // in it.
    const V tip_x = at[bed_tip_x];
    const V tip_y = at[bed_tip_y];
    V zx, zy, dx(step.motion[0]), dy(step.motion[1]);
    if constexpr (spins) {
      zx = (V(step.root[0]) - V(step.root[2]) * y) - tip_x;
      zy = (V(step.root[1]) + V(step.root[3]) * x) - tip_y;
      V middle_x = x, middle_y = y;
      if constexpr (reloaded) {
        middle_x = x + moved * V(step.half_rolled[0]);
        middle_y = y + moved * V(step.half_rolled[1]);
      }
      dx = dx - V(step.motion[2]) * middle_y;
      dy = dy + V(step.motion[3]) * middle_x;
    } else {
      zx = V(step.root[0]) - tip_x;
      zy = V(step.root[1]) - tip_y;
    }
    // Position that a bristle's tip would need for the bristle to be straight at the end of the step.
    V free_x = tip_x + (zx + dx);
    V free_y = tip_y + (zy + dy);
    if constexpr (reloaded) {
      free_x = free_x * stands;
      free_y = free_y * stands;
      dx = dx * moved;
      dy = dy * moved;
      zx = zx * kept;
      zy = zy * kept;
    }
    V static_limit = limit;
    V kinetic_over_static = one;
    if constexpr (drops) {
      // Restores the static limit of a bristle that slid when the motion reverses, because it sticks then.
      const auto slid_on = (at[bed_slid] * kept > none) & (zx * dx + zy * dy >= none);
      static_limit = select_lanes(slid_on, limit, limit * V(step.static_over_kinetic));
      kinetic_over_static = select_lanes(slid_on, one, V(step.kinetic_over_static));
    }
    const V z2 = zx * zx + zy * zy;
    if constexpr (reloaded && all) {
      start_energy.add(part, k * z2);
      start_x.add(part, k * zx);
      start_y.add(part, k * zy);
      start_torque.add(part, k * (x * zy - y * zx));
    }

    V end_x = zx + dx;
    V end_y = zy + dy;
    auto slides = none > one;
    [[maybe_unused]] V tip_path_x = none, tip_path_y = none;  // path of the tip, in a step that creeps
    V length = none, over_length = none, integral_x = none, integral_y = none, lost = none;
    if constexpr (all) {
      // Sets the deflections of bristles out of contact to 0. What their columns have is rounding error.
      const auto presses = (reloaded ? k : limit) > none;
      zx = select_lanes(presses, zx, none);
      zy = select_lanes(presses, zy, none);
      length = root(dx * dx + dy * dy);
      over_length = divide(one, most(length, smallest));
      const V ex = dx * over_length;
      const V ey = dy * over_length;
      // Handles bristles that are bent beyond their limit because the limit fell in this step: they slide at
      // the mean of their deflection and the new limit, since the limit falls along the step, and end at the
      // new limit.
      V reach = static_limit;
      V slide_limit = limit;
      if constexpr (reloaded) {
        const auto falls = z2 > static_limit * static_limit;
        if (any_lane(falls)) {
          reach = select_lanes(falls, root(z2), static_limit);
          slide_limit = select_lanes(falls, V(0.5f) * (reach + limit), limit);
        }
      }
      const SlideStart<V> start = slide_start<float, 2>(zx, zy, ex, ey);
      V path = least(path_to_slide<float, 2>(start, reach), length);
      if (creeps) {
        // Lets a bristle that is within rounding of its limit slide at once. Otherwise rounding would decide
        // whether it sticks for a while.
        const V nearly = reach * V(1.0f - 32.0f * eps);
        path = select_lanes((start.along >= none) & (z2 >= nearly * nearly), none, path);
      }
      Slid<V> end = slide_after<float, 2, true, true>(start, path, reach, slide_limit, ex, ey, length);
      slides = path < length;
      if ((askew || creeps) && any_lane(slides)) {
        const V ux = zx + ex * path, uy = zy + ey * path, left = length - path;
        V px = ex, py = ey, slide = left;
        if (askew) {
          const Course<V> course = askew_course(ux, uy, ex * left, ey * left, slide_limit, step.gain);
          px = course.ex;
          py = course.ey;
          slide = course.path * slide_limit;
          const AskewSlide<V> slid = slide_askew(course, slide_limit, step.gain);
          const V half_path2 = V(0.5f) * path * path;
          end.x = select_lanes(slides, slid.x, end.x);
          end.y = select_lanes(slides, slid.y, end.y);
          end.integral_x =
              select_lanes(slides, zx * path + ex * half_path2 + slid.mean_x * left, end.integral_x);
          end.integral_y =
              select_lanes(slides, zy * path + ey * half_path2 + slid.mean_y * left, end.integral_y);
        }
        if (creeps) {
          // Moves the tip by the motion of the root less the change of the deflection. The deflection changes
          // by turning and by the limit.
          const V size = most(root(ux * ux + uy * uy), smallest);
          const V ratio = divide(slide_limit, size), change = divide(slide_limit - size, size);
          const V a = ratio * (ux * px + uy * py), b = ratio * (ux * py - uy * px);
          const Tractrix<V> tip(b, most(slide_limit + a, V(1e-15f)),
                                decay<float>(divide(slide, most(slide_limit, smallest))));
          const V along = tip.template gained_along<float>(), aside = tip.lost_aside();
          tip_path_x = ex * left - (change * ux + (along * px - aside * py));
          tip_path_y = ey * left - (change * uy + (along * py + aside * px));
        }
      }
      if constexpr (reloaded) {
        if (step.rolls) {
          // Lets the friction limit of a bristle grow evenly along the motion if it rises because the bed
          // rolls.
          const V old = at[bed_old_pressure] * limit_of_pressure;
          const V grown = select_lanes((old > none) & (old < limit),
                                       V(0.5f) * divide(old + limit, most(limit, smallest)), one);
          const V half_path2 = V(0.5f) * path * path;
          const V sticks_x = zx * path + ex * half_path2, sticks_y = zy * path + ey * half_path2;
          end.integral_x = sticks_x + (end.integral_x - sticks_x) * grown;
          end.integral_y = sticks_y + (end.integral_y - sticks_y) * grown;
          const V fresh = k * (one - kept);
          entered.add(part, fresh);
          entered_stuck.add(part, fresh * select_lanes(slides, path * over_length, one));
        }
      }
      end_x = end.x;
      end_y = end.y;
      integral_x = end.integral_x;
      integral_y = end.integral_y;
      lost = end.dissipated;
    } else {
      // Relies on zeros: bristles without a limit have 0 for the inverse of the limit and for the stiffness,
      // so they never count as sliding.
      const V over_limit2 = at[bed_over_pressure2] * V(step.pressure_of_limit2);
      V over_both = over_limit2, over_static2 = over_limit2;
      if constexpr (drops) {
        over_both = over_limit2 * kinetic_over_static;
        over_static2 = over_both * kinetic_over_static;
      }
      const V d2 = dx * dx + dy * dy;
      const V zd = zx * dx + zy * dy;
      const V zd2 = zd + zd;
      V gap = one - z2 * over_static2;
      slides = (d2 + zd2) * over_static2 > most(gap, none);
      if (any_lane(slides)) {
        V ux = zx, uy = zy, left = one;
        V push_x = dx, push_y = dy, slide_limit = limit;
        V t = d2 * over_limit2;
        V q2 = zd2 * over_both;
        V to_keep = kinetic_over_static, to_push = one;
        // Selects the bristles that need the slow branch. These are bristles that unload, and bristles whose
        // deflection differs from the limit by more than 2e-6 of the bed's unit of deflection, four times
        // what rounding may cause.
        const auto unloads = none > zd;
        const auto rough = slides & ((gap * gap > over_static2 * V(1.6e-11f)) | unloads);
        const bool any_rough = any_lane(rough);
        if (any_rough) {
          // Lets the tip of a bristle stick first if the bristle is within its limit or unloads.
          V share = share_that_sticks(most(gap, none), zd * over_static2, d2 * over_static2);
          share = select_lanes(rough & ((gap > none) | unloads), share, none);
          ux = zx + dx * share;
          uy = zy + dy * share;
          left = one - share;
          t = t * (left * left);
          const V ud = (ux * dx + uy * dy) * left;
          const V ud2 = ud + ud;
          q2 = select_lanes(rough, ud2 * over_both, q2);
          // Lets a bristle whose limit fell below its deflection slide at the mean of the two, since the
          // limit falls along the step.
          const auto outside = rough & (none > gap);
          if (any_lane(outside)) {
            const V n = root(z2);
            const V mean = reloaded ? V(0.5f) * (n + limit) : limit;
            const V over = divide(one, most(n * mean, smallest));
            const V over_mean = over * n;
            const V path = left * over_mean;
            slide_limit = select_lanes(outside, mean, limit);
            t = select_lanes(outside, d2 * (path * path), t);
            q2 = select_lanes(outside, ud2 * over, q2);
            to_keep = select_lanes(outside, limit * (over * mean), to_keep);
            to_push = select_lanes(outside, limit * over_mean, to_push);
          }
          gap = select_lanes(rough, none, gap);
        }
        if (askew) {
          const Course<V> course = askew_course(ux, uy, dx * left, dy * left, slide_limit, step.gain);
          push_x = course.ex * (course.path * slide_limit);
          push_y = course.ey * (course.path * slide_limit);
          left = one;
          const V over = divide(one, most(slide_limit, smallest));
          t = (push_x * push_x + push_y * push_y) * (over * over);
          const V ud = (ux * push_x + uy * push_y) * over;
          q2 = divide(ud + ud, most(root(ux * ux + uy * uy), smallest));
        }
        Dragged<V> to = drag(t, q2, gap);
        if (any_rough || drops) {
          to.keep = to.keep * to_keep;
          to.push = to.push * (to_push * left);
        }
        end_x = select_lanes(slides, ux * to.keep + push_x * to.push, end_x);
        end_y = select_lanes(slides, uy * to.keep + push_y * to.push, end_y);
      }
    }
    if constexpr (reloaded) {
      const V allowed = select_lanes(slides, limit, static_limit);
      const V n2 = end_x * end_x + end_y * end_y;
      const auto beyond = (n2 > allowed * allowed * V(1.000001f)) & (k > none);
      if (any_lane(beyond)) {
        // Shortens a deflection that exceeds its limit to the limit. Such a bristle has slid, so its limit is
        // the kinetic one.
        const V n = root(n2);
        const V back = select_lanes(beyond, divide(limit, most(n, smallest)), one);
        end_x = end_x * back;
        end_y = end_y * back;
        if constexpr (all) lost = lost + select_lanes(beyond, V(0.5f) * ((n - limit) * (n + limit)), none);
        slides = slides | beyond;
      }
    }
    auto writes = slides;
    if constexpr (reloaded) writes = writes | always | (kept < one);
    V next_x = free_x - end_x, next_y = free_y - end_y;
    if (creeps) {
      next_x = tip_x + (tip_path_x + spacing<float>(tip_x) * V(step.spread));
      next_y = tip_y + (tip_path_y + spacing<float>(tip_y) * V(step.spread));
    }
    at.put(bed_tip_x, select_lanes(writes, next_x, tip_x));
    at.put(bed_tip_y, select_lanes(writes, next_y, tip_y));
    if constexpr (drops) at.put(bed_slid, select_lanes(slides, one, none));

    const V fx = k * end_x;
    const V fy = k * end_y;
    force_x.add(part, fx);
    force_y.add(part, fy);
    if (with_torque) torque.add(part, x * fy - y * fx);
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
      const V sticking = select_lanes(slides, none, k);
      const V sticking_x = sticking * x;
      const V sticking_y = sticking * y;
      stuck.add(part, sticking);
      stuck_x.add(part, sticking_x);
      stuck_y.add(part, sticking_y);
      stuck_xx.add(part, sticking_x * x);
      stuck_yy.add(part, sticking_y * y);
    }
  });
  sums.force[0] = force_x.total();
  sums.force[1] = force_y.total();
  if (with_torque) sums.torque = torque.total();
  if constexpr (all) {
    sums.slipping = slipping.total();
    sums.mean[0] = mean_x.total();
    sums.mean[1] = mean_y.total();
    sums.mean_torque = mean_torque.total();
    sums.energy[0] = energy_x.total();
    sums.energy[1] = energy_y.total();
    sums.start_energy = start_energy.total();
    sums.start[0] = start_x.total();
    sums.start[1] = start_y.total();
    sums.start_torque = start_torque.total();
    sums.entered = entered.total();
    sums.entered_stuck = entered_stuck.total();
    sums.dissipated = dissipated.total();
    sums.stuck = stuck.total();
    sums.stuck_x = stuck_x.total();
    sums.stuck_y = stuck_y.total();
    sums.stuck_xx = stuck_xx.total();
    sums.stuck_yy = stuck_yy.total();
  }
}

/// Returns the pressure at a point, relative to that at the centre, for this profile. `inside` is 1 at the
/// centre and 0 at the edge.
template <class V>
inline V pressure_at(BedProfile profile, V inside) {
  if (profile == BedProfile::uniform) return V(1.0f);
  const V positive = most(inside, V(0.0f));
  return profile == BedProfile::parabolic ? positive : root(positive);
}

/// Writes stiffness and pressure of a vector of bristles: both 0 where the pressure is too small for contact.
/// Returns the product of the two, for the sum over the bed.
template <class E>
inline typename E::V put_contact(const BedAt<E>& at, typename E::V k, typename E::V pressure) {
  using V = typename E::V;
  const auto presses = pressure >= V(1e-6f);
  k = select_lanes(presses, k, V(0.0f));
  pressure = select_lanes(presses, pressure, V(0.0f));
  at.put(bed_stiffness, k);
  at.put(bed_pressure, pressure);
  at.put(bed_over_pressure2,
         select_lanes(presses, divide(V(1.0f), most(pressure * pressure, V(1e-12f))), V(0.0f)));
  return k * pressure;
}

template <class E>
double set_bed_positions(const BedPositions& positions, float* columns) {
  using V = typename E::V;
  const V none(0.0f), one(1.0f);
  const V size2(positions.size2), inverse_size2(positions.inverse_size2);
  const BedProfile profile = positions.profile;
  typename E::Sum sum;
  for_each_vector<E>(positions.count, columns, [&](const BedAt<E>& at, std::uint32_t part) {
    const V inner = at[bed_inner];
    const V outer = at[bed_outer];
    const V in_contact = least(most(divide(size2 - inner, outer - inner), none), one);
    const V before = at[bed_stiffness];
    const V k = at[bed_own] * in_contact;
    at.put(bed_kept, least(divide(before, most(k, V(1e-30f))), one));
    const V middle = V(0.5f) * (inner + least(outer, size2));
    V pressure = at[bed_share] * pressure_at(profile, one - middle * inverse_size2);
    pressure = select_lanes(k > none, pressure, none);
    sum.add(part, put_contact<E>(at, k, pressure));
  });
  return sum.total();
}

template <class E, bool rolls>
double roll_bed(const BedPositions& given, float* columns) {
  using V = typename E::V;
  const BedPositions positions = given;
  const V none(0.0f), one(1.0f);
  const V half_cell(0.5f * positions.cell);
  const V over_cell(1.0f / positions.cell);
  const V ring(2.0f + positions.cell);
  const V sign(positions.rolled < 0.0f ? -1.0f : 1.0f);
  const V rolled(positions.rolled < 0.0f ? -positions.rolled : positions.rolled);
  const V inverse_size2(positions.inverse_size2);
  const bool chords_change = positions.chords && positions.size2 < 1.0f;
  [[maybe_unused]] const bool moves_y = positions.turned || positions.axes[2] != 0.0f;
  typename E::Sum sum;
  for_each_vector<E>(positions.count, columns, [&](const BedAt<E>& at, std::uint32_t part) {
    const V across = at[bed_inner];
    const V half_length = at[bed_outer];

    // Half length of the part of a row that is in contact, relative to the whole row. Positions along the row
    // are counted towards the leading edge; `sign` swaps the ends of the row.
    V edge(positions.edge);
    if (chords_change) edge = divide(root(most(V(positions.size2) - across * across, none)), half_length);
    V position = at[bed_along] * sign;
    V rolled_on = none;
    if constexpr (rolls) {
      rolled_on = rolled * at[bed_share];
      V within = rolled_on;
      if (any_lane(rolled_on >= ring)) within = rolled_on - whole_part(divide(rolled_on, ring)) * ring;
      position = position - within;
      position = select_lanes(position < none - (one + half_cell), position + ring, position);
      at.put(bed_along, position * sign);
    }
    const V low = most(position - half_cell, none - edge);
    const V high = least(position + half_cell, edge);
    const V overlap = most(high - low, none);
    const V k = at[bed_own] * (overlap * over_cell);
    const V middle = V(0.5f) * (low + high) * sign;
    const V along = middle * half_length;
    V inside = one - along * along * inverse_size2;
    if (positions.chords) inside = inside - across * across * inverse_size2;
    const V pressure = select_lanes(k > none, pressure_at(positions.profile, inside), none);
    const V x = along * V(positions.axes[0]) - across * V(positions.axes[1]);
    if constexpr (rolls) {
      at.put(bed_old_pressure, at[bed_pressure]);
      // Distances of the ends of a cell from the leading edge: `near` and `far`. The part of the cell nearer
      // than `rolled_on` came into contact in this step.
      const V near = edge - high;
      const V far = edge - low;
      const V border = least(most(near, rolled_on), far);
      const auto enters = rolled_on > near;
      V kept = one, moved = one;
      if (any_lane(enters)) {
        const V over = divide(one, most(overlap, V(1e-30f)));
        const V old_part = least((far - border) * over, one);
        const V fresh = most(border - near, none) * (border + near) * (V(0.5f) * over);
        const V share = least(old_part + fresh * (half_length * V(positions.over_rolled)), one);
        kept = select_lanes(enters, old_part, one);
        moved = select_lanes(enters, share, one);
      }
      at.put(bed_kept, kept);
      at.put(bed_moved, moved);
      at.put(bed_x, x);
      if (moves_y) at.put(bed_y, along * V(positions.axes[2]) + across * V(positions.axes[3]));
    } else {
      const V y = along * V(positions.axes[2]) + across * V(positions.axes[3]);
      at.put(bed_kept, least(divide(at[bed_stiffness], most(k, V(1e-30f))), one));
      at.put(bed_moved, one);
      at.put(bed_tip_x, at[bed_tip_x] + V(positions.root[2]) * (at[bed_y] - y));
      at.put(bed_tip_y, at[bed_tip_y] + V(positions.root[3]) * (x - at[bed_x]));
      at.put(bed_x, x);
      at.put(bed_y, y);
    }
    sum.add(part, put_contact<E>(at, k, pressure));
  });
  return sum.total();
}

template <class E>
void rebase_bed(const BedPositions& positions, float* columns) {
  using V = typename E::V;
  const V x(positions.root[0]), y(positions.root[1]), turn_x(positions.root[2]), turn_y(positions.root[3]);
  for_each_vector<E>(positions.count, columns, [&](const BedAt<E>& at, std::uint32_t) {
    at.put(bed_tip_x, at[bed_tip_x] - (x - turn_x * at[bed_y]));
    at.put(bed_tip_y, at[bed_tip_y] - (y + turn_y * at[bed_x]));
  });
}

}  // namespace
}  // namespace bristle::detail
