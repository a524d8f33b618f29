// One step of the bristles of a patch, for vectors: where the physics of a snap stands.
//
// A block is visited in two passes. The first asks whether any of its bristles snaps; if none does,
// nothing is written: the block's displacement since its last rewrite grows by itself. The second
// rewrites all 256 deflections. DESIGN.md 2.2 and 2.3; symbols as in core/MODEL.md.
#pragma once

#include "far.hpp"
#include "lanes.hpp"
#include "law.hpp"

namespace bristle::detail {
namespace {

/// Sums over a block, one number per logical lane.
template <class T, int axes, bool mean, bool energy, bool redraw>
struct LaneSums {
  alignas(64) T stored[axes][lane_count];
  alignas(64) T straight[mean ? axes : 1][lane_count];  ///< sum of (start + end) of bristles that held
  alignas(64) T torn[mean ? axes : 1][lane_count];      ///< sum of start tau of bristles that snapped
  alignas(64) T along[lane_count];                      ///< sum of tau^2 + skipped delta^2 + r^2 of these
  alignas(64) T squares[lane_count];                    ///< sum of delta^2 over all snaps
  alignas(64) T snaps[lane_count];
  alignas(64) T variance[lane_count];
};

/// The sums of one vector of lanes while its rows are walked.
template <class T>
struct RowSums {
  Lanes<T> stored[2], straight[2], torn[2], along, squares, snaps, variance;
};

/// What a vector of bristles meets after its first snap.
template <class T>
struct Remainder {
  Lanes<T> deflection;  ///< r, along the motion
  Lanes<T> squares;     ///< sum of delta^2 over the snaps after the first
  Lanes<T> count;       ///< of these
  Lanes<T> variance;    ///< of the squares that a jump left out
};

/// Keep: a bristle snaps every delta.
template <class T>
inline Remainder<T> walk_keep(Lanes<T> rest, Lanes<T> delta) {
  const Lanes<T> more = whole_part(divide(rest, delta));
  const Lanes<T> r = least(positive_part(rest - more * delta), delta);
  return {r, more * (delta * delta), more, Lanes<T>(T(0))};
}

/// Redraw: a fresh length after each snap, one by one while the path is short, else in law
/// (core/MODEL.md, "Jumps"). `delta` and `states` of the masked lanes change.
template <class T>
inline Remainder<T> walk_redraw(const KernelLaw& law, T longest_rest, Mask<T> snapped, Lanes<T> rest,
                                Lanes<T>& delta, DrawStates<T>& states) {
  const Lanes<T> none(T(0));
  Remainder<T> out{none, none, none, none};
  Mask<T> open = snapped;
  const T jump_from = static_cast<T>(law.jump_from);
  const bool may_jump = longest_rest > jump_from;
  for (;;) {
    if (may_jump) {
      Mask<T> jumps = open & (rest > Lanes<T>(jump_from));
      if (xsimd::any(jumps)) {
        const Lanes<T> u = states.next(jumps);
        if (!law.many) {
          // Stationary law: the bristle met is length-biased, its age uniform.
          const Lanes<T> v = states.next(jumps);
          Lanes<T> met = length_met<T>(law, u, law.kind == law_exponential ? states.next(jumps) : v);
          Lanes<T> age = v * met;
          met = met - positive_part(age - rest);
          age = least(age, rest);
          const Lanes<T> jumped = rest - age;
          const Lanes<T> squares = positive_part(Lanes<T>(static_cast<T>(law.squares_per_length)) * jumped +
                                                 Lanes<T>(static_cast<T>(law.squares_offset)));
          const Lanes<T> variance = positive_part(Lanes<T>(static_cast<T>(law.variance_per_length)) * jumped +
                                                  Lanes<T>(static_cast<T>(law.variance_offset)));
          const Lanes<T> count = whole_part(jumped * Lanes<T>(static_cast<T>(law.inverse_mean)) +
                                            Lanes<T>(static_cast<T>(law.count_offset + 0.5)));
          out.squares = select_lanes(jumps, out.squares + squares, out.squares);
          out.variance = select_lanes(jumps, out.variance + variance, out.variance);
          out.count = select_lanes(jumps, out.count + count, out.count);
          out.deflection = select_lanes(jumps, least(age, met), out.deflection);
          delta = select_lanes(jumps, met, delta);
          open = open & !jumps;
        } else {
          // k renewals at once, their sum by a Cornish-Fisher expansion to the fourth cumulant.
          const Lanes<T> m1(static_cast<T>(law.mean));
          const Lanes<T> deviation(static_cast<T>(law.deviation));
          const Lanes<T> inverse(static_cast<T>(law.inverse_mean));
          const Lanes<T> safe = select_lanes(jumps, rest, Lanes<T>(jump_from));
          const Lanes<T> pad = Lanes<T>(T(6)) * deviation * root(safe * inverse);
          const Lanes<T> k = whole_part((safe - pad) * inverse) - Lanes<T>(T(1));
          const Lanes<T> z = normal_quantile<T>(u);
          const Lanes<T> s = root(k);
          const Lanes<T> skewness = divide(Lanes<T>(static_cast<T>(law.skewness)), s);
          const Lanes<T> kurtosis = divide(Lanes<T>(static_cast<T>(law.kurtosis)), k);
          const Lanes<T> z2 = z * z;
          const Lanes<T> z3 = z2 * z;
          const Lanes<T> w =
              z + skewness * Lanes<T>(T(1) / T(6)) * (z2 - Lanes<T>(T(1))) +
              kurtosis * Lanes<T>(T(1) / T(24)) * (z3 - Lanes<T>(T(3)) * z) -
              skewness * skewness * Lanes<T>(T(1) / T(36)) * (Lanes<T>(T(2)) * z3 - Lanes<T>(T(5)) * z);
          const Lanes<T> jumped = least(k * m1 + deviation * s * w, safe);
          const Lanes<T> squares = k * Lanes<T>(static_cast<T>(law.square_mean)) +
                                   Lanes<T>(static_cast<T>(law.square_slope)) * (jumped - k * m1);
          out.squares = select_lanes(jumps, out.squares + squares, out.squares);
          out.variance = select_lanes(jumps, out.variance + k * Lanes<T>(static_cast<T>(law.square_residual)),
                                      out.variance);
          out.count = select_lanes(jumps, out.count + k, out.count);
          rest = select_lanes(jumps, rest - jumped, rest);
          continue;
        }
        if (!xsimd::any(open)) return out;
      }
    }
    const Lanes<T> drawn = length_at<T>(law, states.next(open));
    delta = select_lanes(open, drawn, delta);
    const Mask<T> ends = open & (rest < drawn);
    out.deflection = select_lanes(ends, rest, out.deflection);
    open = open & (rest >= drawn);
    if (!xsimd::any(open)) return out;
    rest = select_lanes(open, rest - drawn, rest);
    out.squares = select_lanes(open, out.squares + drawn * drawn, out.squares);
    out.count = select_lanes(open, out.count + Lanes<T>(T(1)), out.count);
  }
}

template <class T, int axes, Rule rule, bool mean, bool energy>
struct Stepper {
  static constexpr bool redraw = rule == rule_redraw || rule == rule_literal_redraw;
  static constexpr bool literal = rule == rule_literal_keep || rule == rule_literal_redraw;
  static constexpr std::uint32_t width = Lanes<T>::size;
  using Sums = LaneSums<T, axes, mean, energy, redraw>;

