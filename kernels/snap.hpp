// The snap of a bristle, in vectors: the physics of a step.
//
// A step moves the patch by `length` along the unit vector e. A bristle bends until its deflection reaches
// its snap length, after the path tau. There it snaps, and along the path left it bends again, perhaps to
// further snaps (core/MODEL.md, section 3, with the symbols). With a residual length, a bristle snaps when it
// is bent by residual and snap length together, and stays bent by the residual along e
// (core/patches/RUBBING.md).
#pragma once

#include <limits>

#include "lanes.hpp"
#include "redraw.hpp"

namespace bristle::detail {
namespace {

/// First pass over a vector of bristles: the path of each from the start of the step to its first snap, or to
/// the end.
template <class T>
struct FirstPass {
  Lanes<T> start_x, start_y;
  Lanes<T> path;  ///< length of the path up to the snap, or of the whole step
  Mask<T> snaps;
};

/// Formulas for a snap, with a residual deflection or without. `limit` is an entry of the column `delta`:
/// residual + snap length.
template <class T, bool has_residual>
struct Residual {
  explicit Residual(Lanes<T>) {}
  Lanes<T> length_of(Lanes<T> limit) const { return limit; }
  Lanes<T> limit_of(Lanes<T> length) const { return length; }
  Lanes<T> squares_of(Lanes<T> limit) const { return limit * limit; }
  Lanes<T> squares_over(Lanes<T> squares, Lanes<T>) const { return squares; }
  Lanes<T> passed_over(Lanes<T> squares, Lanes<T>) const { return squares; }
};

template <class T>
struct Residual<T, true> {
  Lanes<T> left;

  explicit Residual(Lanes<T> residual) : left(residual) {}
  Lanes<T> length_of(Lanes<T> limit) const { return limit - left; }
  Lanes<T> limit_of(Lanes<T> length) const { return left + length; }
  /// Returns twice the energy that a snap dissipates, divided by the stiffness.
  Lanes<T> squares_of(Lanes<T> limit) const { return (limit - left) * (limit + left); }
  /// Returns twice the energy that many snaps dissipate, divided by the stiffness, from their sums of delta^2
  /// and delta.
  Lanes<T> squares_over(Lanes<T> squares, Lanes<T> lengths) const {
    return squares + (left + left) * lengths;
  }
  /// Returns twice the integral of the deflection along `path` with a residual, from its value without one.
  Lanes<T> passed_over(Lanes<T> integral, Lanes<T> path) const { return integral + (left + left) * path; }
};

/// Data that all bristles of a block share in a step: columns, direction, and displacement since the block's
/// last rewrite at the start (p0) and at the end (p1) of the step. As a local variable they stay in
/// registers.
template <class T, int axes, bool has_residual>
struct BlockMotion {
  T* zx;
  T* zy;
  T* delta;
  std::uint32_t* random;
  Lanes<T> ex, ey, length, p0x, p0y, p1x, p1y;
  Residual<T, has_residual> residual;

  /// Returns a mask of the bristles from i on whose deflection at the end of the step, if none snaps, exceeds
  /// `limit`.
  Mask<T> exceeds(std::uint32_t i, Lanes<T> limit) const {
    const Lanes<T> x = load(zx + i) + p1x;
    if constexpr (axes == 1) {
      return magnitude(x) > limit;
    } else {
      const Lanes<T> y = load(zy + i) + p1y;
      return x * x + y * y > limit * limit;
    }
  }

  /// Returns by how much `limit` exceeds the deflection of each bristle at the end of the step.
  Lanes<T> left_to(std::uint32_t i, Lanes<T> limit) const {
    const Lanes<T> x = load(zx + i) + p1x;
    if constexpr (axes == 1) {
      return limit - magnitude(x);
    } else {
      const Lanes<T> y = load(zy + i) + p1y;
      return limit - root(x * x + y * y);
    }
  }

  /// Returns a mask of the bristles from i on that would end the step beyond their snap length. If a block
  /// has none, nothing of it is written.
  Mask<T> beyond_at(std::uint32_t i) const { return exceeds(i, load(delta + i)); }

  /// Returns how much deflection each bristle has left before its snap at the end of the step, less the
  /// rounding error of beyond_at().
  Lanes<T> margin_at(std::uint32_t i) const {
    return left_to(i, load(delta + i) * Lanes<T>(T(1) - 4 * std::numeric_limits<T>::epsilon()));
  }

