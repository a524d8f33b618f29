// Redraw: what bristles do after their first snap in a step, when each snap brings a fresh length.
//
// The bristles of a block go round by round: in a round every bristle still on its way draws a length
// and either ends on it or snaps again. Rows of 16 with nobody on the way are left out. All rows of a
// block share a round, so that the latencies of their draws overlap and no branch depends on a single
// bristle (measured: three times faster than finishing row after row). Long ways are jumped in law
// (core/MODEL.md, "Jumps").
#pragma once

#include "lanes.hpp"
#include "law.hpp"

namespace bristle::detail {
namespace {

/// Bristles of one block on their way after the first snap.
template <class T>
struct Walk {
  alignas(64) T rest[block_size];      ///< path left; negative: arrived
  alignas(64) T landed[block_size];    ///< deflection along the motion at the end; negative: did not snap
  alignas(64) T length[block_size];    ///< snap length of the bristle it ends on
  alignas(64) T squares[block_size];   ///< sum of delta^2 over the snaps after the first
  alignas(64) T count[block_size];     ///< of these
  alignas(64) T variance[block_size];  ///< of the squares that jumps left out
  alignas(64) std::uint32_t state[block_size];
};

/// Takes lanes with a long way ahead to its end, or near it, in law.
template <class T, bool sums>
[[gnu::noinline]] void jump(const KernelLaw& law, Mask<T> open, Walk<T>& walk, std::uint32_t i,
                            DrawStates<T>& states) {
  const auto constant = [](double x) { return Lanes<T>(static_cast<T>(x)); };
  const Lanes<T> none(T(0));
  Lanes<T> rest = load(walk.rest + i);
  Lanes<T> squares = load(walk.squares + i);
  Lanes<T> count = load(walk.count + i);
  Lanes<T> variance = load(walk.variance + i);
  if (!law.many) {
    // Stationary law: the bristle met is length-biased, its age uniform.
    const Mask<T> jumps = open & (rest > constant(law.jump_from));
    const Lanes<T> u = states.next(jumps);
    const Lanes<T> v = states.next(jumps);
    Lanes<T> met;
    Lanes<T> age;
    if (law.kind == law_exponential) {
      age = constant(law.a) * (none - natural_log<T>(u));
      met = age + most(constant(law.a) * (none - natural_log<T>(v)), constant(law.shortest));
    } else {
      met = length_met<T>(law, u);
      age = v * met;
    }
    met = met - positive_part(age - rest);
    age = least(age, rest);
    if constexpr (sums) {
      const Lanes<T> jumped = rest - age;
      Lanes<T> more;
      Lanes<T> spread;
      if (law.kind == law_exponential) {
        // Exact for any distance.
        const Lanes<T> x = jumped * constant(law.inverse_mean);
        const Lanes<T> e = exponential<T>(none - least(x, constant(80.0)));
        const Lanes<T> m2 = constant(law.mean * law.mean);
        more = m2 * (constant(2.0) * (x - constant(1.0) + e));
        spread = m2 * m2 *
                 (constant(8.0) * x - constant(28.0) +
                  e * (constant(32.0) + x * (constant(16.0) + constant(8.0) * x) - constant(4.0) * e));
      } else {
        more = constant(law.squares_per_length) * jumped + constant(law.squares_offset);
        spread = constant(law.variance_per_length) * jumped + constant(law.variance_offset);
      }
      const Lanes<T> renewals =
          whole_part(jumped * constant(law.inverse_mean) + constant(law.count_offset + 0.5));
      squares = select_lanes(jumps, squares + positive_part(more), squares);
      variance = select_lanes(jumps, variance + positive_part(spread), variance);
      count = select_lanes(jumps & (jumped > none), count + renewals, count);
    }
    select_lanes(jumps, least(age, met), load(walk.landed + i)).store_aligned(walk.landed + i);
    select_lanes(jumps, met, load(walk.length + i)).store_aligned(walk.length + i);
    rest = select_lanes(jumps, constant(-1.0), rest);
  } else {
    // k renewals at once, their sum by a Cornish-Fisher expansion to the fourth cumulant.
    for (;;) {
      const Mask<T> jumps = open & (rest > constant(law.jump_from));
      if (!xsimd::any(jumps)) break;
      const Lanes<T> m1 = constant(law.mean);
      const Lanes<T> inverse = constant(law.inverse_mean);
      const Lanes<T> deviation = constant(law.deviation);
      const Lanes<T> safe = select_lanes(jumps, rest, constant(law.jump_from));
      const Lanes<T> pad = constant(6.0) * deviation * root(safe * inverse);
      const Lanes<T> k = whole_part((safe - pad) * inverse) - constant(1.0);
      const Lanes<T> z = normal_quantile<T>(states.next(jumps));
      const Lanes<T> s = root(k);
      const Lanes<T> skewness = divide(constant(law.skewness), s);
      const Lanes<T> kurtosis = divide(constant(law.kurtosis), k);
      const Lanes<T> z2 = z * z;
      const Lanes<T> z3 = z2 * z;
      const Lanes<T> w =
          z + skewness * Lanes<T>(T(1) / T(6)) * (z2 - constant(1.0)) +
          kurtosis * Lanes<T>(T(1) / T(24)) * (z3 - constant(3.0) * z) -
          skewness * skewness * Lanes<T>(T(1) / T(36)) * (constant(2.0) * z3 - constant(5.0) * z);
      const Lanes<T> jumped = least(k * m1 + deviation * s * w, safe);
      if constexpr (sums) {
        const Lanes<T> more = k * constant(law.square_mean) + constant(law.square_slope) * (jumped - k * m1);
        squares = select_lanes(jumps, squares + more, squares);
        variance = select_lanes(jumps, variance + k * constant(law.square_residual), variance);
        count = select_lanes(jumps, count + k, count);
      }
      rest = select_lanes(jumps, rest - jumped, rest);
    }
  }
  rest.store_aligned(walk.rest + i);
  if constexpr (sums) {
    squares.store_aligned(walk.squares + i);
    count.store_aligned(walk.count + i);
    variance.store_aligned(walk.variance + i);
  }
}

/// Walks all bristles of the rows in `rows` (a bit each) to the end of the step. `longest_rest` bounds
/// their ways; `sums`: squares, counts and variances are wanted.
template <class T, bool sums, bool uniform>
void walk_rounds(const KernelLaw& law, T longest_rest, std::uint32_t rows, Walk<T>& walk) {
  constexpr std::uint32_t width = Lanes<T>::size;
  const Lanes<T> none(T(0));
  const Lanes<T> low(static_cast<T>(law.a));
  const Lanes<T> span(static_cast<T>(law.b));
  const bool may_jump = longest_rest > static_cast<T>(law.jump_from);
  while (rows != 0) {
    std::uint32_t still = 0;
    for (std::uint32_t left = rows; left != 0; left &= left - 1) {
      const auto row = static_cast<std::uint32_t>(__builtin_ctz(left));
      bool any = false;
      for (std::uint32_t k = 0; k < lane_count; k += width) {
        const std::uint32_t i = row * lane_count + k;
        Lanes<T> rest = load(walk.rest + i);
        Mask<T> open = rest >= none;
        DrawStates<T> states(walk.state + i);
        if (may_jump && xsimd::any(rest > Lanes<T>(static_cast<T>(law.jump_from)))) {
          jump<T, sums>(law, open, walk, i, states);
          rest = load(walk.rest + i);
          open = rest >= none;
        }
        const Lanes<T> share = states.next(open);
        Lanes<T> drawn;
        if constexpr (uniform)
          drawn = low + span * share;
        else
          drawn = other_length<T>(law, share);
        const Lanes<T> after = rest - drawn;
        const Mask<T> ends = open & (after < none);
        const Mask<T> snaps = open & (after >= none);
        select_lanes(ends, rest, load(walk.landed + i)).store_aligned(walk.landed + i);
        select_lanes(open, drawn, load(walk.length + i)).store_aligned(walk.length + i);
        select_lanes(open, after, rest).store_aligned(walk.rest + i);
        states.store(walk.state + i);
        if constexpr (sums) {
          const Lanes<T> squares = load(walk.squares + i);
          const Lanes<T> count = load(walk.count + i);
          select_lanes(snaps, squares + drawn * drawn, squares).store_aligned(walk.squares + i);
          select_lanes(snaps, count + Lanes<T>(T(1)), count).store_aligned(walk.count + i);
        }
        any = any || xsimd::any(snaps);
      }
      still |= any ? 1u << row : 0u;
    }
    rows = still;
  }
}

template <class T, bool sums>
inline void walk_rounds(const KernelLaw& law, T longest_rest, std::uint32_t rows, Walk<T>& walk) {
  if (law.kind == law_uniform)
    walk_rounds<T, sums, true>(law, longest_rest, rows, walk);
  else
    walk_rounds<T, sums, false>(law, longest_rest, rows, walk);
}

}  // namespace
}  // namespace bristle::detail