  const PatchView<T>& patch;
  const Advance& advance;
  Totals& totals;
  const T ex, ey, length;
  const bool commit, track;

  Stepper(const PatchView<T>& patch_, const Advance& advance_, Totals& totals_)
      : patch(patch_),
        advance(advance_),
        totals(totals_),
        ex(static_cast<T>(advance_.direction[0])),
        ey(static_cast<T>(advance_.direction[1])),
        length(static_cast<T>(advance_.length)),
        commit(advance_.commit != 0),
        track(advance_.track != 0) {}

  // The block at hand: displacement since its last rewrite, at the start and end of the step.
  T p0x, p0y, p1x, p1y;

  /// Which of the bristles at i snap in this step: those beyond their length at its end.
  Mask<T> snaps_at(std::uint32_t i) const {
    const Lanes<T> zx = load(patch.zx + i) + Lanes<T>(p1x);
    const Lanes<T> delta = load(patch.delta + i);
    if constexpr (axes == 1) {
      return xsimd::abs(zx) > delta;
    } else {
      const Lanes<T> zy = load(patch.zy + i) + Lanes<T>(p1y);
      return zx * zx + zy * zy > delta * delta;
    }
  }

  /// Advances one vector of bristles that are being rewritten.
  template <bool partial>
  void advance_row(std::uint32_t i, const T* weights, RowSums<T>& sums) const {
    const Lanes<T> none(T(0));
    const Lanes<T> zx = load(patch.zx + i);
    const Lanes<T> start_x = zx + Lanes<T>(p0x);
    const Lanes<T> end_x = zx + Lanes<T>(p1x);
    Lanes<T> start_y = none;
    Lanes<T> end_y = none;
    Lanes<T> delta = load(patch.delta + i);
    const Lanes<T> before2 = delta * delta;
    Mask<T> snapped;
    Lanes<T> end2 = end_x * end_x;
    if constexpr (axes == 2) {
      const Lanes<T> zy = load(patch.zy + i);
      start_y = zy + Lanes<T>(p0y);
      end_y = zy + Lanes<T>(p1y);
      end2 = end2 + end_y * end_y;
      snapped = end2 > before2;
    } else {
      snapped = xsimd::abs(end_x) > delta;
    }
    Lanes<T> weight(T(1));
    Mask<T> active = weight > none;
    if constexpr (partial) {
      weight = load(weights);
      active = weight > none;
      snapped = snapped & active;
    }

    Lanes<T> next_x;
    Lanes<T> next_y = none;
    if constexpr (literal) {
      next_x = select_lanes(snapped, none, end_x);
      if constexpr (axes == 2) next_y = select_lanes(snapped, none, end_y);
      if constexpr (redraw) {
        DrawStates<T> states(patch.draw + i);
        delta = select_lanes(snapped, length_at<T>(*patch.law, states.next(snapped)), delta);
        if (commit) {
          states.store(patch.draw + i);
          delta.store_aligned(patch.delta + i);
        }
      }
      sums.squares = sums.squares + weigh<partial>(select_lanes(snapped, end2, none), weight);
      sums.snaps = sums.snaps + select_lanes(snapped, Lanes<T>(T(1)), none);
    } else {
      // Distance to the first snap: from the start along e to the circle of radius delta.
      Lanes<T> tau;
      if constexpr (axes == 1) {
        tau = positive_part(delta - start_x * Lanes<T>(ex));
      } else {
        const Lanes<T> along = start_x * Lanes<T>(ex) + start_y * Lanes<T>(ey);
        const Lanes<T> aside = start_x * Lanes<T>(ey) - start_y * Lanes<T>(ex);
        tau = positive_part(root(positive_part(before2 - aside * aside)) - along);
      }
      const Lanes<T> rest = positive_part(Lanes<T>(length) - tau);
      Remainder<T> landed{none, none, none, none};
      if constexpr (redraw) {
        if (xsimd::any(snapped)) {
          DrawStates<T> states(patch.draw + i);
          landed = walk_redraw<T>(*patch.law, length, snapped, rest, delta, states);
          if (commit) {
            states.store(patch.draw + i);
            delta.store_aligned(patch.delta + i);
          }
        }
      } else {
        landed = walk_keep<T>(rest, delta);
      }
      const Lanes<T> r = landed.deflection;
      next_x = select_lanes(snapped, r * Lanes<T>(ex), end_x);
      if constexpr (axes == 2) next_y = select_lanes(snapped, r * Lanes<T>(ey), end_y);
      if constexpr (mean) {
        const Lanes<T> path = (tau * tau + landed.squares) + r * r;
        sums.along = sums.along + weigh<partial>(select_lanes(snapped, path, none), weight);
        sums.torn[0] = sums.torn[0] + weigh<partial>(select_lanes(snapped, start_x * tau, none), weight);
        sums.straight[0] =
            sums.straight[0] + weigh<partial>(select_lanes(snapped, none, start_x + end_x), weight);
        if constexpr (axes == 2) {
          sums.torn[1] = sums.torn[1] + weigh<partial>(select_lanes(snapped, start_y * tau, none), weight);
          sums.straight[1] =
              sums.straight[1] + weigh<partial>(select_lanes(snapped, none, start_y + end_y), weight);
        }
      }
      if constexpr (energy) {
        sums.squares =
            sums.squares + weigh<partial>(select_lanes(snapped, before2 + landed.squares, none), weight);
        sums.snaps = sums.snaps + select_lanes(snapped, Lanes<T>(T(1)) + landed.count, none);
      }
      if constexpr (redraw && (mean || energy)) sums.variance = sums.variance + landed.variance;
    }
    if constexpr (partial) {
      next_x = select_lanes(active, next_x, none);
      if constexpr (axes == 2) next_y = select_lanes(active, next_y, none);
    }
    if (commit) {
      next_x.store_aligned(patch.zx + i);
      if constexpr (axes == 2) next_y.store_aligned(patch.zy + i);
    }
    sums.stored[0] = sums.stored[0] + weigh<partial>(next_x, weight);
    if constexpr (axes == 2) sums.stored[1] = sums.stored[1] + weigh<partial>(next_y, weight);
  }