  /// Returns tau, the path along the motion after which the deflection is as long as `limit`. The equation
  /// has two roots; this form cannot give the wrong one.
  Lanes<T> path_to_snap(Lanes<T> start_x, Lanes<T> start_y, Lanes<T> limit) const {
    if constexpr (axes == 1) {
      return positive_part(limit - start_x * ex);
    } else {
      const Lanes<T> along = start_x * ex + start_y * ey;
      const Lanes<T> aside = start_x * ey - start_y * ex;
      const Lanes<T> limit2 = limit * limit;
      const Lanes<T> chord2 = limit2 - aside * aside;
      // Skips the square root if all bristles are bent exactly along the motion, for which it is `limit` to
      // the last bit.
      const Lanes<T> chord = any_lane(chord2 != limit2) ? root(positive_part(chord2)) : limit;
      return positive_part(chord - along);
    }
  }

  /// Finds the path up to the first snap for a vector of bristles. `partial`: some have weight 0 and do not
  /// snap.
  template <bool partial>
  FirstPass<T> first_pass(std::uint32_t i, Lanes<T> weight) const {
    const Lanes<T> start_x = load(zx + i) + p0x;
    Lanes<T> start_y(T(0));
    if constexpr (axes == 2) start_y = load(zy + i) + p0y;
    Lanes<T> path = least(path_to_snap(start_x, start_y, load(delta + i)), length);
    if constexpr (partial) path = select_lanes(weight > Lanes<T>(T(0)), path, length);
    return {start_x, start_y, path, path < length};
  }
};

/// Destination of the rewritten deflections of a block: its own columns or, in a trial step, scratch memory.
template <class T>
struct BlockOutput {
  T* zx;
  T* zy;
  T* delta;
  std::uint32_t* random;
};

/// Sums over the bristles of a block, one for each lane, up to the first snap of each bristle.
template <class T>
struct PassSums {
  Lanes<T> passed[2];  ///< sum over bristles of path x deflection at the start
  /// Sum over the snaps of delta^2, with a residual of (residual + delta)^2 - residual^2.
  Lanes<T> squares;

  PassSums() { passed[0] = passed[1] = squares = Lanes<T>(T(0)); }
  /// Copies vector by vector. A copy of whole arrays would keep a local variable in memory, which costs eight
  /// cycles for each addition.
  PassSums& operator=(const PassSums& other) {
    passed[0] = other.passed[0];
    passed[1] = other.passed[1];
    squares = other.squares;
    return *this;
  }
};

/// Sums over the bristles of a block, one for each lane, over the whole step.
template <class T>
struct RowSums : PassSums<T> {
  Lanes<T> stored[2];  ///< sum of the bristles' deflections at the end of the step
  Lanes<T> along;      ///< sum over all passes of the squared deflection along the motion
  Lanes<T> further;    ///< sum of delta^2, as in `squares`, over all snaps of a bristle but the first
  Lanes<T> snaps;

  RowSums() { stored[0] = stored[1] = along = further = snaps = Lanes<T>(T(0)); }
  RowSums& operator=(const RowSums& other) {
    PassSums<T>::operator=(other);
    stored[0] = other.stored[0];
    stored[1] = other.stored[1];
    along = other.along;
    further = other.further;
    snaps = other.snaps;
    return *this;
  }
};

/// Weights of a vector of bristles: all 1, except in the last row of the contact.
template <class T, bool partial>
struct Weights {
  Lanes<T> weight;

