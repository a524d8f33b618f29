// Steps taken bristle by bristle in double precision: so long that float cannot hold the remainder
// (above far_length), or with a single snap length, whose bristles must stay in phase for ever.
//
// Shared by the reference and by every instruction set: there is no faster form to compare it with.
#pragma once

#include "law.hpp"
#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

/// Beyond this (scaled) even double has no phase left: it is drawn.
constexpr double phase_is_lost = 1099511627776.0;  // 2^40

/// A bristle that snapped, after the path that remained.
struct Landing {
  double deflection;  ///< along the motion
  double squares;     ///< sum of delta^2 over the snaps after the first
  double count;       ///< of these
  double variance;    ///< of what `squares` left out
};

/// Keep: the bristle snaps every delta.
inline Landing land_keep(double rest, double delta, std::uint32_t phase) {
  const double more = whole_part(rest / delta);
  double r = rest > phase_is_lost ? share_of<double>(phase) * delta : rest - more * delta;
  r = least(most(r, 0.0), delta);
  return {r, more * (delta * delta), more, 0.0};
}

/// Redraw: `delta` becomes the snap length of the bristle it ends on, `state` its draw state.
template <class T>
inline Landing land_redraw(const KernelLaw& law, double rest, T& delta, std::uint32_t& state) {
  const auto next = [&state] {
    state += draw_stride;
    return share_of<double>(mix(state));
  };
  Landing land{0.0, 0.0, 0.0, 0.0};
  for (;;) {
    if (rest > law.jump_from && (!law.many || rest > law.stationary_from || rest > phase_is_lost)) {
      const double u = next();
      const double v = next();
      const bool memoryless = law.kind == law_exponential;
      double age;
      double met;
      if (memoryless) {
        age = -law.a * natural_log<double>(u);
        met = age + most(-law.a * natural_log<double>(v), law.shortest);
      } else {
        met = length_met<double>(law, u);
        age = v * met;
      }
      met -= most(age - rest, 0.0);
      age = least(age, rest);
      const double jumped = rest - age;
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
      delta = static_cast<T>(met);
      land.deflection = least(age, static_cast<double>(delta));
      return land;
    }
    if (rest > law.jump_from) {
      const double pad = 6.0 * law.deviation * root(rest * law.inverse_mean);
      const double k = whole_part((rest - pad) * law.inverse_mean) - 1.0;
      const double z = normal_quantile<double>(next());
      const double s = root(k);
      const double skewness = law.skewness / s;
      const double kurtosis = law.kurtosis / k;
      const double w = z + skewness / 6.0 * (z * z - 1.0) + kurtosis / 24.0 * (z * z * z - 3.0 * z) -
                       skewness * skewness / 36.0 * (2.0 * z * z * z - 5.0 * z);
      const double spread = law.deviation * s * w;
      const double jumped = least(k * law.mean + spread, rest);
      land.squares += k * law.square_mean + law.square_slope * (jumped - k * law.mean);
      land.count += k;
      land.variance += k * law.square_residual;
      rest -= jumped;
      continue;
    }
    delta = static_cast<T>(length_at<double>(law, next()));
    const auto length = static_cast<double>(delta);
    if (rest < length) {
      land.deflection = rest;
      return land;
    }
    rest -= length;
    land.squares += length * length;
    land.count += 1.0;
  }
}

/// Keys a block's noise by the draw states of its first row before the step: one of 16 bristles has drawn
/// since the last jump, and a trial step of another length gets the same noise, so that solvers converge.
inline std::uint32_t noise_key(const std::uint32_t* draw) {
  std::uint32_t key = 0xA511E9B3u;
  for (std::uint32_t k = 0; k < lane_count; ++k) key += draw[k] * (2 * k + 1);
  return key;
}

/// What a block's sum of delta^2 differs from its mean, given the sum's mean and variance: drawn once per
/// block, lognormal, so that both agree and the sum stays positive however few bristles there are.
inline double jump_noise(double sum, double variance, std::uint32_t key) {
  if (!(variance > 0.0 && sum > 0.0)) return 0.0;
  const double s2 = natural_log<double>(1.0 + variance / sum / sum);
  const double z = normal_quantile<double>(share_of<double>(mix(key)));
  return sum * (exponential<double>(root(s2) * z - 0.5 * s2) - 1.0);
}

/// Sums of one block over a far step.
struct FarSums {
  double stored[2];
  double twice_mean[2];
  double squares;
  double snaps;
};