  template <bool partial>
  static Lanes<T> weigh(Lanes<T> x, Lanes<T> weight) {
    if constexpr (partial) return x * weight;
    return x;
  }

  void visit(std::uint32_t b) {
    Block& block = patch.blocks[b];
    const std::uint32_t start = b * block_size;
    const std::uint32_t in_contact = patch.whole + (patch.fraction > T(0) ? 1u : 0u);
    const std::uint32_t active = in_contact - start < block_size ? in_contact - start : block_size;
    const std::uint32_t whole = patch.whole - start < block_size ? patch.whole - start : block_size;
    const std::uint32_t full_rows = whole / lane_count;
    const bool partial = active > full_rows * lane_count;
    totals.visited += active;

    if (block.zero) write_zero_block(block, start);
    const double q0[2] = {displacement(advance.from[0], block.position[0]),
                          displacement(advance.from[1], block.position[1])};
    const double q1[2] = {displacement(advance.to[0], block.position[0]),
                          displacement(advance.to[1], block.position[1])};
    p0x = static_cast<T>(q0[0]);
    p0y = static_cast<T>(q0[1]);
    p1x = static_cast<T>(q1[0]);
    p1y = static_cast<T>(q1[1]);

    alignas(64) T weights[lane_count];
    if (partial) fill_weights(weights, start + full_rows * lane_count);

    double stored[2] = {0.0, 0.0};
    double twice_mean[2] = {0.0, 0.0};
    double squares = 0.0;
    if (advance.far) {
      const FarSums far = far_block<T, axes, redraw>(
          patch, advance, start, active, q0, q1,
          [this](std::uint32_t i) { return i < patch.whole ? 1.0 : static_cast<double>(patch.fraction); });
      if (!far.any) return keep_bound(block, start, full_rows, partial, weights);
      for (int axis = 0; axis < axes; ++axis) {
        stored[axis] = far.stored[axis];
        twice_mean[axis] = far.twice_mean[axis];
      }
      squares = far.squares;
      totals.snaps += to_count(far.snaps);
    } else {
      if (!any_snap(start, full_rows, partial, weights))
        return keep_bound(block, start, full_rows, partial, weights);
      rewrite(start, full_rows, partial, weights, stored, twice_mean, squares);
    }
    record(block, b, stored, twice_mean, squares);
    if (commit) {
      p0x = p1x = p0y = p1y = T(0);
      keep_bound(block, start, full_rows, partial, weights);
    }
  }

