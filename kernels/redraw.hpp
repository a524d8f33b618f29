// Motion of bristles after their first snap in a step, under SnapRule::redraw: each snap samples a new snap
// length.
//
// A bristle with path left samples a length. If the path is shorter than this length, the bristle is bent
// until the step ends; otherwise it snaps and samples again. Three methods do this, chosen by speed:
//
// - walk_in_registers, vector by vector, for uniform, normal and lognormal lengths in steps in which many
//   bristles snap once or twice;
// - rounds, in other steps: a round samples one length for each bristle of the block, eight vectors at once.
//   Latencies then overlap, and no branch depends on a single bristle. Vectors whose bristles have all
//   arrived at the end of their path are left out;
// - jumps, for long paths: the state at their end is sampled from its distribution (core/MODEL.md, "Jumps").
#pragma once

#include "ageing.hpp"
#include "bundle.hpp"
#include "lanes.hpp"
#include "law.hpp"

namespace bristle::detail {
namespace {

/// Offset just behind the bristles of a block. It stands for a missing vector in a bundle that is not full.
constexpr std::uint32_t nowhere = block_size;

/// State of a block's bristles after their first snap, while they have path left. For bristles that do not
/// snap only `path` is valid.
template <class T>
struct Walk {
  static constexpr bool ages = false;
  static constexpr std::uint32_t size = block_size + lane_count;
  /// Path of the bristle up to its first snap. For a bristle that does not snap, the length of the step.
  alignas(64) T path[size];
  alignas(64) T landed[size];   ///< deflection along the motion at the end of the step
  alignas(64) T squares[size];  ///< sum of squared snap lengths over the bristle's snaps after the first
  alignas(64) T count[size];    ///< number of the bristle's snaps after the first
  /// Variance of `squares` that is missing after jumps, because a jump adds only the mean of the sum over the
  /// snaps that it skips.
  alignas(64) T variance[size];

  // Working memory of the methods that do not finish a path vector by vector:
  alignas(
      64) T remaining[size];   ///< path left to the bristle; negative once it has arrived at the path's end
  alignas(64) T length[size];  ///< snap length that the bristle has at the end of the path
  alignas(64) std::uint32_t state[size];

  void clear(std::uint32_t i) {
    T* const columns[] = {landed, squares, count, variance};
    for (T* column : columns) put_lanes(column + i, Lanes<T>(T(0)));
  }
  void clear_nowhere() {
    clear(nowhere);
    put_lanes(remaining + nowhere, Lanes<T>(T(0)));
    put_lanes(length + nowhere, Lanes<T>(T(0)));
    std::memset(state + nowhere, 0, sizeof(std::uint32_t) * lane_count);
  }
};

/// State of ageing bristles after their first snap. `length` is the fresh snap length. `squares` adds up the
/// squared paths from snap to snap.
template <class T>
struct AgedWalk : Walk<T> {
  static constexpr bool ages = true;
  AgeingLaw<T> ageing;
  /// Largest factor by which ageing can lengthen a snap length (KernelStep::largest_growth).
  T largest_growth;
};

/// List of the vectors of a block in which a bristle snaps, by their offsets in the block.
template <class T>
struct VectorList {
  std::uint32_t offset[block_size / width_of<T> + 1];
  std::uint32_t size = 0;

  /// Appends the offset w of a vector of bristles to the list if `wanted`, that is, if one of them snaps. Has
  /// no branch, because branches on snaps cannot be predicted.
  void add_if(bool wanted, std::uint32_t w) {
    offset[size] = w;
    size += wanted ? 1u : 0u;
  }
};

/// Columns of one block: snap lengths and random states before the step, and the memory for the new ones.
template <class T>
struct RedrawColumns {
  const T* delta;
  const std::uint32_t* random;
  T* new_delta;
  std::uint32_t* new_random;
};

/// Offsets of the eight vectors of a bundle in the columns of their block.
template <class T>
struct BundleOffsets {
  std::uint32_t i[bundle_size];

