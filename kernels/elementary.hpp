// exp, log and the inverse normal law in plain arithmetic, for whatever has + - * / and the operations
// of lanes.hpp (vectors) or of the reference (scalars). No libm: glibc picks variants with other bits
// by CPU at run time, and these reach the state.
#pragma once

// The operations must be known before the templates that use them.
#if defined(BRISTLE_KERNEL_ISA)
#include "lanes.hpp"
#else
#include "scalar_lanes.hpp"
#endif

namespace bristle::detail {
namespace {

/// Natural logarithm of a positive normal number: exponent ln 2 + 2 artanh((m - 1) / (m + 1)) by its
/// series, |t| <= 0.172. Error below 2 ulp.
template <class T, class V>
inline V natural_log(V x) {
  constexpr int terms = sizeof(T) == 4 ? 5 : 11;
  V exponent = exponent_of<T>(x);
  V mantissa = mantissa_of<T>(x);
  const auto high = mantissa > V(T(1.4142135623730951));
  mantissa = select_lanes(high, mantissa * V(T(0.5)), mantissa);
  exponent = select_lanes(high, exponent + V(T(1)), exponent);
  const V t = divide(mantissa - V(T(1)), mantissa + V(T(1)));
  const V t2 = t * t;
  V series(T(1) / T(2 * terms + 1));
  for (int k = terms - 1; k >= 0; --k) series = series * t2 + V(T(1) / T(2 * k + 1));
  return exponent * V(T(0.6931471805599453)) + (t + t) * series;
}

/// exp(y) for |y| < 80: 2^k times the Taylor series on |r| <= 0.347. Error below 2 ulp and |y| ulp.
template <class T, class V>
inline V exponential(V y) {
  constexpr int terms = sizeof(T) == 4 ? 7 : 13;
  constexpr T offset = T(1024);  // makes the argument of whole_part positive
  const V k = whole_part(y * V(T(1.4426950408889634)) + V(offset + T(0.5))) - V(offset);
  // ln 2 in two parts: k times the first is exact.
  const V r = (y - k * V(T(0.693145751953125))) - k * V(T(1.4286068203094173e-06));
  V factor(T(1));
  V series(T(1));
  constexpr T inverse[] = {T(1),     T(1) / 1, T(1) / 2, T(1) / 3,  T(1) / 4,  T(1) / 5,  T(1) / 6,
                           T(1) / 7, T(1) / 8, T(1) / 9, T(1) / 10, T(1) / 11, T(1) / 12, T(1) / 13};
  for (int i = terms; i >= 1; --i) series = series * (r * V(inverse[i])) + factor;
  return series * power_of_two<T>(k);
}

/// Inverse of the normal distribution function for 2^-26 < p < 1 - 2^-26, relative error 1e-7
/// (Wichura, algorithm AS 241, PPND7, Appl. Statist. 37, 1988).
template <class T, class V>
inline V normal_quantile(V p) {
  const V q = p - V(T(0.5));
  const V rc = V(T(0.180625)) - q * q;
  const V central =
      q * divide(((V(T(59.109374720)) * rc + V(T(159.29113202))) * rc + V(T(50.434271938))) * rc +
                     V(T(3.3871327179)),
                 ((V(T(67.187563600)) * rc + V(T(78.757757664))) * rc + V(T(17.895169469))) * rc + V(T(1)));
  const V smaller = least(p, V(T(1)) - p);
  const V rt = root(V(T(0)) - natural_log<T>(most(smaller, V(T(2.98e-8))))) - V(T(1.6));
  const V tail = divide(
      ((V(T(0.17023821103)) * rt + V(T(1.3067284816))) * rt + V(T(2.7568153900))) * rt + V(T(1.4234372777)),
      (V(T(0.12021132975)) * rt + V(T(0.73700164250))) * rt + V(T(1)));
  const V signed_tail = select_lanes(q < V(T(0)), V(T(0)) - tail, tail);
  return select_lanes(rc < V(T(0)), signed_tail, central);
}

}  // namespace
}  // namespace bristle::detail