  void run(std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t b = first; b < last; ++b) visit(b);
  }

 private:
  static double displacement(std::int64_t to, std::int64_t from) {
    // The difference wraps like the positions do: it is exact while it is below 2^63 units.
    return static_cast<double>(
               static_cast<std::int64_t>(static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from))) *
           length_per_fixed;
  }

  static std::uint64_t to_count(double x) {
    return x < 9.0e18 ? static_cast<std::uint64_t>(x) : std::uint64_t{9000000000000000000u};
  }

  void fill_weights(T* weights, std::uint32_t first) const {
    for (std::uint32_t k = 0; k < lane_count; ++k)
      weights[k] = first + k < patch.whole ? T(1) : first + k == patch.whole ? patch.fraction : T(0);
  }

  void write_zero_block(Block& block, std::uint32_t start) const {
    const std::uint32_t padded = (patch.bristles + lane_count - 1) / lane_count * lane_count;
    const std::uint32_t end = start + block_size < padded ? start + block_size : padded;
    for (std::uint32_t i = start; i < end; i += width) {
      Lanes<T>(T(0)).store_aligned(patch.zx + i);
      if constexpr (axes == 2) Lanes<T>(T(0)).store_aligned(patch.zy + i);
      if constexpr (redraw) load(patch.first + i).store_aligned(patch.delta + i);
    }
    block.zero = 0;
  }

  bool any_snap(std::uint32_t start, std::uint32_t full_rows, bool partial, const T* weights) const {
    const std::uint32_t end = start + full_rows * lane_count;
    for (std::uint32_t i = start; i < end; i += lane_count) {
      Mask<T> any = snaps_at(i);
      for (std::uint32_t k = width; k < lane_count; k += width) any = any | snaps_at(i + k);
      if (xsimd::any(any)) return true;
    }
    if (partial)
      for (std::uint32_t k = 0; k < lane_count; k += width)
        if (xsimd::any(snaps_at(end + k) & (load(weights + k) > Lanes<T>(T(0))))) return true;
    return false;
  }

