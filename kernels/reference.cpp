// The scalar reference: a step one bristle at a time, written to be read beside the paper and
// core/MODEL.md. The reference is the instruction set "scalar" of the kernel table. Every other set must
// give the same bits, so the reference rounds as they do: 16 logical lanes for sums, no fused operations.
#include "blocks.hpp"
#include "core/kernel_table.hpp"
#include "far.hpp"
#include "invariants.hpp"
#include "law.hpp"
#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

/// A sum over bristles, as one partial sum for each of 16 lanes, added in the order of all instruction sets.
template <class T>
struct LaneSum {
  T lane[lane_count] = {};
  void add(std::uint32_t i, T x) { lane[i % lane_count] += x; }
  double total() {
    T copy[lane_count];
    for (std::uint32_t k = 0; k < lane_count; ++k) copy[k] = lane[k];
    return static_cast<double>(tree_sum(copy));
  }
};

/// Result of one bristle's motion after its first snap in a step.
template <class T>
struct AfterSnaps {
  T deflection = 0;  ///< deflection r along the motion at the end of the step
  T squares = 0;     ///< sum of squared snap lengths over the bristle's snaps after the first
  T count = 0;       ///< number of the bristle's snaps after the first
  T variance = 0;    ///< variance of `squares` caused by jumps, which add only the mean of the sum over
                     ///< the snaps that they skip
};

/// Moves a bristle along the path R left after its first snap, by SnapRule::keep: in all it snaps
/// n = 1 + floor(R / delta) times, and the rest of the path bends it.
template <class T>
AfterSnaps<T> after_keep(T rest, T delta) {
  AfterSnaps<T> after;
  after.count = whole_part(rest / delta);
  after.deflection = least(most(rest - after.count * delta, T(0)), delta);
  after.squares = after.count * (delta * delta);
  return after;
}

/// Constants of ageing along a walk from snap to snap.
template <class T>
struct Aged {
  AgeingLaw<T> ageing;
  T largest_growth;
};

/// Samples the ageing bristle at the end of a long slide: draws its fresh length `met` from the
/// length-biased law and accepts it with a probability proportional to (path between snaps) / met. Returns
/// that path.
template <class T, class Next>
T meet_bristle(const KernelLaw& law, const Aged<T>& aged, const Next& next, T& met) {
  T way = T(1);
  for (int n = 0; n < most_trials; ++n) {
    if (law.kind == law_exponential) {
      const T first = natural_log<T>(next());
      met = clamp_length<T>(law, static_cast<T>(law.location) * -(first + natural_log<T>(next())));
    } else {
      met = length_met<T>(law, next());
    }
    way = aged_length<T>(aged.ageing, met, aged.largest_growth * met);
    if (!(next() * (aged.largest_growth * met) > way)) break;
  }
  return way;
}

