// The snap of a bristle, for a vector of them: this is where the physics of a step stands.
//
// A step moves the patch by `length` along the unit vector e. A bristle bends along until its deflection
// reaches its snap length, after a way tau; there it lets go, and what is left of the way bends it again,
// or snaps it again (DESIGN.md 2.2; symbols as in core/MODEL.md).
#pragma once

#include <limits>

#include "lanes.hpp"
#include "redraw.hpp"

namespace bristle::detail {
namespace {

/// What all bristles of a block share in a step: columns, direction, and displacement since the block's
/// last rewrite at the start (p0) and the end (p1) of the step. A local copy, so that it stays in registers.
template <class T, int axes>
struct BlockMotion {
  T* zx;
  T* zy;
  T* delta;
  std::uint32_t* draw;
  Lanes<T> ex, ey, length, p0x, p0y, p1x, p1y;

  /// Which of the bristles at i snap in this step: those beyond their length at its end.
  Mask<T> snaps_at(std::uint32_t i) const {
    const Lanes<T> x = load(zx + i) + p1x;
    const Lanes<T> limit = load(delta + i);
    if constexpr (axes == 1) {
      return xsimd::abs(x) > limit;
    } else {
      const Lanes<T> y = load(zy + i) + p1y;
      return x * x + y * y > limit * limit;
    }
  }

  /// Way to the snap from the end of the step, less what the rounding of snaps_at could hide.
  Lanes<T> margin_at(std::uint32_t i) const {
    const Lanes<T> x = load(zx + i) + p1x;
    const Lanes<T> limit = load(delta + i) * Lanes<T>(T(1) - 4 * std::numeric_limits<T>::epsilon());
    if constexpr (axes == 1) {
      return limit - xsimd::abs(x);
    } else {
      const Lanes<T> y = load(zy + i) + p1y;
      return limit - root(x * x + y * y);
    }
  }