  explicit Weights(const T* weights) : weight(T(1)) {
    if constexpr (partial) weight = load(weights);
  }
  void add(Lanes<T>& sum, Lanes<T> x) const {
    if constexpr (partial) x = x * weight;
    sum = sum + x;
  }
};

/// Writes deflections at the end of the step. Bristles out of contact stay straight.
template <class T, int axes, bool partial>
inline void put_deflections(const BlockOutput<T>& output, std::uint32_t w, Lanes<T> x, Lanes<T> y,
                            const Weights<T, partial>& weights, RowSums<T>& sums) {
  if constexpr (partial) {
    const Mask<T> active = weights.weight > Lanes<T>(T(0));
    x = select_lanes(active, x, Lanes<T>(T(0)));
    y = select_lanes(active, y, Lanes<T>(T(0)));
  }
  put_lanes(output.zx + w, x);
  weights.add(sums.stored[0], x);
  if constexpr (axes == 2) {
    put_lanes(output.zy + w, y);
    weights.add(sums.stored[1], y);
  }
}

/// Finds the path up to the first snap, or the whole step, for each bristle of the vector at i. Adds
/// deflection and energy along that path to `sums`.
template <class T, int axes, bool mean, bool energy, bool residual, bool partial>
[[gnu::always_inline]] inline FirstPass<T> begin_pass(const BlockMotion<T, axes, residual>& motion,
                                                      std::uint32_t i, const T* row_weights,
                                                      PassSums<T>& sums) {
  const Weights<T, partial> weights(row_weights);
  const FirstPass<T> pass = motion.template first_pass<partial>(i, weights.weight);
  if constexpr (mean) {
    weights.add(sums.passed[0], pass.start_x * pass.path);
    if constexpr (axes == 2) weights.add(sums.passed[1], pass.start_y * pass.path);
  }
  if constexpr (energy)
    weights.add(sums.squares,
                select_lanes(pass.snaps, motion.residual.squares_of(load(motion.delta + i)), Lanes<T>(T(0))));
  return pass;
}

/// Adds the motion after the first snap to the sums, and writes the deflections of the bristles at i. `land`
/// is 0 for bristles that did not snap.
template <class T, int axes, bool mean, bool energy, bool residual, bool partial>
inline void put_snapped(const BlockMotion<T, axes, residual>& motion, const BlockOutput<T>& output,
                        std::uint32_t i, Lanes<T> path, Mask<T> snapped, const AfterSnaps<T>& land,
                        const Weights<T, partial>& weights, RowSums<T>& sums) {
  const Lanes<T> none(T(0));
  const Lanes<T> r = land.deflection;
  // Needs no selection of lanes: the path left, r, is 0 for bristles that did not snap.
  const Lanes<T> left = motion.length - path;
  if constexpr (mean)
    weights.add(sums.along, motion.residual.passed_over((path * path + land.squares) + r * r, left));
  if constexpr (energy) {
    weights.add(sums.further, motion.residual.squares_over(land.squares, left - r));
    sums.snaps = sums.snaps + select_lanes(snapped, Lanes<T>(T(1)) + land.count, none);
  }
  Lanes<T> next_y = none;
  const Lanes<T> bent = motion.residual.limit_of(r);
  const Lanes<T> next_x = select_lanes(snapped, bent * motion.ex, load(motion.zx + i) + motion.p1x);
  if constexpr (axes == 2) next_y = select_lanes(snapped, bent * motion.ey, load(motion.zy + i) + motion.p1y);
  put_deflections<T, axes, partial>(output, i % block_size, next_x, next_y, weights, sums);
}

/// Returns where bristles land that snap again after every `length` along the path left, `remaining`.
template <class T>
[[gnu::always_inline]] inline AfterSnaps<T> land_even(Lanes<T> remaining, Lanes<T> length) {
  AfterSnaps<T> land;
  land.count = whole_part(divide(remaining, length));
  land.deflection = least(positive_part(remaining - land.count * length), length);
  land.squares = land.count * (length * length);
  return land;
}

/// Moves the bristles at i through the step under SnapRule::keep, where each snaps again after every delta.
/// For blocks that are rewritten, after begin_pass(). `again`: the step is long enough for a second snap.
template <class T, int axes, bool mean, bool energy, bool residual, bool partial, bool again>
[[gnu::always_inline]] inline void end_keep(const BlockMotion<T, axes, residual>& motion,
                                            const BlockOutput<T>& output, std::uint32_t i, Lanes<T> path,
                                            const T* row_weights, RowSums<T>& sums) {
  const Lanes<T> none(T(0));
  const Lanes<T> delta = motion.residual.length_of(load(motion.delta + i));

  // Computes the path left R = length - tau, the number of later snaps floor(R / delta), and the deflection
  // left R - floor(R / delta) delta.
  const Lanes<T> remaining = motion.length - path;
  AfterSnaps<T> land{remaining, none, none};
  if constexpr (again) land = land_even<T>(remaining, delta);
  put_snapped<T, axes, mean, energy>(motion, output, i, path, path < motion.length, land,
                                     Weights<T, partial>(row_weights), sums);
}

/// Moves the vectors at i, i + 16 and so on through the step in registers, under SnapRule::redraw; skips
/// none. Each bristle samples at most four uniform lengths; under normal and lognormal laws this serves steps
/// too short for jumps.
template <class T, int axes, bool mean, bool energy, bool residual, bool partial, std::uint32_t together,
          class Lengths>
[[gnu::always_inline]] inline void step_in_registers(const BlockMotion<T, axes, residual>& motion,
                                                     const BlockOutput<T>& output, std::uint32_t i,
                                                     const T* row_weights, const Lengths& lengths,
                                                     std::uint32_t rounds, RowSums<T>& sums) {
  const Lanes<T> none(T(0));
  const Weights<T, partial> weights(row_weights);
  Lanes<T> path[together];
  Walker<T> walkers[together];
#pragma GCC unroll 8
  for (std::uint32_t k = 0; k < together; ++k) {
    const std::uint32_t at = i + k * lane_count;
    const FirstPass<T> pass =
        begin_pass<T, axes, mean, energy, residual, partial>(motion, at, row_weights, sums);
    path[k] = pass.path;
    walkers[k] = {pass.snaps,
                  motion.length - pass.path,
                  load(motion.delta + at),
                  RandomStates<T>(motion.random + at),
                  {none, none, none}};
  }
  walk_in_registers<T>(lengths, rounds, walkers);
#pragma GCC unroll 8
  for (std::uint32_t k = 0; k < together; ++k) {
    const std::uint32_t at = i + k * lane_count;
    const Mask<T> snapped = path[k] < motion.length;
    Lanes<T> limit = walkers[k].delta;
    if constexpr (residual) limit = select_lanes(snapped, motion.residual.limit_of(limit), limit);
    put_lanes(output.delta + at % block_size, limit);
    walkers[k].states.store(output.random + at % block_size);
    put_snapped<T, axes, mean, energy>(motion, output, at, path[k], snapped, walkers[k].land, weights, sums);
  }
}

/// Finds the paths up to the first snap for a block that is then moved by the rounds of redraw.hpp. Returns
/// whether any bristle snaps.
template <class T, int axes, bool mean, bool energy, bool residual, bool partial>
[[gnu::always_inline]] inline bool begin_redraw(const BlockMotion<T, axes, residual>& motion, std::uint32_t i,
                                                const T* row_weights, Walk<T>& walk, RowSums<T>& sums) {
  const FirstPass<T> pass =
      begin_pass<T, axes, mean, energy, residual, partial>(motion, i, row_weights, sums);
  put_lanes(walk.path + i % block_size, pass.path);
  return any_lane(pass.snaps);
}

/// Adds the bristles at i to the sums and writes them, after the rounds of redraw.hpp have moved them to the
/// end of the step.
template <class T, int axes, bool mean, bool energy, bool residual, bool partial>
[[gnu::always_inline]] inline void end_redraw(const BlockMotion<T, axes, residual>& motion,
                                              const BlockOutput<T>& output, std::uint32_t i,
                                              const T* row_weights, const Walk<T>& walk, RowSums<T>& sums) {
  const Lanes<T> none(T(0));
  const std::uint32_t w = i % block_size;
  const Lanes<T> path = load(walk.path + w);
  const Mask<T> snapped = path < motion.length;
  // Takes 0 for bristles without a snap, because their entries of `walk` are not set.
  const auto walked = [&](const T* column) { return select_lanes(snapped, load(column + w), none); };
  AfterSnaps<T> land{walked(walk.landed), none, none};
  if constexpr (mean || energy) land.squares = walked(walk.squares);
  if constexpr (energy) land.count = walked(walk.count);
  put_snapped<T, axes, mean, energy>(motion, output, i, path, snapped, land, Weights<T, partial>(row_weights),
                                     sums);
}

/// Adds, for a vector of bristles, the sum of delta^2 over the snaps after the first, and the variance of
/// this sum that is missing after jumps over many snaps.
template <class T, bool partial>
inline void add_jumped(std::uint32_t i, const T* row_weights, const Walk<T>& walk, Lanes<T> length,
                       Lanes<T>& squares, Lanes<T>& variance) {
  const Lanes<T> none(T(0));
  const Weights<T, partial> weights(row_weights);
  const std::uint32_t w = i % block_size;
  const Mask<T> snapped = load(walk.path + w) < length;
  weights.add(squares, select_lanes(snapped, load(walk.squares + w), none));
  Lanes<T> open = select_lanes(snapped, load(walk.variance + w), none);
  if constexpr (partial) open = open * weights.weight;
  weights.add(variance, open);
}

}  // namespace
}  // namespace bristle::detail