  void rewrite(std::uint32_t start, std::uint32_t full_rows, bool partial, const T* weights,
               double (&stored)[2], double (&twice_mean)[2], double& squares) {
    Sums lanes;
    [[maybe_unused]] const std::uint32_t noise_key = redraw ? patch.draw[start] : 0u;
    const Lanes<T> none(T(0));
    for (std::uint32_t k = 0; k < lane_count; k += width) {
      RowSums<T> sums{{none, none}, {none, none}, {none, none}, none, none, none, none};
      for (std::uint32_t row = 0; row < full_rows; ++row)
        advance_row<false>(start + row * lane_count + k, nullptr, sums);
      if (partial) advance_row<true>(start + full_rows * lane_count + k, weights + k, sums);
      for (int axis = 0; axis < axes; ++axis) {
        sums.stored[axis].store_aligned(lanes.stored[axis] + k);
        if constexpr (mean) {
          sums.straight[axis].store_aligned(lanes.straight[axis] + k);
          sums.torn[axis].store_aligned(lanes.torn[axis] + k);
        }
      }
      if constexpr (mean) sums.along.store_aligned(lanes.along + k);
      if constexpr (energy || literal) {
        sums.squares.store_aligned(lanes.squares + k);
        sums.snaps.store_aligned(lanes.snaps + k);
      }
      if constexpr (redraw && (mean || energy)) sums.variance.store_aligned(lanes.variance + k);
    }
    for (int axis = 0; axis < axes; ++axis) stored[axis] = static_cast<double>(tree_sum(lanes.stored[axis]));
    double noise = 0.0;  // of the squares that jumps left out, once per block
    if constexpr (redraw && !literal && (mean || energy)) {
      const auto variance = static_cast<double>(tree_sum(lanes.variance));
      if (variance > 0.0)
        noise = root(variance) * normal_quantile<double>(share_of<double>(mix(noise_key ^ 0xA511E9B3u)));
    }
    if constexpr (mean) {
      const double along = static_cast<double>(tree_sum(lanes.along)) + noise;
      for (int axis = 0; axis < axes; ++axis)
        twice_mean[axis] =
            static_cast<double>(tree_sum(lanes.straight[axis])) +
            (2.0 * static_cast<double>(tree_sum(lanes.torn[axis])) + advance.direction[axis] * along) /
                advance.length;
    }
    if constexpr (energy || literal) {
      squares = static_cast<double>(tree_sum(lanes.squares)) + noise;
      totals.snaps += to_count(static_cast<double>(tree_sum(lanes.snaps)));
    }
  }

  /// Books the sums of a block that was rewritten.
  void record(Block& block, std::uint32_t b, const double (&stored)[2], const double (&twice_mean)[2],
              double squares) {
    const bool tail = patch.whole < (b + 1) * block_size;
    for (int axis = 0; axis < axes; ++axis) {
      const std::int64_t now = to_integer(stored[axis] * fixed_per_length);
      const std::int64_t mean_now = to_integer(twice_mean[axis] * fixed_per_length);
      if (tail) {
        totals.tail_stored[axis] = now;
        totals.tail_twice_mean[axis] = mean_now;
      } else {
        const auto gone = static_cast<Int128>(wrapped(advance.to[axis], block.position[axis]));
        const auto before = static_cast<Int128>(wrapped(advance.from[axis], block.position[axis]));
        totals.stored[axis] += static_cast<Int128>(now) - block.stored[axis];
        totals.offset[axis] -= gone;
        totals.twice_mean[axis] += static_cast<Int128>(mean_now) -
                                   2 * static_cast<Int128>(block.stored[axis]) -
                                   static_cast<Int128>(block_size) * (before + gone);
      }
      if (commit) {
        block.stored[axis] = now;
        block.position[axis] = advance.to[axis];
      }
    }
    if (tail) totals.tail_snapped = 1;
    if constexpr (energy || literal) totals.squares += to_integer(squares * advance.energy_unit);
  }

  static std::int64_t wrapped(std::int64_t to, std::int64_t from) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from));
  }

  /// The block's distance to its next snap, or "unknown" when nobody will ask.
  void keep_bound(Block& block, std::uint32_t, std::uint32_t, bool, const T*) const {
    if (commit) block.reach = -1.0f;
  }
};

template <class T, int axes, Rule rule, bool mean, bool energy>
void step(const PatchView<T>& patch, const Advance& advance, std::uint32_t first, std::uint32_t last,
          Totals& totals) {
  Stepper<T, axes, rule, mean, energy>(patch, advance, totals).run(first, last);
}

}  // namespace
}  // namespace bristle::detail