  /// tau: from the start along e to the circle of radius `limit`. This form cannot go wrong in sign or root.
  Lanes<T> way_to_snap(Lanes<T> start_x, Lanes<T> start_y, Lanes<T> limit) const {
    if constexpr (axes == 1) {
      return positive_part(limit - start_x * ex);
    } else {
      const Lanes<T> along = start_x * ex + start_y * ey;
      const Lanes<T> aside = start_x * ey - start_y * ex;
      const Lanes<T> limit2 = limit * limit;
      const Lanes<T> chord2 = limit2 - aside * aside;
      // Bristles bent along the motion need no root: it would give `limit` to the last bit.
      const Lanes<T> chord = xsimd::any(chord2 != limit2) ? root(positive_part(chord2)) : limit;
      return positive_part(chord - along);
    }
  }
};

/// Where the rewritten bristles of a block go: its columns, or scratch when a step is only tried.
template <class T>
struct BlockOutput {
  T* zx;
  T* zy;
  T* delta;
  std::uint32_t* draw;
};

/// What a vector of bristles does after its first snap.
template <class T>
struct Remainder {
  Lanes<T> deflection;  ///< r, along the motion
  Lanes<T> squares;     ///< sum of delta^2 over the snaps after the first
  Lanes<T> count;       ///< of these
};

/// Keep: a bristle snaps every delta. Most steps hold few snaps of a bristle: up to two more are taken off
/// one by one, which is exact, and only beyond them is there a division.
template <class T>
inline Remainder<T> walk_keep(Mask<T> snapped, Lanes<T> rest, Lanes<T> delta) {
  const Lanes<T> none(T(0));
  const Lanes<T> one(T(1));
  const Mask<T> once = rest >= delta;
  if (!xsimd::any(once & snapped)) return {least(rest, delta), none, none};
  Lanes<T> r = select_lanes(once, rest - delta, rest);
  const Mask<T> twice = r >= delta;
  r = select_lanes(twice, r - delta, r);
  Lanes<T> more = select_lanes(once, one, none) + select_lanes(twice, one, none);
  const Mask<T> often = rest >= delta * Lanes<T>(T(3));
  if (xsimd::any(often & snapped)) {
    const Lanes<T> times = whole_part(divide(rest, delta));
    more = select_lanes(often, times, more);
    r = select_lanes(often, positive_part(rest - times * delta), r);
  }
  return {least(r, delta), more * (delta * delta), more};
}

/// Sums over the rows of a block, lane by lane.
template <class T>
struct RowSums {
  Lanes<T> stored[2];    ///< deflections at the end
  Lanes<T> straight[2];  ///< start + end of bristles that held
  Lanes<T> torn[2];      ///< start x tau of bristles that snapped
  Lanes<T> along;        ///< tau^2 + squares + r^2 of these
  Lanes<T> squares;      ///< delta^2 over all snaps
  Lanes<T> snaps;
  Lanes<T> further;   ///< delta^2 over the snaps after the first (redraw)
  Lanes<T> variance;  ///< of these, where a jump knows them in the mean only
};

/// Redraw, before the walk: the way left to the bristles of a vector that snap. Returns whether any does.
template <class T, int axes, bool partial, bool sums>
inline bool begin_walk(const BlockMotion<T, axes>& motion, std::uint32_t i, const T* weights, Walk<T>& walk) {
  constexpr std::uint32_t width = Lanes<T>::size;
  const Lanes<T> none(T(0));
  const std::uint32_t w = i % block_size;
  const Lanes<T> start_x = load(motion.zx + i) + motion.p0x;
  Lanes<T> start_y = none;
  if constexpr (axes == 2) start_y = load(motion.zy + i) + motion.p0y;
  Mask<T> snapped = motion.snaps_at(i);
  if constexpr (partial) snapped = snapped & (load(weights) > none);
  const Lanes<T> tau = motion.way_to_snap(start_x, start_y, load(motion.delta + i));
  const Lanes<T> rest = positive_part(motion.length - tau);
  select_lanes(snapped, rest, Lanes<T>(T(-1))).store_aligned(walk.rest + w);
  std::memcpy(walk.state + w, motion.draw + i, width * sizeof(std::uint32_t));
  if constexpr (sums) {
    none.store_aligned(walk.squares + w);
    none.store_aligned(walk.count + w);
    none.store_aligned(walk.variance + w);
  }
  return xsimd::any(snapped);
}

/// Advances the vector of bristles at i of a block that is being rewritten. `partial`: bristles count by
/// their weights, and those of weight 0 not at all.
template <class T, int axes, Rule rule, bool mean, bool energy, bool partial>
[[gnu::always_inline]] inline void advance_bristles(const BlockMotion<T, axes>& motion,
                                                    const BlockOutput<T>& output, std::uint32_t i,
                                                    const T* weights, const KernelLaw* law,
                                                    const Walk<T>* walk, RowSums<T>& sums) {
  constexpr bool redraw = rule == rule_redraw || rule == rule_literal_redraw;
  constexpr bool literal = rule == rule_literal_keep || rule == rule_literal_redraw;
  constexpr std::uint32_t width = Lanes<T>::size;
  const Lanes<T> none(T(0));
  const std::uint32_t w = i % block_size;
  Lanes<T> weight(T(1));
  if constexpr (partial) weight = load(weights);
  const auto add = [&weight](Lanes<T>& sum, Lanes<T> x) {
    if constexpr (partial) x = x * weight;
    sum = sum + x;
  };

  const Lanes<T> zx = load(motion.zx + i);
  const Lanes<T> start_x = zx + motion.p0x;
  const Lanes<T> end_x = zx + motion.p1x;
  Lanes<T> start_y = none;
  Lanes<T> end_y = none;
  if constexpr (axes == 2) {
    const Lanes<T> zy = load(motion.zy + i);
    start_y = zy + motion.p0y;
    end_y = zy + motion.p1y;
  }
  const Lanes<T> delta = load(motion.delta + i);
  Mask<T> snapped = motion.snaps_at(i);
  if constexpr (partial) snapped = snapped & (weight > none);

  Lanes<T> next_x;
  Lanes<T> next_y = none;
  if constexpr (literal) {
    // The paper's loop: z += v dt; if |z| > delta then z = 0.
    next_x = select_lanes(snapped, none, end_x);
    Lanes<T> end2 = end_x * end_x;
    if constexpr (axes == 2) {
      next_y = select_lanes(snapped, none, end_y);
      end2 = end2 + end_y * end_y;
    }
    if constexpr (redraw) {
      DrawStates<T> states(motion.draw + i);
      const Lanes<T> drawn = length_at<T>(*law, states.next(snapped));
      states.store(output.draw + w);
      select_lanes(snapped, drawn, delta).store_aligned(output.delta + w);
    }
    add(sums.squares, select_lanes(snapped, end2, none));
    sums.snaps = sums.snaps + select_lanes(snapped, Lanes<T>(T(1)), none);
  } else {
    [[maybe_unused]] Lanes<T> tau = none;
    if constexpr (mean || !redraw) tau = motion.way_to_snap(start_x, start_y, delta);
    Remainder<T> after{none, none, none};
    if constexpr (redraw) {
      after.deflection = load(walk->landed + w);
      if constexpr (mean || energy) {
        after.squares = load(walk->squares + w);
        after.count = load(walk->count + w);
        add(sums.further, after.squares);
        Lanes<T> variance = load(walk->variance + w);
        if constexpr (partial) variance = variance * weight;
        add(sums.variance, variance);
      }
      select_lanes(snapped, load(walk->length + w), delta).store_aligned(output.delta + w);
      std::memcpy(output.draw + w, walk->state + w, width * sizeof(std::uint32_t));
    } else {
      after = walk_keep<T>(snapped, positive_part(motion.length - tau), delta);
    }
    const Lanes<T> r = after.deflection;
    next_x = select_lanes(snapped, r * motion.ex, end_x);
    if constexpr (axes == 2) next_y = select_lanes(snapped, r * motion.ey, end_y);
    if constexpr (mean) {
      add(sums.along, select_lanes(snapped, (tau * tau + after.squares) + r * r, none));
      add(sums.torn[0], select_lanes(snapped, start_x * tau, none));
      add(sums.straight[0], select_lanes(snapped, none, start_x + end_x));
      if constexpr (axes == 2) {
        add(sums.torn[1], select_lanes(snapped, start_y * tau, none));
        add(sums.straight[1], select_lanes(snapped, none, start_y + end_y));
      }
    }
    if constexpr (energy) {
      add(sums.squares, select_lanes(snapped, delta * delta + after.squares, none));
      sums.snaps = sums.snaps + select_lanes(snapped, Lanes<T>(T(1)) + after.count, none);
    }
  }
  if constexpr (partial) {
    const Mask<T> active = weight > none;
    next_x = select_lanes(active, next_x, none);
    if constexpr (axes == 2) next_y = select_lanes(active, next_y, none);
  }
  next_x.store_aligned(output.zx + w);
  if constexpr (axes == 2) next_y.store_aligned(output.zy + w);
  add(sums.stored[0], next_x);
  if constexpr (axes == 2) add(sums.stored[1], next_y);
}

}  // namespace
}  // namespace bristle::detail
