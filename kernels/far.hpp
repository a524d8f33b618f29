// Steps computed in double precision, for patches whose state may be float. Two cases need them: steps above
// far_length, along which float cannot represent the remainder after many snaps, and laws with a single snap
// length, whose bristles must stay in phase for ever.
// SnapRule::keep without ageing processes rows of 16 bristles, far_width at once; all others process one
// bristle at a time.
#pragma once

#include "ageing.hpp"
#include "core/common/assert.hpp"
#include "lanes.hpp"
#include "law.hpp"

namespace bristle::detail {
namespace {

/// Length (scaled) of a step beyond which even double precision loses the position of a bristle between two
/// snaps. The position is then random.
constexpr double phase_is_lost = 1099511627776.0;  // 2^40

/// State of one bristle at the end of a step in double precision in which it snapped.
struct AfterFarStep {
  double deflection;  ///< deflection along the motion at the end
  double squares;     ///< sum of squared snap lengths over the bristle's snaps after the first
  double count;       ///< number of the bristle's snaps after the first
  /// Variance of `squares` that is missing after jumps, because a jump adds only the mean of the sum over the
  /// snaps that it skips.
  double variance;
};

/// Jumps at once over nearly as many snaps of a bristle as fit into `remaining`, the path left, and adds
/// their energy. Returns the path up to the last of these snaps.
inline double jump_snaps(const KernelLaw& law, double remaining, double share, AfterFarStep& land) {
  const double pad = 4.5 * law.deviation * root(remaining * law.inverse_mean);
  const double k = whole_part((remaining - pad) * law.inverse_mean);
  BRISTLE_ASSERT(k >= 1.0);
  const double z = normal_quantile<double>(share);
  const double s = root(k);
  const double skewness = law.skewness / s;
  const double kurtosis = law.kurtosis / k;
  const double w = z + skewness / 6.0 * (z * z - 1.0) + kurtosis / 24.0 * (z * z * z - 3.0 * z) -
                   skewness * skewness / 36.0 * (2.0 * z * z * z - 5.0 * z);
  const double spread = law.deviation * s * w;
  const double jumped = least(k * law.mean + spread, remaining);
  land.squares += k * law.square_mean + law.square_slope * (jumped - k * law.mean);
  land.count += k;
  land.variance += k * law.square_residual;
  return jumped;
}

/// Constants of ageing for the bristles of one block, in a step computed in double precision.
struct FarAge {
  BlockAge block;
  AgeingLaw<double> ageing;
  double largest_growth;
};

/// Bristle found at a random point of a long slide: its fresh length `delta`, and the path `length` between
/// its snaps. The longer this path, the likelier it is to be found on it. Therefore delta is sampled from the
/// length-biased law and accepted with a probability proportional to length / delta, which grows with delta.
struct MetBristle {
  double delta, length;
};
template <class Next>
inline MetBristle meet_bristle(const KernelLaw& law, const AgeingLaw<double>& ageing, double largest_growth,
                               const Next& next) {
  MetBristle met{};
  for (int n = 0; n < most_trials; ++n) {
    if (law.kind == law_exponential) {
      const double u = next();
      met.delta =
          least(most(-law.location * (natural_log<double>(u) + natural_log<double>(next())), law.shortest),
                law.longest);
    } else {
      met.delta = length_met<double>(law, next());
    }
    met.length = aged_length<double>(ageing, met.delta, largest_growth * met.delta);
    if (next() * largest_growth * met.delta <= met.length) break;
  }
  return met;
}

/// Moves a bristle along the path left under SnapRule::redraw: `delta` becomes its fresh snap length at the
/// end, `state` its random state. With ageing at constant velocity v, the paths l = delta g(l / v) from snap
/// to snap are independent too, but have another law: `law` then has the moments of l (core/materials,
/// aged_law.cpp) beside the parameters of delta.
template <class T, bool ages>
inline AfterFarStep land_redraw(const KernelLaw& law, const FarAge& aged, double remaining, T& delta,
                                std::uint32_t& state) {
  const auto next = [&state] {
    state += random_stride;
    return share_of<double>(mix(state));
  };
  AfterFarStep land{0.0, 0.0, 0.0, 0.0};
  for (;;) {
    if (remaining > law.stationary_from || remaining > phase_is_lost) {
      const bool memoryless = !ages && law.kind == law_exponential;
      double age;
      if constexpr (ages) {
        const MetBristle met = meet_bristle(law, aged.ageing, aged.largest_growth, next);
        age = least(next() * met.length, remaining);
        delta = static_cast<T>(met.delta);
        land.deflection = age;
      } else {
        const double u = next();
        const double v = next();
        double met;
        if (memoryless) {
          age = -law.location * natural_log<double>(u);
          met = age + most(-law.location * natural_log<double>(v), law.shortest);
        } else {
          met = length_met<double>(law, u);
          age = v * met;
        }
        delta = static_cast<T>(met - most(age - remaining, 0.0));
        age = least(age, remaining);
        land.deflection = least(age, static_cast<double>(delta));
      }
      const double jumped = remaining - age;
      if (memoryless) {
        const double x = jumped * law.inverse_mean;
        const double e = exponential<double>(-least(x, 80.0));
        const double m2 = law.mean * law.mean;
        land.squares += most(m2 * (2.0 * (x - 1.0 + e)), 0.0);
        land.variance += most(m2 * m2 * (8.0 * x - 28.0 + e * (32.0 + x * (16.0 + 8.0 * x) - 4.0 * e)), 0.0);
      } else {
        land.squares += most(law.squares_per_length * jumped + law.squares_offset, 0.0);
        land.variance += most(law.variance_per_length * jumped + law.variance_offset, 0.0);
      }
      if (jumped > 0.0) land.count += whole_part(jumped * law.inverse_mean + law.count_offset + 0.5);
      return land;
    }
    if (remaining > law.jump_from) {
      remaining -= jump_snaps(law, remaining, next(), land);
      continue;
    }
    delta = static_cast<T>(length_at<double>(law, next()));
    auto length = static_cast<double>(delta);
    BRISTLE_ASSERT(length > 0.0);
    if constexpr (ages) length = aged_length<double>(aged.ageing, length, remaining);
    if (remaining < length) {
      land.deflection = remaining;
      return land;
    }
    remaining -= length;
    land.squares += length * length;
    land.count += 1.0;
  }
}

/// Moves a bristle that ages along the path left under SnapRule::keep: its paths from snap to snap are all
/// equal.
inline AfterFarStep land_keep_aged(const AgeingLaw<double>& ageing, double remaining, double delta,
                                   std::uint32_t phase) {
  const double length = aged_length<double>(ageing, delta, remaining);
  const double count = whole_part(remaining / length);
  const double deflection = remaining > phase_is_lost ? share_of<double>(phase) * length
                                                      : least(most(remaining - count * length, 0.0), length);
  return {deflection, count * (length * length), count, 0.0};
}

/// Returns the key for the random noise of a block's sum of delta^2: the random states of its first row
/// before the step. Since the last jump over many snaps at least one of these 16 bristles has sampled a
/// length, so different blocks and steps get different noise. A trial step of another length gets the same
/// noise, so that solvers converge.
inline std::uint32_t noise_key(const std::uint32_t* random) {
  std::uint32_t key = 0xA511E9B3u;
  for (std::uint32_t k = 0; k < lane_count; ++k) key += random[k] * (2 * k + 1);
  return key;
}

/// Returns the random deviation of a block's sum of squared snap lengths from its mean. One sample for the
/// block, from a lognormal law of that mean and variance, keeps the sum positive however few the bristles.
inline double jump_noise(double sum, double variance, std::uint32_t key) {
  if (!(variance > 0.0 && sum > 0.0)) return 0.0;
  const double s2 = natural_log<double>(1.0 + variance / sum / sum);
  const double z = normal_quantile<double>(share_of<double>(mix(key)));
  return sum * (exponential<double>(root(s2) * z - 0.5 * s2) - 1.0);
}

/// Sums over the bristles of one block, from a step computed in double precision.
struct FarSums {
  double stored[2];
  double twice_mean[2];
  double squares;
  double snaps;
};

/// Partial sums over a block's bristles in double precision, one for each of 16 logical lanes, so that the
/// order of adding is the same on every instruction set.
struct FarLanes {
  alignas(64) double stored[2][lane_count] = {};
  alignas(64) double mean[2][lane_count] = {};
  alignas(64) double squares[lane_count] = {};
  double further[lane_count] = {};   ///< sum of squared snap lengths over the snaps after the first
  double variance[lane_count] = {};  ///< variance of `further` caused by jumps
  alignas(64) double snaps[lane_count] = {};
};

/// Constants of a step in double precision, for the bristles of one block.
struct FarMotion {
  double ex, ey, length, inverse;  ///< direction of the motion, its length, and one over the length
  double residual;
  double p0[2], p1[2];
};

constexpr std::uint32_t far_width = width_of<double>;

/// State of a row of 16 bristles during a step in double precision, for SnapRule::keep.
struct FarRow {
  alignas(64) double start[2][lane_count];  ///< deflections at the start of the step
  alignas(64) double end[2][lane_count];    ///< deflections at the end, first without snaps, then final
  /// Deflection at which each bristle snaps, scaled: residual plus snap length.
  alignas(64) double limit[lane_count];
  alignas(64) double weight[lane_count];
  /// Random position of a bristle between two snaps, as a share of the snap length, for steps so long that
  /// the position cannot be computed.
  alignas(64) double phase[lane_count];
};

/// Steps a vector of the row's bristles, beginning with bristle k of the row, under SnapRule::keep. `left` is
/// the deflection after a snap.
template <int axes, bool residual>
inline void far_keep(const FarMotion& motion, double left, std::uint32_t k, FarRow& row, FarLanes& lanes) {
  using V = Lanes<double>;
  const V none(0.0), length(motion.length), inverse(motion.inverse);
  const V e[2] = {V(motion.ex), V(motion.ey)};
  const V sx = load(row.start[0] + k);
  const V sy = axes == 2 ? load(row.start[1] + k) : none;
  const V limit = load(row.limit + k);
  const V along = sx * e[0] + sy * e[1];
  const V aside = sx * e[1] - sy * e[0];
  const V reach = axes == 2 ? root(most(limit * limit - aside * aside, none)) : limit;
  const V tau = most(reach - along, none);
  const auto snaps = tau < length;
  const V remaining = most(length - tau, none);
  const V delta = limit - V(left);
  const V more = whole_part(remaining / delta);
  V r = least(most(remaining - more * delta, none), delta);
  if (motion.length > phase_is_lost) r = load(row.phase + k) * delta;

  V further = more * (delta * delta);
  // Divides paths by the length of the step, because the squares of paths in a very long step would overflow.
  const V part = tau * inverse;
  V integral = part * tau + further * inverse + (r * inverse) * r;
  if constexpr (residual) {
    integral = integral + V(2.0 * left) * (remaining * inverse);
    further = further + V(2.0 * left) * (remaining - r);
  }
  const V squares = delta * (limit + V(left)) + further;
  const V bent = V(left) + r;
  const V weight = load(row.weight + k);
  const V start[2] = {sx, sy};
  for (int axis = 0; axis < axes; ++axis) {
    const V unsnapped = load(row.end[axis] + k);
    const V passed = V(2.0) * start[axis] * part + e[axis] * integral;
    double* const mean = lanes.mean[axis] + k;
    put_lanes(mean, load(mean) + weight * select_lanes(snaps, passed, start[axis] + unsnapped));
    put_lanes(row.end[axis] + k, select_lanes(snaps, bent * e[axis], unsnapped));
  }
  put_lanes(lanes.squares + k, load(lanes.squares + k) + weight * select_lanes(snaps, squares, none));
  const V count = select_lanes(weight > none, select_lanes(snaps, V(1.0) + more, none), none);
  put_lanes(lanes.snaps + k, load(lanes.snaps + k) + count);
}

template <class T, int axes, bool residual>
inline void far_keep_row(const PatchView<T>& patch, const KernelStep& step, const FarMotion& motion,
                         std::uint32_t first, FarRow& row, FarLanes& lanes) {
  T* const columns[2] = {patch.zx, patch.zy};
  for (int axis = 0; axis < axes; ++axis) {
    const T* const z = columns[axis] + first;
    const T moved = static_cast<T>(motion.p1[axis]);
    for (std::uint32_t k = 0; k < lane_count; ++k) {
      row.start[axis][k] = static_cast<double>(z[k]) + motion.p0[axis];
      row.end[axis][k] = static_cast<double>(z[k] + moved);
    }
  }
  for (std::uint32_t k = 0; k < lane_count; ++k) row.limit[k] = static_cast<double>(patch.delta[first + k]);
  if (motion.length > phase_is_lost)
    for (std::uint32_t k = 0; k < lane_count; ++k)
      row.phase[k] = share_of<double>(mix(static_cast<std::uint32_t>(step.phase_key) ^ mix(first + k + 1)));
  const double left = residual ? motion.residual : 0.0;
  for (std::uint32_t k = 0; k < lane_count; k += far_width)
    far_keep<axes, residual>(motion, left, k, row, lanes);
  for (int axis = 0; axis < axes; ++axis) {
    T* const z = columns[axis] + first;
    T end[lane_count];
    for (std::uint32_t k = 0; k < lane_count; ++k) end[k] = static_cast<T>(row.end[axis][k]);
    for (std::uint32_t k = 0; k < lane_count; ++k)
      lanes.stored[axis][k] += row.weight[k] * static_cast<double>(end[k]);
    if (!step.stores) continue;
    // Keeps bristles straight that are out of contact, whatever the motion gave them.
    for (std::uint32_t k = 0; k < lane_count; ++k) z[k] = row.weight[k] > 0.0 ? end[k] : T(0);
  }
}

/// Steps one bristle in double precision, as bristles need that redraw their lengths or age.
template <class T, int axes, bool redraw, bool residual, bool ages>
inline void far_bristle(const PatchView<T>& patch, const KernelStep& step, const FarMotion& motion,
                        const FarAge& aged, std::uint32_t i, double w, FarLanes& lanes) {
  const std::uint32_t lane = i % lane_count;
  const double left = residual ? motion.residual : 0.0;
  const double sx = static_cast<double>(patch.zx[i]) + motion.p0[0];
  const double sy = axes == 2 ? static_cast<double>(patch.zy[i]) + motion.p0[1] : 0.0;
  T x = patch.zx[i] + static_cast<T>(motion.p1[0]);
  T y = axes == 2 ? patch.zy[i] + static_cast<T>(motion.p1[1]) : T(0);
  [[maybe_unused]] T end_age{};
  if constexpr (ages) end_age = patch.age[i] + static_cast<T>(aged.block.after);
  T limit = patch.delta[i];
  const auto before = static_cast<double>(limit);
  const double aside = sx * motion.ey - sy * motion.ex;
  const Bent<double> bent{sx * motion.ex + sy * motion.ey, aside * aside};
  double reach = before;
  if constexpr (ages)
    reach = left + (before - left) * growth<double>(aged.ageing, most(static_cast<double>(end_age), 0.0));
  double tau = path_to_circle<double, axes>(bent, reach);
  if (!(tau < motion.length)) {
    // Changes the stored deflection itself. Elsewhere the patch's position moves it, but in a
    // step beyond far_length the position stays.
    if (ages && step.snaps_all) {
      x = static_cast<T>(sx + motion.ex * motion.length);
      if constexpr (axes == 2) y = static_cast<T>(sy + motion.ey * motion.length);
    }
    lanes.mean[0][lane] += w * (sx + static_cast<double>(x));
    lanes.mean[1][lane] += w * (sy + static_cast<double>(y));
  } else {
    if constexpr (ages)
      tau = aged_path<double, axes>(aged.ageing, bent, left, before - left,
                                    static_cast<double>(patch.age[i]) + aged.block.before, tau, true);
    const double remaining = motion.length - tau;
    AfterFarStep land;
    if constexpr (redraw) {
      std::uint32_t state = patch.random[i];
      land = land_redraw<T, ages>(*patch.law, aged, remaining, limit, state);
      if constexpr (residual) limit = static_cast<T>(left) + limit;
      if (step.stores) {
        patch.delta[i] = limit;
        patch.random[i] = state;
      }
    } else {
      const std::uint32_t phase = mix(static_cast<std::uint32_t>(step.phase_key) ^ mix(i + 1));
      land = land_keep_aged(aged.ageing, remaining, before - left, phase);
    }
    const double r = land.deflection;
    const double part = tau * motion.inverse;
    double integral = part * tau + land.squares * motion.inverse + (r * motion.inverse) * r;
    if constexpr (residual) integral += 2.0 * left * (remaining * motion.inverse);
    double squares;
    if constexpr (ages) {
      const double reached = bent.along + tau;
      squares = (reached * reached + bent.aside2 - left * left) + land.squares + 2.0 * left * (remaining - r);
      end_age = static_cast<T>(least(aged.ageing.per_length * r, oldest));
    } else if constexpr (residual) {
      squares = (before - left) * (before + left) + (land.squares + 2.0 * left * (remaining - r));
    } else {
      squares = before * before + land.squares;
    }
    x = static_cast<T>((left + r) * motion.ex);
    y = static_cast<T>((left + r) * motion.ey);
    lanes.mean[0][lane] += w * (2.0 * sx * part + motion.ex * integral);
    lanes.mean[1][lane] += w * (2.0 * sy * part + motion.ey * integral);
    lanes.squares[lane] += w * squares;
    lanes.further[lane] += w * land.squares;
    lanes.variance[lane] += w * (w * land.variance);
    lanes.snaps[lane] += 1.0 + land.count;
  }
  if (step.stores) {
    patch.zx[i] = x;
    if constexpr (axes == 2) patch.zy[i] = y;
    if constexpr (ages) patch.age[i] = least(end_age, static_cast<T>(oldest));
  }
  lanes.stored[0][lane] += w * static_cast<double>(x);
  lanes.stored[1][lane] += w * static_cast<double>(y);
}

template <int axes, bool redraw>
inline FarSums far_total(FarLanes& lanes, const KernelStep& step, [[maybe_unused]] std::uint32_t key) {
  FarSums sums{};
  double noise = 0.0;
  if constexpr (redraw) noise = jump_noise(tree_sum(lanes.further), tree_sum(lanes.variance), key);
  sums.squares = tree_sum(lanes.squares) + noise;
  sums.snaps = tree_sum(lanes.snaps);
  for (int axis = 0; axis < axes; ++axis) {
    sums.stored[axis] = tree_sum(lanes.stored[axis]);
    sums.twice_mean[axis] = tree_sum(lanes.mean[axis]) + step.direction[axis] * (noise / step.length);
  }
  return sums;
}

/// Advances the bristles [start, start + active) of one block in which a bristle snaps.
template <class T, int axes, bool redraw, bool residual, bool ages>
[[gnu::noinline]] FarSums far_block(const PatchView<T>& patch, const KernelStep& step, std::uint32_t start,
                                    std::uint32_t active, const double (&p0)[2], const double (&p1)[2]) {
  const FarMotion motion{step.direction[0], step.direction[1], step.length,   1.0 / step.length,
                         step.residual,     {p0[0], p0[1]},    {p1[0], p1[1]}};
  FarAge aged{};
  if constexpr (ages)
    aged = {age_since(step, patch.since[start / block_size]), ageing_of<double>(step), step.largest_growth};
  const std::uint32_t end = start + active;
  const auto weight_of = [&patch, end](std::uint32_t i) {
    return i < patch.whole ? 1.0 : i < end ? static_cast<double>(patch.fraction) : 0.0;
  };
  [[maybe_unused]] const std::uint32_t key = redraw ? noise_key(patch.random + start) : 0u;
  FarLanes lanes;
  if constexpr (redraw || ages) {
    for (std::uint32_t i = start; i < end; ++i)
      far_bristle<T, axes, redraw, residual, ages>(patch, step, motion, aged, i, weight_of(i), lanes);
  } else {
    FarRow row;
    for (std::uint32_t i = start; i < end; i += lane_count) {
      for (std::uint32_t k = 0; k < lane_count; ++k) row.weight[k] = weight_of(i + k);
      far_keep_row<T, axes, residual>(patch, step, motion, i, row, lanes);
    }
  }
  return far_total<axes, redraw>(lanes, step, key);
}

}  // namespace
}  // namespace bristle::detail
