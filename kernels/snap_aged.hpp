// The snap of a bristle that ages, for a vector of them: snap.hpp with a limit that grows with the age
// (ageing.hpp, core/patches/AGEING.md).
#pragma once

#include "ageing.hpp"
#include "snap.hpp"

namespace bristle::detail {
namespace {

/// What all bristles of a block share in a step.
template <class T, int axes>
struct AgedMotion : BlockMotion<T, axes, true> {
  T* age;
  Lanes<T> before, after;  ///< aged since the block's last rewrite: when the step begins, when it ends
  AgeingLaw<T> ageing;

  Lanes<T> end_age(std::uint32_t i) const { return load(age + i) + after; }
  /// How far the bristles at i bend before they snap, at the end of the step.
  Lanes<T> end_limit(std::uint32_t i, Lanes<T> fresh) const {
    return this->residual.left + fresh * growth<T>(ageing, positive_part(end_age(i)));
  }

  /// Which of the bristles at i are beyond their limit at the end of the step: not without being beyond the
  /// fresh one, which costs no logarithm.
  Mask<T> beyond_at(std::uint32_t i) const {
    const Mask<T> beyond = BlockMotion<T, axes, true>::beyond_at(i);
    if (!xsimd::any(beyond)) return beyond;
    const Lanes<T> limit = end_limit(i, load(this->delta + i) - this->residual.left);
    const Lanes<T> x = load(this->zx + i) + this->p1x;
    if constexpr (axes == 1) {
      return beyond & (xsimd::abs(x) > limit);
    } else {
      const Lanes<T> y = load(this->zy + i) + this->p1y;
      return beyond & (x * x + y * y > limit * limit);
    }
  }

