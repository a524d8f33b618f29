// The snap of a bristle that ages, in vectors: like snap.hpp, but with a limit that grows with the age
// (ageing.hpp, core/patches/AGEING.md).
#pragma once

#include "ageing.hpp"
#include "snap.hpp"

namespace bristle::detail {
namespace {

/// Data that all bristles of a block share in a step (see BlockMotion), with the constants of their ages.
template <class T, int axes>
struct AgedMotion : BlockMotion<T, axes, true> {
  T* age;
  /// Age gained since the block's last rewrite, at the start and at the end of the step.
  Lanes<T> before, after;
  Lanes<T> later;  ///< lower bound of the age gained since the block's last rewrite, in every later step
  AgeingLaw<T> ageing;

  Lanes<T> end_age(std::uint32_t i) const { return load(age + i) + after; }
  /// Returns the deflections at which bristles of these fresh snap lengths and ages snap.
  Lanes<T> limit_of(Lanes<T> fresh, Lanes<T> aged) const {
    return this->residual.left + fresh * growth<T>(ageing, positive_part(aged));
  }
  /// Returns the deflections at which the bristles from i on would snap at the end of the step.
  Lanes<T> end_limit(std::uint32_t i, Lanes<T> fresh) const { return limit_of(fresh, end_age(i)); }

  /// Returns a mask of the bristles from i on that are beyond their limit at the end of the step. Tests the
  /// fresh limit first, which needs no logarithm: a bristle within it is within the longer aged limit too.
  Mask<T> beyond_at(std::uint32_t i) const {
    const Mask<T> beyond = BlockMotion<T, axes, true>::beyond_at(i);
    if (!any_lane(beyond)) return beyond;
    return beyond & this->exceeds(i, end_limit(i, load(this->delta + i) - this->residual.left));
  }

  Lanes<T> margin_at(std::uint32_t i) const {
    const Lanes<T> limit = limit_of(load(this->delta + i) - this->residual.left, load(age + i) + later);
    return this->left_to(i, limit * Lanes<T>(T(1) - 16 * std::numeric_limits<T>::epsilon()));
  }
};

/// Paths of a block's bristles: `path` up to the first snap, `interval` from snap to snap (SnapRule::keep).
template <class T>
struct AgedPaths {
  alignas(64) T path[block_size];
  alignas(64) T interval[block_size];
};

/// Deflections of the bristles from i on at the start of the step.
template <class T, int axes>
struct AgedStart {
  Lanes<T> x, y;
  Bent<Lanes<T>> bent;