/// Advances the bristles [start, start + active) of one block in which a bristle snaps, `weight(i)` telling
/// how much bristle i counts.
template <class T, int axes, bool redraw, class Weight>
[[gnu::noinline]] FarSums far_block(const PatchView<T>& patch, const Advance& advance, std::uint32_t start,
                                    std::uint32_t active, const double (&p0)[2], const double (&p1)[2],
                                    Weight weight) {
  double lanes_stored[2][lane_count] = {};
  double lanes_mean[2][lane_count] = {};
  double lanes_squares[lane_count] = {};
  double lanes_further[lane_count] = {};
  double lanes_variance[lane_count] = {};
  FarSums sums{};
  const bool all = advance.all != 0;
  const double ex = advance.direction[0];
  const double ey = advance.direction[1];
  const auto snaps_at = [&](std::uint32_t i) {
    const T zx = patch.zx[i] + static_cast<T>(p1[0]);
    const T delta = patch.delta[i];
    if constexpr (axes == 1) {
      return all || zx > delta || -zx > delta;
    } else {
      const T zy = patch.zy[i] + static_cast<T>(p1[1]);
      return all || zx * zx + zy * zy > delta * delta;
    }
  };

  const std::uint32_t key = redraw ? noise_key(patch.draw + start) : 0u;
  for (std::uint32_t k = 0; k < active; ++k) {
    const std::uint32_t i = start + k;
    const std::uint32_t lane = k % lane_count;
    const double w = weight(i);
    const double sx = static_cast<double>(patch.zx[i]) + p0[0];
    const double sy = axes == 2 ? static_cast<double>(patch.zy[i]) + p0[1] : 0.0;
    T zx;
    T zy = 0;
    double mean_x;
    double mean_y;
    if (snaps_at(i)) {
      const auto before = static_cast<double>(patch.delta[i]);
      const double along = sx * ex + sy * ey;
      const double aside = sx * ey - sy * ex;
      const double reach = axes == 2 ? root(most(before * before - aside * aside, 0.0)) : before;
      const double tau = most(reach - along, 0.0);
      const double rest = most(advance.length - tau, 0.0);
      Landing land;
      if constexpr (redraw) {
        T delta = patch.delta[i];
        std::uint32_t state = patch.draw[i];
        land = land_redraw<T>(*patch.law, rest, delta, state);
        if (advance.commit) {
          patch.delta[i] = delta;
          patch.draw[i] = state;
        }
      } else {
        land = land_keep(rest, before, mix(static_cast<std::uint32_t>(advance.phase_key) ^ mix(i + 1)));
      }
      const double r = land.deflection;
      zx = static_cast<T>(r * ex);
      zy = static_cast<T>(r * ey);
      // In units of the step length, so that nothing overflows.
      const double integral =
          (tau / advance.length) * tau + land.squares / advance.length + (r / advance.length) * r;
      mean_x = 2.0 * sx * (tau / advance.length) + ex * integral;
      mean_y = 2.0 * sy * (tau / advance.length) + ey * integral;
      lanes_squares[lane] += w * (before * before + land.squares);
      lanes_further[lane] += w * land.squares;
      lanes_variance[lane] += w * (w * land.variance);
      sums.snaps += 1.0 + land.count;
    } else {
      zx = patch.zx[i] + static_cast<T>(p1[0]);
      if constexpr (axes == 2) zy = patch.zy[i] + static_cast<T>(p1[1]);
      mean_x = sx + static_cast<double>(zx);
      mean_y = sy + static_cast<double>(zy);
    }
    if (advance.commit) {
      patch.zx[i] = zx;
      if constexpr (axes == 2) patch.zy[i] = zy;
    }
    lanes_stored[0][lane] += w * static_cast<double>(zx);
    lanes_stored[1][lane] += w * static_cast<double>(zy);
    lanes_mean[0][lane] += w * mean_x;
    lanes_mean[1][lane] += w * mean_y;
  }
  sums.squares = tree_sum(lanes_squares);
  double noise = 0.0;
  if constexpr (redraw) noise = jump_noise(tree_sum(lanes_further), tree_sum(lanes_variance), key);
  sums.squares += noise;
  for (int axis = 0; axis < axes; ++axis) {
    sums.stored[axis] = tree_sum(lanes_stored[axis]);
    sums.twice_mean[axis] = tree_sum(lanes_mean[axis]) + advance.direction[axis] * (noise / advance.length);
  }
  return sums;
}

}  // namespace
}  // namespace bristle::detail