  Bundle<T> load_from(const T* column) const {
    Bundle<T> out;
    for (std::uint32_t k = 0; k < bundle_size; ++k) out.v[k] = load(column + i[k]);
    return out;
  }
  void store_to(T* column, Bundle<T> x) const {
    for (std::uint32_t k = 0; k < bundle_size; ++k) put_lanes(column + i[k], x.v[k]);
  }
  /// Advances the random state of each masked lane and returns the next random number.
  Bundle<T> next_random(BundleMask<T> which, Walk<T>& walk) const {
    Bundle<T> share;
    for (std::uint32_t k = 0; k < bundle_size; ++k) {
      RandomStates<T> states(walk.state + i[k]);
      share.v[k] = states.next(which.v[k]);
      states.store(walk.state + i[k]);
    }
    return share;
  }
};

/// Samples, in the masked lanes, the ageing bristle at the end of a long slide. Its fresh length `met` comes
/// from the length-biased law, because long paths are likelier to be found; it is accepted with a probability
/// proportional to (path between snaps) / met. Returns that path.
template <class T>
Bundle<T> meet_aged(const KernelLaw& law, const BundleOffsets<T>& at, BundleMask<T> open, AgedWalk<T>& walk,
                    Bundle<T>& met) {
  const Bundle<T> none(T(0));
  const Bundle<T> growth(walk.largest_growth);
  met = Bundle<T>(T(1));
  Bundle<T> path(T(1));
  for (int n = 0; n < most_trials && any_lane(open); ++n) {
    Bundle<T> delta;
    if (law.kind == law_exponential) {
      const Bundle<T> first = natural_log<T>(at.next_random(open, walk));
      const Bundle<T> second = natural_log<T>(at.next_random(open, walk));
      delta = clamp_length<T>(law, Bundle<T>(static_cast<T>(law.location)) * (none - (first + second)));
    } else {
      delta = length_met<T>(law, at.next_random(open, walk));
    }
    const Bundle<T> along = aged_length<T>(walk.ageing, delta, growth * delta);
    met = select_lanes(open, delta, met);
    path = select_lanes(open, along, path);
    open = open & (at.next_random(open, walk) * (growth * delta) > along);
  }
  return path;
}

/// Shortens long paths by jumps over many snaps: samples the state of their bristles at the end, or close to
/// it. Returns the paths left.
template <class T, bool sums, class AnyWalk>
[[gnu::noinline]] Bundle<T> jump(const KernelLaw& law, const BundleOffsets<T>& at, Bundle<T> remaining,
                                 AnyWalk& walk) {
  const auto constant = [](double x) { return Bundle<T>(static_cast<T>(x)); };
  const Bundle<T> none(T(0));
  const Bundle<T> one(T(1));
  [[maybe_unused]] Bundle<T> squares = none;
  [[maybe_unused]] Bundle<T> count = none;
  [[maybe_unused]] Bundle<T> variance = none;

  const BundleMask<T> far = remaining > constant(law.stationary_from);
  if (any_lane(far)) {
    // Samples a bristle of steady sliding at the end of the path. Its snap length has the length-biased law,
    // and the path since its last snap is a uniformly distributed share of that length.
    const bool memoryless = law.kind == law_exponential;
    Bundle<T> met;
    Bundle<T> age;
    Bundle<T> reach;
    if constexpr (AnyWalk::ages) {
      reach = meet_aged<T>(law, at, far, walk, met);
      age = least(at.next_random(far, walk) * reach, remaining);
    } else {
      const Bundle<T> u = at.next_random(far, walk);
      const Bundle<T> v = at.next_random(far, walk);
      if (memoryless) {
        age = constant(law.location) * (none - natural_log<T>(u));
        met = age + most(constant(law.location) * (none - natural_log<T>(v)), constant(law.shortest));
      } else {
        met = length_met<T>(law, u);
        age = v * met;
      }
      met = met - positive_part(age - remaining);
      age = least(age, remaining);
      reach = met;
    }
    if constexpr (sums) {
      const Bundle<T> jumped = remaining - age;
      Bundle<T> more = constant(law.squares_per_length) * jumped + constant(law.squares_offset);
      Bundle<T> spread = constant(law.variance_per_length) * jumped + constant(law.variance_offset);
      if (memoryless && !AnyWalk::ages) {
        // Computes mean and variance of the sum of squared exponential snap lengths exactly, which is
        // possible for any distance.
        const Bundle<T> x = jumped * constant(law.inverse_mean);
        const Bundle<T> e = exponential<T>(none - least(x, constant(80.0)));
        const Bundle<T> m2 = constant(law.mean * law.mean);
        more = m2 * (constant(2.0) * (x - one + e));
        spread = m2 * m2 *
                 (constant(8.0) * x - constant(28.0) +
                  e * (constant(32.0) + x * (constant(16.0) + constant(8.0) * x) - constant(4.0) * e));
      }
      const Bundle<T> snaps_of_jump =
          whole_part(jumped * constant(law.inverse_mean) + constant(law.count_offset + 0.5));
      squares = select_lanes(far, positive_part(more), none);
      variance = select_lanes(far, positive_part(spread), none);
      count = select_lanes(far & (jumped > none), snaps_of_jump, none);
    }
    at.store_to(walk.landed, select_lanes(far, least(age, reach), at.load_from(walk.landed)));
    at.store_to(walk.length, select_lanes(far, met, at.load_from(walk.length)));
    remaining = select_lanes(far, constant(-1.0), remaining);
  }
  for (;;) {
    // Jumps over k snaps at once. The sum of their lengths is sampled by a Cornish-Fisher expansion to the
    // fourth cumulant.
    const BundleMask<T> is_long = remaining > constant(law.jump_from);
    if (!any_lane(is_long)) break;
    const Bundle<T> m1 = constant(law.mean);
    const Bundle<T> inverse = constant(law.inverse_mean);
    const Bundle<T> deviation = constant(law.deviation);
    const Bundle<T> safe = select_lanes(is_long, remaining, constant(law.jump_from));
    const Bundle<T> pad = constant(4.5) * deviation * root(safe * inverse);
    const Bundle<T> k = whole_part((safe - pad) * inverse);
    const Bundle<T> z = normal_quantile<T>(at.next_random(is_long, walk));
    const Bundle<T> s = root(k);
    const Bundle<T> skewness = divide(constant(law.skewness), s);
    const Bundle<T> kurtosis = divide(constant(law.kurtosis), k);
    const Bundle<T> z2 = z * z;
    const Bundle<T> z3 = z2 * z;
    const Bundle<T> w =
        z + skewness * Bundle<T>(T(1) / T(6)) * (z2 - one) +
        kurtosis * Bundle<T>(T(1) / T(24)) * (z3 - constant(3.0) * z) -
        skewness * skewness * Bundle<T>(T(1) / T(36)) * (constant(2.0) * z3 - constant(5.0) * z);
    const Bundle<T> jumped = least(k * m1 + deviation * s * w, safe);
    if constexpr (sums) {
      const Bundle<T> more = k * constant(law.square_mean) + constant(law.square_slope) * (jumped - k * m1);
      squares = select_lanes(is_long, squares + more, squares);
      variance = select_lanes(is_long, variance + k * constant(law.square_residual), variance);
      count = select_lanes(is_long, count + k, count);
    }
    remaining = select_lanes(is_long, remaining - jumped, remaining);
  }
  if constexpr (sums) {
    at.store_to(walk.squares, at.load_from(walk.squares) + squares);
    at.store_to(walk.count, at.load_from(walk.count) + count);
    at.store_to(walk.variance, at.load_from(walk.variance) + variance);
  }
  return remaining;
}

/// State, at the end of a step, of a vector of bristles that snapped in it.
template <class T>
struct AfterSnaps {
  Lanes<T> deflection;  ///< deflection r along the motion at the end of the step
  Lanes<T> squares;     ///< sum of squared snap lengths over the bristle's snaps after the first
  Lanes<T> count;       ///< number of the bristle's snaps after the first
};

/// State of a vector of bristles that have path left, kept in registers.
template <class T>
struct Walker {
  Mask<T> open;
  Lanes<T> remaining;
  Lanes<T> delta;  ///< snap length of the bristle before the walk; after it, that at the path's end
  RandomStates<T> states;
  AfterSnaps<T> land;
};

/// Samples uniform snap lengths for walk_in_registers from random numbers between 0 and 1.
template <class T>
struct UniformLengths {
  static constexpr bool ahead = false;
  Lanes<T> low, span;