  Lanes<T> margin_at(std::uint32_t i) const {
    const Lanes<T> x = load(this->zx + i) + this->p1x;
    const Lanes<T> limit = end_limit(i, load(this->delta + i) - this->residual.left) *
                           Lanes<T>(T(1) - 16 * std::numeric_limits<T>::epsilon());
    if constexpr (axes == 1) {
      return limit - xsimd::abs(x);
    } else {
      const Lanes<T> y = load(this->zy + i) + this->p1y;
      return limit - root(x * x + y * y);
    }
  }
};

/// The first pass, and what slipped at its end: |z|^2 there less that of the residual.
template <class T>
struct AgedPass : FirstPass<T> {
  Lanes<T> squares;
};

template <class T, int axes, bool partial>
inline AgedPass<T> aged_pass(const AgedMotion<T, axes>& motion, std::uint32_t i, Lanes<T> weight) {
  const Lanes<T> none(T(0));
  AgedPass<T> pass;
  pass.start_x = load(motion.zx + i) + motion.p0x;
  pass.start_y = none;
  Bent<Lanes<T>> bent{pass.start_x * motion.ex, none};
  if constexpr (axes == 2) {
    pass.start_y = load(motion.zy + i) + motion.p0y;
    bent.along = pass.start_x * motion.ex + pass.start_y * motion.ey;
    const Lanes<T> aside = pass.start_x * motion.ey - pass.start_y * motion.ex;
    bent.aside2 = aside * aside;
  }
  const Lanes<T> fresh = load(motion.delta + i) - motion.residual.left;
  Lanes<T> way = way_to_circle<T, axes>(bent, motion.end_limit(i, fresh));
  if constexpr (partial) way = select_lanes(weight > none, way, motion.length);
  pass.snaps = way < motion.length;
  if (xsimd::any(pass.snaps))
    way = aged_way<T, axes>(motion.ageing, bent, motion.residual.left, fresh,
                            load(motion.age + i) + motion.before, way, pass.snaps);
  pass.path = least(way, motion.length);
  const Lanes<T> reached = bent.along + pass.path;
  const Lanes<T> left2 = motion.residual.left * motion.residual.left;
  pass.squares = select_lanes(pass.snaps, (reached * reached + bent.aside2) - left2, none);
  return pass;
}

template <class T, int axes, bool partial>
inline void add_aged_pass(const AgedPass<T>& pass, const Weights<T, partial>& weights, RowSums<T>& sums) {
  weights.add(sums.passed[0], pass.start_x * pass.path);
  if constexpr (axes == 2) weights.add(sums.passed[1], pass.start_y * pass.path);
  weights.add(sums.squares, pass.squares);
}

/// Books what came after the first pass and writes where the bristles at i have come to, and how old they
/// are.
template <class T, int axes, bool partial>
inline void put_aged(const AgedMotion<T, axes>& motion, const BlockOutput<T>& output, T* new_age,
                     std::uint32_t i, Lanes<T> path, Mask<T> snapped, const AfterSnaps<T>& land,
                     const Weights<T, partial>& weights, RowSums<T>& sums) {
  put_snapped<T, axes, true, true>(motion, output, i, path, snapped, land, weights, sums);
  Lanes<T> age =
      select_lanes(snapped, Lanes<T>(motion.ageing.per_length) * land.deflection, motion.end_age(i));
  age = least(age, Lanes<T>(static_cast<T>(oldest)));
  if constexpr (partial) age = select_lanes(weights.weight > Lanes<T>(T(0)), age, Lanes<T>(T(0)));
  age.store_aligned(new_age + i % block_size);
}

/// Keep: at constant velocity every way from snap to snap is alike.
template <class T, int axes, bool partial>
[[gnu::always_inline]] inline void advance_keep_aged(const AgedMotion<T, axes>& motion,
                                                     const BlockOutput<T>& output, T* new_age,
                                                     std::uint32_t i, const T* row_weights, bool again,
                                                     RowSums<T>& sums) {
  const Lanes<T> none(T(0));
  const Weights<T, partial> weights(row_weights);
  const AgedPass<T> pass = aged_pass<T, axes, partial>(motion, i, weights.weight);
  const Lanes<T> rest = motion.length - pass.path;
  AfterSnaps<T> land{rest, none, none};
  if (again) {
    const Lanes<T> way = aged_length<T>(motion.ageing, load(motion.delta + i) - motion.residual.left, rest);
    land.count = whole_part(divide(rest, way));
    land.deflection = least(positive_part(rest - land.count * way), way);
    land.squares = land.count * (way * way);
  }
  add_aged_pass<T, axes>(pass, weights, sums);
  put_aged<T, axes>(motion, output, new_age, i, pass.path, pass.snaps, land, weights, sums);
}

/// Redraw, before the walk by rounds: the first pass. Returns whether any bristle snaps.
template <class T, int axes, bool partial>
[[gnu::always_inline]] inline bool begin_redraw_aged(const AgedMotion<T, axes>& motion, std::uint32_t i,
                                                     const T* row_weights, Walk<T>& walk, RowSums<T>& sums) {
  const Weights<T, partial> weights(row_weights);
  const AgedPass<T> pass = aged_pass<T, axes, partial>(motion, i, weights.weight);
  pass.path.store_aligned(walk.path + i % block_size);
  add_aged_pass<T, axes>(pass, weights, sums);
  return xsimd::any(pass.snaps);
}

/// Redraw, after the walk.
template <class T, int axes, bool partial>
[[gnu::always_inline]] inline void end_redraw_aged(const AgedMotion<T, axes>& motion,
                                                   const BlockOutput<T>& output, T* new_age, std::uint32_t i,
                                                   const T* row_weights, const Walk<T>& walk,
                                                   RowSums<T>& sums) {
  const Lanes<T> none(T(0));
  const std::uint32_t w = i % block_size;
  const Lanes<T> path = load(walk.path + w);
  const Mask<T> snapped = path < motion.length;
  const auto walked = [&](const T* column) { return select_lanes(snapped, load(column + w), none); };
  const AfterSnaps<T> land{walked(walk.landed), walked(walk.squares), walked(walk.count)};
  put_aged<T, axes>(motion, output, new_age, i, path, snapped, land, Weights<T, partial>(row_weights), sums);
}

}  // namespace
}  // namespace bristle::detail