/// Moves a bristle along the path left, by SnapRule::redraw: samples a fresh length after each snap. A long
/// path is jumped: its end is sampled from the distribution.
template <class T, bool ages>
AfterSnaps<T> after_redraw(const KernelLaw& law, const Aged<T>& aged, T rest, T& delta,
                           std::uint32_t& state) {
  const auto next = [&state] {
    state += draw_stride;
    return share_of<T>(mix(state));
  };
  const T jump_from = static_cast<T>(law.jump_from);
  const T m1 = static_cast<T>(law.mean);
  const T inverse = static_cast<T>(law.inverse_mean);
  AfterSnaps<T> after;
  for (;;) {
    if (rest > static_cast<T>(law.stationary_from)) {
      const bool memoryless = !ages && law.kind == law_exponential;
      T met;
      T age;
      if constexpr (ages) {
        const T way = meet_bristle<T>(law, aged, next, met);
        age = least(next() * way, rest);
      } else {
        const T u = next();
        const T v = next();
        const T mean = static_cast<T>(law.location);
        // After a jump over many snaps a bristle has a length-biased snap length and has gone a uniform
        // share of it.
        met = memoryless ? T(0) : length_met<T>(law, u);
        age = v * met;
        if (memoryless) {
          age = mean * -natural_log<T>(u);
          met = age + most(mean * -natural_log<T>(v), static_cast<T>(law.shortest));
        }
        met -= most(age - rest, T(0));
        age = least(age, rest);
      }
      const T jumped = rest - age;
      T more = static_cast<T>(law.squares_per_length) * jumped + static_cast<T>(law.squares_offset);
      T spread = static_cast<T>(law.variance_per_length) * jumped + static_cast<T>(law.variance_offset);
      if (memoryless) {
        const T x = jumped * inverse;
        const T e = exponential<T>(-least(x, T(80)));
        const T mean2 = static_cast<T>(law.mean * law.mean);
        more = mean2 * (T(2) * (x - T(1) + e));
        spread = mean2 * mean2 * (T(8) * x - T(28) + e * (T(32) + x * (T(16) + T(8) * x) - T(4) * e));
      }
      after.squares += most(more, T(0));
      after.variance += most(spread, T(0));
      if (jumped > T(0)) after.count += whole_part(jumped * inverse + static_cast<T>(law.count_offset + 0.5));
      after.deflection = ages ? age : least(age, met);
      delta = met;
      return after;
    }
    if (rest > jump_from) {
      // Jumps over k snaps at once; the sum of their lengths is sampled by a Cornish-Fisher expansion to the
      // fourth cumulant.
      const T deviation = static_cast<T>(law.deviation);
      const T pad = T(4.5) * deviation * root(rest * inverse);
      const T k = whole_part((rest - pad) * inverse);
      BRISTLE_ASSERT(k >= T(1));
      const T z = normal_quantile<T>(next());
      const T s = root(k);
      const T skewness = static_cast<T>(law.skewness) / s;
      const T kurtosis = static_cast<T>(law.kurtosis) / k;
      const T z2 = z * z;
      const T z3 = z2 * z;
      const T w = z + skewness * (T(1) / T(6)) * (z2 - T(1)) + kurtosis * (T(1) / T(24)) * (z3 - T(3) * z) -
                  skewness * skewness * (T(1) / T(36)) * (T(2) * z3 - T(5) * z);
      const T jumped = least(k * m1 + deviation * s * w, rest);
      after.squares +=
          k * static_cast<T>(law.square_mean) + static_cast<T>(law.square_slope) * (jumped - k * m1);
      after.variance += k * static_cast<T>(law.square_residual);
      after.count += k;
      rest -= jumped;
      continue;
    }
    delta = length_at<T>(law, next());
    BRISTLE_ASSERT(delta > T(0));
    const T way = ages ? aged_length<T>(aged.ageing, delta, rest) : delta;
    if (rest < way) {
      after.deflection = rest;
      return after;
    }
    rest -= way;
    after.squares += way * way;
    after.count += T(1);
  }
}

/// Moves an ageing bristle along the path left, by SnapRule::keep: at constant velocity all its paths from
/// snap to snap are equal.
template <class T>
AfterSnaps<T> after_keep_aged(const AgeingLaw<T>& ageing, T rest, T delta) {
  AfterSnaps<T> after;
  const T way = aged_length<T>(ageing, delta, rest);
  after.count = whole_part(rest / way);
  after.deflection = least(most(rest - after.count * way, T(0)), way);
  after.squares = after.count * (way * way);
  return after;
}