  explicit UniformLengths(const KernelLaw& law)
      : low(static_cast<T>(law.location)), span(static_cast<T>(law.scale)) {}
  Lanes<T> length(Lanes<T> share) const { return low + span * share; }
};
/// Samples normal and lognormal snap lengths for walk_in_registers. Looks up all vectors, out of line, before
/// the first is used, so that the latencies of the loads overlap.
template <class T>
struct CellLengths {
  static constexpr bool ahead = true;
  const double* table;

  explicit CellLengths(const KernelLaw& law) : table(law.table) {}
  template <std::uint32_t together>
  [[gnu::noinline]] static void fill(const double* table, Lanes<T> (&shares)[together]) {
#pragma GCC unroll 8
    for (Lanes<T>& x : shares) x = length_of_cell<T>(table, x);
  }
};

/// Moves several vectors of bristles from snap to snap, side by side, because each sampled length of a vector
/// waits for the one before. For laws that are sampled fast. Samples the first `rounds` lengths whether
/// needed or not: a branch that cannot be predicted costs more.
template <class T, std::uint32_t together, class Lengths>
[[gnu::always_inline]] inline void walk_in_registers(const Lengths& lengths, std::uint32_t rounds,
                                                     Walker<T> (&walkers)[together]) {
  const Lanes<T> none(T(0));
  bool more = true;
  for (std::uint32_t n = 0; n < rounds || more; ++n) {
    [[maybe_unused]] Lanes<T> drawn_ahead[together];
    if constexpr (Lengths::ahead) {
#pragma GCC unroll 8
      for (std::uint32_t k = 0; k < together; ++k) drawn_ahead[k] = walkers[k].states.next(walkers[k].open);
      Lengths::fill(lengths.table, drawn_ahead);
    }
    Mask<T> any = walkers[0].open;
#pragma GCC unroll 8
    for (std::uint32_t k = 0; k < together; ++k) {
      Walker<T>& w = walkers[k];
      Lanes<T> sampled;
      if constexpr (Lengths::ahead)
        sampled = drawn_ahead[k];
      else
        sampled = lengths.length(w.states.next(w.open));
      w.land.deflection = select_lanes(w.open, w.remaining, w.land.deflection);
      w.delta = select_lanes(w.open, sampled, w.delta);
      w.remaining = w.remaining - sampled;
      w.open = w.open & (w.remaining >= none);
      w.land.squares = select_lanes(w.open, w.land.squares + sampled * sampled, w.land.squares);
      w.land.count = select_lanes(w.open, w.land.count + Lanes<T>(T(1)), w.land.count);
      any = k == 0 ? w.open : any | w.open;
    }
    more = any_lane(any);
  }
}

/// Gives a vector of bristles that have just snapped their next snap lengths, `sampled`. `remaining` is the
/// path left to the end of the step, negative for bristles that have not snapped. A bristle whose path `path`
/// to the next snap exceeds `remaining` has arrived; the others snap again. Returns whether any does.
template <class T, bool sums>
[[gnu::always_inline]] inline bool take_length(Lanes<T> remaining, Lanes<T> sampled, Lanes<T> path,
                                               std::uint32_t i, Walk<T>& walk) {
  const Lanes<T> none(T(0));
  const Mask<T> open = remaining >= none;
  const Lanes<T> after = remaining - path;
  const Mask<T> snaps = open & (after >= none);
  put_lanes(walk.landed + i, select_lanes(open, remaining, load(walk.landed + i)));
  put_lanes(walk.length + i, select_lanes(open, sampled, load(walk.length + i)));
  put_lanes(walk.remaining + i, select_lanes(open, after, remaining));
  if constexpr (sums) {
    const Lanes<T> squares = load(walk.squares + i);
    const Lanes<T> count = load(walk.count + i);
    put_lanes(walk.squares + i, select_lanes(snaps, squares + path * path, squares));
    put_lanes(walk.count + i, select_lanes(snaps, count + Lanes<T>(T(1)), count));
  }
  return any_lane(snaps);
}

/// Moves the bristles of all listed vectors to the end of the step by rounds, eight vectors at once.
template <class T, bool sums, bool has_residual, class AnyWalk>
[[gnu::noinline]] void walk_rounds(const KernelLaw& law, T length, T residual,
                                   const RedrawColumns<T>& columns, const VectorList<T>& snapping,
                                   AnyWalk& walk) {
  const bool may_jump = length > static_cast<T>(law.jump_from);
  VectorList<T> open = snapping;
  for (std::uint32_t n = 0; n < snapping.size; ++n) {
    const std::uint32_t i = snapping.offset[n];
    const Lanes<T> path = load(walk.path + i);
    const Lanes<T> whole(length);
    put_lanes(walk.remaining + i, select_lanes(path < whole, whole - path, Lanes<T>(T(-1))));
    put_lanes(walk.length + i, load(columns.delta + i));
    std::memcpy(walk.state + i, columns.random + i, width_of<T> * sizeof(std::uint32_t));
    walk.clear(i);
  }
  walk.clear_nowhere();
  while (open.size > 0) {
    std::uint32_t still = 0;
    for (std::uint32_t n = 0; n < open.size; n += bundle_size) {
      BundleOffsets<T> at;
      const std::uint32_t filled = open.size - n < bundle_size ? open.size - n : bundle_size;
      for (std::uint32_t k = 0; k < bundle_size; ++k) at.i[k] = k < filled ? open.offset[n + k] : nowhere;
      Bundle<T> remaining = at.load_from(walk.remaining);
      for (std::uint32_t k = filled; k < bundle_size; ++k) remaining.v[k] = Lanes<T>(T(-1));
      if (may_jump && any_lane(remaining > Bundle<T>(static_cast<T>(law.jump_from))))
        remaining = jump<T, sums>(law, at, remaining, walk);
      if (!any_lane(remaining >= Bundle<T>(T(0))))
        continue;  // all bristles have jumped to the end of the path
      const Bundle<T> sampled = length_at<T>(law, at.next_random(remaining >= Bundle<T>(T(0)), walk));
      Bundle<T> path = sampled;
      if constexpr (AnyWalk::ages) path = aged_length<T>(walk.ageing, sampled, remaining);
      for (std::uint32_t k = 0; k < filled; ++k) {
        open.offset[still] = at.i[k];
        still += take_length<T, sums>(remaining.v[k], sampled.v[k], path.v[k], at.i[k], walk) ? 1u : 0u;
      }
    }
    open.size = still;
  }
  for (std::uint32_t n = 0; n < snapping.size; ++n) {
    const std::uint32_t i = snapping.offset[n];
    Lanes<T> limit = load(walk.length + i);
    if constexpr (has_residual)
      limit = select_lanes(load(walk.path + i) < Lanes<T>(length), Lanes<T>(residual) + limit, limit);
    put_lanes(columns.new_delta + i, limit);
    std::memcpy(columns.new_random + i, walk.state + i, width_of<T> * sizeof(std::uint32_t));
  }
}

}  // namespace
}  // namespace bristle::detail