  AgedStart(const AgedMotion<T, axes>& motion, std::uint32_t i) {
    x = load(motion.zx + i) + motion.p0x;
    y = bent.aside2 = Lanes<T>(T(0));
    bent.along = x * motion.ex;
    if constexpr (axes == 2) {
      y = load(motion.zy + i) + motion.p0y;
      bent.along = x * motion.ex + y * motion.ey;
      const Lanes<T> aside = x * motion.ey - y * motion.ex;
      bent.aside2 = aside * aside;
    }
  }
};

/// First of three passes over a block of ageing bristles: finds, for each bristle, a path at or beyond its
/// first snap. Returns whether any bristle snaps.
template <class T, int axes, bool partial>
[[gnu::always_inline]] inline bool begin_aged(const AgedMotion<T, axes>& motion, std::uint32_t i,
                                              const T* row_weights, T* path) {
  const AgedStart<T, axes> start(motion, i);
  Lanes<T> to_snap =
      path_to_circle<T, axes>(start.bent, motion.end_limit(i, load(motion.delta + i) - motion.residual.left));
  if constexpr (partial) to_snap = select_lanes(load(row_weights) > Lanes<T>(T(0)), to_snap, motion.length);
  const Lanes<T> first = least(to_snap, motion.length);
  put_lanes(path + i % block_size, first);
  return any_lane(first < motion.length);
}

/// Second of three passes over a block of ageing bristles: finds the snaps, by Newton's method from the paths
/// of the first pass. Takes eight vectors at once, because each iteration waits for the one before.
template <class T, int axes, bool keep>
[[gnu::noinline]] void find_snaps(const AgedMotion<T, axes>& motion, std::uint32_t start,
                                  const VectorList<T>& snapping, bool again, T* path, T* intervals) {
  const auto same = [](Lanes<T> x) {
    Bundle<T> all;
    for (Lanes<T>& lanes : all.v) lanes = x;
    return all;
  };
  const Bundle<T> left = same(motion.residual.left);
  const Bundle<T> length = same(motion.length);
  for (std::uint32_t n = 0; n < snapping.size; n += bundle_size) {
    BundleOffsets<T> at;
    for (std::uint32_t k = 0; k < bundle_size; ++k)
      // Fills unused vectors of the bundle with its first vector, which does no harm.
      at.i[k] = snapping.offset[n + k < snapping.size ? n + k : n];
    Bent<Bundle<T>> bent;
    for (std::uint32_t k = 0; k < bundle_size; ++k) {
      const AgedStart<T, axes> from(motion, start + at.i[k]);
      bent.along.v[k] = from.bent.along;
      bent.aside2.v[k] = from.bent.aside2;
    }
    const Bundle<T> fresh = at.load_from(motion.delta + start) - left;
    const Bundle<T> age = at.load_from(motion.age + start) + same(motion.before);
    Bundle<T> to_snap = at.load_from(path);
    to_snap = aged_path<T, axes>(motion.ageing, bent, left, fresh, age, to_snap, length > to_snap);
    at.store_to(path, to_snap);
    if constexpr (keep)
      if (again) at.store_to(intervals, aged_length<T>(motion.ageing, fresh, length - to_snap));
  }
}

/// Third of three passes over a block of ageing bristles: adds the path up to the first snap to the sums.
template <class T, int axes, bool partial>
inline void add_aged_pass(const AgedMotion<T, axes>& motion, std::uint32_t i, Lanes<T> path,
                          const Weights<T, partial>& weights, RowSums<T>& sums) {
  const AgedStart<T, axes> start(motion, i);
  weights.add(sums.passed[0], start.x * path);
  if constexpr (axes == 2) weights.add(sums.passed[1], start.y * path);
  const Lanes<T> reached = start.bent.along + path;
  const Lanes<T> left2 = motion.residual.left * motion.residual.left;
  weights.add(sums.squares, select_lanes(path < motion.length,
                                         (reached * reached + start.bent.aside2) - left2, Lanes<T>(T(0))));
}

/// Adds the motion after the first snap to the sums, and writes deflections and ages of the bristles at i.
template <class T, int axes, bool partial>
inline void put_aged(const AgedMotion<T, axes>& motion, const BlockOutput<T>& output, T* new_age,
                     std::uint32_t i, Lanes<T> path, Mask<T> snapped, const AfterSnaps<T>& land,
                     const Weights<T, partial>& weights, RowSums<T>& sums) {
  put_snapped<T, axes, true, true>(motion, output, i, path, snapped, land, weights, sums);
  Lanes<T> age =
      select_lanes(snapped, Lanes<T>(motion.ageing.per_length) * land.deflection, motion.end_age(i));
  age = least(age, Lanes<T>(static_cast<T>(oldest)));
  if constexpr (partial) age = select_lanes(weights.weight > Lanes<T>(T(0)), age, Lanes<T>(T(0)));
  put_lanes(new_age + i % block_size, age);
}

/// Adds the bristles at i to the sums and writes them, under SnapRule::keep, where the paths from snap to
/// snap are equal.
template <class T, int axes, bool partial>
[[gnu::always_inline]] inline void end_keep_aged(const AgedMotion<T, axes>& motion,
                                                 const BlockOutput<T>& output, T* new_age, std::uint32_t i,
                                                 const T* row_weights, bool again, const AgedPaths<T>& paths,
                                                 RowSums<T>& sums) {
  const Lanes<T> none(T(0));
  const Weights<T, partial> weights(row_weights);
  const Lanes<T> path = load(paths.path + i % block_size);
  const Lanes<T> remaining = motion.length - path;
  AfterSnaps<T> land{remaining, none, none};
  if (again) land = land_even<T>(remaining, load(paths.interval + i % block_size));
  add_aged_pass<T, axes>(motion, i, path, weights, sums);
  put_aged<T, axes>(motion, output, new_age, i, path, path < motion.length, land, weights, sums);
}

/// Adds the bristles at i to the sums and writes them, under SnapRule::redraw, after the rounds of
/// redraw.hpp.
template <class T, int axes, bool partial>
[[gnu::always_inline]] inline void end_redraw_aged(const AgedMotion<T, axes>& motion,
                                                   const BlockOutput<T>& output, T* new_age, std::uint32_t i,
                                                   const T* row_weights, const Walk<T>& walk,
                                                   RowSums<T>& sums) {
  const Lanes<T> none(T(0));
  const Weights<T, partial> weights(row_weights);
  const std::uint32_t w = i % block_size;
  const Lanes<T> path = load(walk.path + w);
  const Mask<T> snapped = path < motion.length;
  const auto walked = [&](const T* column) { return select_lanes(snapped, load(column + w), none); };
  const AfterSnaps<T> land{walked(walk.landed), walked(walk.squares), walked(walk.count)};
  add_aged_pass<T, axes>(motion, i, path, weights, sums);
  put_aged<T, axes>(motion, output, new_age, i, path, snapped, land, weights, sums);
}

}  // namespace
}  // namespace bristle::detail