template <class T, int axes, bool redraw, bool mean, bool energy, bool residual, bool ages>
void step_block(const PatchView<T>& patch, const Advance& advance, std::uint32_t b, Totals& totals) {
  Block& block = patch.blocks[b];
  const std::uint32_t start = b * block_size;
  const std::uint32_t contact = in_contact(patch);
  const std::uint32_t end = start + block_size < contact ? start + block_size : contact;
  totals.visited += end - start;
  ++totals.blocks_visited;

  write_zero_block<T, axes, redraw, ages>(patch, b);
  // Computes the displacement since the block's last rewrite: a deflection is the stored one plus this.
  const double q0[2] = {displacement(advance.from[0], block.position[0]),
                        displacement(advance.from[1], block.position[1])};
  const double q1[2] = {displacement(advance.to[0], block.position[0]),
                        displacement(advance.to[1], block.position[1])};
  BRISTLE_ASSERT(is_near(q0[0]) && is_near(q0[1]) && is_near(q1[0]) && is_near(q1[1]));
  const T p0[2] = {static_cast<T>(q0[0]), static_cast<T>(q0[1])};
  const T p1[2] = {static_cast<T>(q1[0]), static_cast<T>(q1[1])};
  const T ex = static_cast<T>(advance.direction[0]);
  const T ey = static_cast<T>(advance.direction[1]);
  const T length = static_cast<T>(advance.length);
  const T left = residual ? static_cast<T>(advance.residual) : T(0);  // deflection that a snap leaves

  // Computes the age gained since the block's last rewrite: a bristle's age is the stored one plus this.
  const AgeingLaw<T> ageing = ages ? ageing_of<T>(advance) : AgeingLaw<T>{};
  const BlockAge since = ages ? age_since(advance, patch.since[b]) : BlockAge{};
  const auto end_age = [&](std::uint32_t i) { return patch.age[i] + static_cast<T>(since.after); };
  // Deflection at which bristle i would snap at the end of the step.
  const auto end_limit = [&](std::uint32_t i) {
    return left + (patch.delta[i] - left) * growth<T>(ageing, most(end_age(i), T(0)));
  };

  double stored[2] = {0.0, 0.0};
  double twice_mean[2] = {0.0, 0.0};
  double squares = 0.0;

  const auto beyond_at = [&](std::uint32_t i) {
    if (advance.snaps_all) return true;
    const T x = patch.zx[i] + p1[0];
    const T y = axes == 2 ? patch.zy[i] + p1[1] : T(0);
    const auto beyond = [&](T limit) {
      if constexpr (axes == 1) return x > limit || -x > limit;
      return x * x + y * y > limit * limit;
    };
    if constexpr (ages) return beyond(patch.delta[i]) && beyond(end_limit(i));
    return beyond(patch.delta[i]);
  };
  bool any = false;
  for (std::uint32_t i = start; i < end; ++i) any = any || beyond_at(i);
  // Writes nothing if no bristle snaps, because the displacement since the last rewrite grows by itself.
  if (!any) return;

  if (advance.in_double) {
    const FarSums far =
        far_block<T, axes, redraw, residual, ages>(patch, advance, start, end - start, q0, q1);
    for (int axis = 0; axis < axes; ++axis) {
      stored[axis] = far.stored[axis];
      twice_mean[axis] = far.twice_mean[axis];
    }
    squares = far.squares;
    totals.snaps += to_count(far.snaps);
  } else {
    LaneSum<T> stored_sum[2], passed[2], along_sum, squares_sum, further, jumped, variance, snaps;
    const bool jumps = redraw && (mean || energy) && advance.length > patch.law->jump_from;
    const std::uint32_t key = jumps ? noise_key(patch.draw + start) : 0u;
    for (std::uint32_t i = start; i < end; ++i) {
      const T w = weight_of(patch, i);
      const T start_x = patch.zx[i] + p0[0];
      const T start_y = axes == 2 ? patch.zy[i] + p0[1] : T(0);
      T next_x = patch.zx[i] + p1[0];
      T next_y = axes == 2 ? patch.zy[i] + p1[1] : T(0);
      T limit = patch.delta[i];  // deflection at which the bristle snaps, residual + snap length
      std::uint32_t state = redraw ? patch.draw[i] : 0u;
      [[maybe_unused]] T next_age{};
      T along = start_x * ex;
      T aside = T(0);
      if constexpr (axes == 2) {
        along = start_x * ex + start_y * ey;
        aside = start_x * ey - start_y * ex;
      }
      const Bent<T> start_bent{along, aside * aside};
      // Path to the first snap. With ageing the limit at the end of the step gives a path that is too long,
      // from which aged_way() starts.
      T tau = way_to_circle<T, axes>(start_bent, ages ? end_limit(i) : limit);
      if constexpr (ages) {
        const T age = patch.age[i] + static_cast<T>(since.before);
        tau = aged_way<T, axes>(ageing, start_bent, left, limit - left, age, tau, tau < length);
      }
      const T path = least(tau, length);  // path up to the first snap, or the whole step
      BRISTLE_ASSERT(redraw ? limit >= left : limit > left);
      BRISTLE_ASSERT(path >= T(0) && path <= length);
      AfterSnaps<T> after;
      if constexpr (ages) next_age = end_age(i);
      if (tau < length) {
        T delta = residual ? limit - left : limit;
        if constexpr (ages) {
          const T reached = along + path;
          squares_sum.add(i, ((reached * reached + start_bent.aside2) - left * left) * w);
        } else {
          squares_sum.add(i, (residual ? (limit - left) * (limit + left) : limit * limit) * w);
        }
        if constexpr (redraw)
          after = after_redraw<T, ages>(*patch.law, {ageing, static_cast<T>(advance.largest_growth)},
                                        length - path, delta, state);
        else if constexpr (ages)
          after = after_keep_aged<T>(ageing, length - path, delta);
        else
          after = after_keep<T>(length - path, delta);
        BRISTLE_ASSERT(after.deflection >= T(0) && (ages || after.deflection <= delta));
        if constexpr (ages) next_age = ageing.per_length * after.deflection;
        if constexpr (redraw) limit = residual ? left + delta : delta;
        BRISTLE_ASSERT(after.count >= T(0) && after.squares >= T(0) && after.variance >= T(0));
        const T bent = residual ? left + after.deflection : after.deflection;
        next_x = bent * ex;
        next_y = bent * ey;
        snaps.add(i, T(1) + after.count);
        T slipped = after.squares;
        if constexpr (residual) slipped += (left + left) * ((length - path) - after.deflection);
        further.add(i, slipped * w);
        jumped.add(i, after.squares * w);
        variance.add(i, after.variance * w * w);
      }
      T twice_integral = (path * path + after.squares) + after.deflection * after.deflection;
      if constexpr (residual) twice_integral += (left + left) * (length - path);
      along_sum.add(i, twice_integral * w);
      passed[0].add(i, start_x * path * w);
      passed[1].add(i, start_y * path * w);
      if (advance.commit) {
        patch.zx[i] = next_x;
        if constexpr (axes == 2) patch.zy[i] = next_y;
        if constexpr (redraw) {
          patch.delta[i] = limit;
          patch.draw[i] = state;
        }
        if constexpr (ages) patch.age[i] = least(next_age, static_cast<T>(oldest));
      }
      stored_sum[0].add(i, next_x * w);
      stored_sum[1].add(i, next_y * w);
    }
    const double noise = jumps ? jump_noise(jumped.total(), variance.total(), key) : 0.0;
    const T direction[2] = {ex, ey};
    for (int axis = 0; axis < axes; ++axis) {
      stored[axis] = stored_sum[axis].total();
      LaneSum<T> integral;  // twice the integral of the deflection along the path
      for (std::uint32_t k = 0; k < lane_count; ++k)
        integral.lane[k] = T(2) * passed[axis].lane[k] + direction[axis] * along_sum.lane[k];
      twice_mean[axis] = (integral.total() + advance.direction[axis] * noise) / advance.length;
    }
    squares = squares_sum.total() + further.total() + noise;
    if (energy) totals.snaps += to_count(snaps.total());
  }

  ++totals.blocks_rewritten;
  // Adds the block to the totals in fixed point, so that sums over blocks are exact.
  const bool tail = patch.whole < (b + 1) * block_size;
  for (int axis = 0; axis < axes; ++axis) {
    const std::int64_t now = to_integer(stored[axis] * fixed_per_length);
    const std::int64_t mean_now = mean ? to_integer(twice_mean[axis] * fixed_per_length) : 0;
    if (tail) {
      totals.tail_stored[axis] = now;
      totals.tail_twice_mean[axis] = mean_now;
    } else {
      const Int128 p_from = difference(advance.from[axis], block.position[axis]);
      const Int128 p_to = difference(advance.to[axis], block.position[axis]);
      const Int128 held = 2 * static_cast<Int128>(block.stored[axis]) + Int128{block_size} * (p_from + p_to);
      totals.stored[axis] += static_cast<Int128>(now) - block.stored[axis];
      totals.offset[axis] -= p_to;
      totals.twice_mean[axis] += static_cast<Int128>(mean_now) - held;
    }
    if (advance.commit) {
      block.stored[axis] = now;
      block.position[axis] = advance.to[axis];
    }
  }
  if (tail) totals.tail_snapped = 1;
  if (energy) totals.squares += to_integer(squares * advance.energy_unit);
  if (advance.commit) block.reach = -1.0f;
  if constexpr (ages)
    if (advance.commit) patch.since[b] = advance.start + advance.duration;
}

