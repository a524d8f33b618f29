// Redraw over long ways, in law: what a bristle has met at the end of many snaps, for vectors and plain
// numbers V (core/MODEL.md, "Jumps"). The scalar reference has a text of its own to compare with.
#pragma once

#include "elementary.hpp"
#include "law.hpp"

namespace bristle::detail {
namespace {

/// Where a way ends that has forgotten its beginning.
template <class V>
struct Meeting {
  V length;  ///< snap length of the bristle met
  V age;     ///< its deflection
};

/// Snaps that a jump left out.
template <class V>
struct LeftOut {
  V squares;   ///< sum of delta^2, in the mean
  V variance;  ///< of that sum
  V count;
};

/// Stationary law: the bristle met is length-biased, its age uniform. u, v: uniform numbers.
template <class T, class V>
[[gnu::always_inline]] inline Meeting<V> meet(const KernelLaw& law, V u, V v, V rest) {
  const V none(T(0));
  V length;
  V age;
  if (law.kind == law_exponential) {
    const V a(static_cast<T>(law.a));
    age = a * (none - natural_log<T>(u));
    length = age + most(a * (none - natural_log<T>(v)), V(static_cast<T>(law.shortest)));
  } else {
    length = length_met<T>(law, u);
    age = v * length;
  }
  return {length - positive_part(age - rest), least(age, rest)};
}

/// Of a stationary jump over the distance `jumped`.
template <class T, class V>
[[gnu::always_inline]] inline LeftOut<V> left_out_by_meeting(const KernelLaw& law, V jumped) {
  const auto constant = [](double x) { return V(static_cast<T>(x)); };
  V squares = constant(law.squares_per_length) * jumped + constant(law.squares_offset);
  V variance = constant(law.variance_per_length) * jumped + constant(law.variance_offset);
  if (law.kind == law_exponential) {
    // Exact for any distance.
    const V x = jumped * constant(law.inverse_mean);
    const V e = exponential<T>(constant(0.0) - least(x, constant(80.0)));
    const V m2 = constant(law.mean * law.mean);
    squares = m2 * (constant(2.0) * (x - constant(1.0) + e));
    variance = m2 * m2 *
               (constant(8.0) * x - constant(28.0) +
                e * (constant(32.0) + x * (constant(16.0) + constant(8.0) * x) - constant(4.0) * e));
  }
  return {positive_part(squares), positive_part(variance),
          whole_part(jumped * constant(law.inverse_mean) + constant(law.count_offset + 0.5))};
}

/// A jump over k renewals at once.
template <class V>
struct Renewals {
  V distance;
  V count;
};

/// Their sum by a Cornish-Fisher expansion to the fourth cumulant. `share`: a uniform number.
template <class T, class V>
[[gnu::always_inline]] inline Renewals<V> jump_renewals(const KernelLaw& law, V share, V rest) {
  const auto constant = [](double x) { return V(static_cast<T>(x)); };
  const V deviation = constant(law.deviation);
  const V pad = constant(4.5) * deviation * root(rest * constant(law.inverse_mean));
  const V k = whole_part((rest - pad) * constant(law.inverse_mean));
  const V z = normal_quantile<T>(share);
  const V s = root(k);
  const V skewness = divide(constant(law.skewness), s);
  const V kurtosis = divide(constant(law.kurtosis), k);
  const V z2 = z * z;
  const V z3 = z2 * z;
  const V w = z + skewness * V(T(1) / T(6)) * (z2 - constant(1.0)) +
              kurtosis * V(T(1) / T(24)) * (z3 - constant(3.0) * z) -
              skewness * skewness * V(T(1) / T(36)) * (constant(2.0) * z3 - constant(5.0) * z);
  return {least(k * constant(law.mean) + deviation * s * w, rest), k};
}

template <class T, class V>
[[gnu::always_inline]] inline LeftOut<V> left_out_by_renewals(const KernelLaw& law,
                                                              const Renewals<V>& jumped) {
  const auto constant = [](double x) { return V(static_cast<T>(x)); };
  const V k = jumped.count;
  return {
      k * constant(law.square_mean) + constant(law.square_slope) * (jumped.distance - k * constant(law.mean)),
      k * constant(law.square_residual), k};
}

}  // namespace
}  // namespace bristle::detail