template <class T, int axes, bool redraw, bool mean, bool energy, bool residual, bool ages>
void step_blocks(const PatchView<T>& patch, const Advance& advance, std::uint32_t first, std::uint32_t last,
                 Totals& totals) {
  assert_step(patch, advance, first, last, axes, redraw);
  for (std::uint32_t b = first; b < last; ++b)
    step_block<T, axes, redraw, mean, energy, residual, ages>(patch, advance, b, totals);
}

/// Counts the bristles in the blocks [first, last) that a step would carry beyond their snap length.
template <class T, int axes, bool redraw, bool ages>
std::uint64_t foresee_blocks(const PatchView<T>& patch, const Advance& advance, std::uint32_t first,
                             std::uint32_t last) {
  const std::uint32_t contact = in_contact(patch);
  const std::uint32_t end = last * block_size < contact ? last * block_size : contact;
  std::uint64_t count = 0;
  for (std::uint32_t i = first * block_size; i < end; ++i) {
    const Block& block = patch.blocks[i / block_size];
    const T px = static_cast<T>(displacement(advance.to[0], block.position[0]));
    const T py = static_cast<T>(displacement(advance.to[1], block.position[1]));
    const T x = (block.zero ? T(0) : patch.zx[i]) + px;
    const T y = axes == 2 ? (block.zero ? T(0) : patch.zy[i]) + py : T(0);
    const auto beyond = [&](T limit) {
      if constexpr (axes == 1) return x > limit || -x > limit;
      return x * x + y * y > limit * limit;
    };
    const T limit = (block.zero ? patch.first : patch.delta)[i];
    if (!beyond(limit)) continue;
    if constexpr (ages) {
      const T left = static_cast<T>(advance.residual);
      const T age = (block.zero ? T(0) : patch.age[i]) +
                    static_cast<T>(age_since(advance, patch.since[i / block_size]).after);
      const T factor = growth<T>(ageing_of<T>(advance), most(age, T(0)));
      if (!beyond(left + (limit - left) * factor)) continue;
    }
    ++count;
  }
  return count;
}

/// Samples snap lengths, each from the state of a bristle's random numbers.
template <class T>
struct FreshLengths {
  static constexpr bool by_columns = false;
  static void fill(const KernelLaw& law, const std::uint32_t* states, std::uint32_t count, T* lengths) {
    for (std::uint32_t k = 0; k < count; ++k) lengths[k] = length_at<T>(law, share_of<T>(mix(states[k])));
  }
};

}  // namespace
}  // namespace bristle::detail

#include "variants.hpp"
