// exp, log and the inverse normal distribution in plain arithmetic, for any type with + - * / and the
// operations of lanes.hpp (vectors) or scalar_lanes.hpp (plain numbers). The C library is not used: glibc
// chooses variants with other bits by CPU at run time, and the results reach the state of a patch.
#pragma once

#include <cstddef>

#include "bundle.hpp"

namespace bristle::detail {
namespace {

/// Returns the natural logarithm of a positive normal number x = m 2^k, as k ln 2 + 2 artanh(t) with t = (m -
/// 1) / (m + 1), by the series for |t| <= 0.172. Error below 2 ulp.
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

/// Returns exp(y) for |y| < 80: 2^k times the Taylor series of the remainder r = y - k ln 2, |r| <= 0.347.
/// Error below 2 ulp and |y| ulp.
template <class T, class V>
inline V exponential(V y) {
  constexpr int terms = sizeof(T) == 4 ? 7 : 13;
  constexpr T offset = T(1024);  // makes the argument of whole_part() positive, as it must be
  const V k = whole_part(y * V(T(1.4426950408889634)) + V(offset + T(0.5))) - V(offset);
  // Subtracts k ln 2 with ln 2 in two parts, so that no digit is lost: k times the first part is exact.
  const V r = (y - k * V(T(0.693145751953125))) - k * V(T(1.4286068203094173e-06));
  constexpr double inverse_factorial[] = {1.0,
                                          1.0,
                                          1.0 / 2,
                                          1.0 / 6,
                                          1.0 / 24,
                                          1.0 / 120,
                                          1.0 / 720,
                                          1.0 / 5040,
                                          1.0 / 40320,
                                          1.0 / 362880,
                                          1.0 / 3628800,
                                          1.0 / 39916800,
                                          1.0 / 479001600,
                                          1.0 / 6227020800};
  V series(static_cast<T>(inverse_factorial[terms]));
  for (int i = terms - 1; i >= 0; --i) series = series * r + V(static_cast<T>(inverse_factorial[i]));
  return series * power_of_two<T>(k);
}

/// Evaluates a polynomial; the coefficients begin with that of the highest power.
template <class T, class V, std::size_t n>
inline V polynomial(const double (&coefficients)[n], V x) {
  V sum(static_cast<T>(coefficients[0]));
  for (std::size_t i = 1; i < n; ++i) sum = sum * x + V(static_cast<T>(coefficients[i]));
  return sum;
}

/// Returns the inverse of the normal distribution function for 2^-25 <= p <= 1 - 2^-25, relative error 3e-7:
/// 2 p - 1 times a polynomial in w = -log(4 p (1 - p)) (Giles, "Approximating the erfinv function", GPU
/// Computing Gems, 2011, single precision). In the tails, three arguments in a thousand, the polynomial is in
/// the root of w.
template <class T, class V>
inline V normal_quantile(V p) {
  constexpr double centre[] = {2.81022636e-08, 3.43273939e-07, -3.5233877e-06, -4.39150654e-06, 0.00021858087,
                               -0.00125372503, -0.00417768164, 0.246640727,    1.50140941};
  constexpr double tail[] = {-0.000200214257, 0.000100950558, 0.00134934322, -0.00367342844, 0.00573950773,
                             -0.0076224613,   0.00943887047,  1.00167406,    2.83297682};
  const V one(T(1));
  const V product = p * (one - p) * V(T(4));
  const V w = V(T(0)) - natural_log<T>(most(product, V(T(1e-7))));
  V factor = polynomial<T>(centre, w - V(T(2.5)));
  const auto far = w >= V(T(5));
  if (any_lane(far))
    factor = select_lanes(far, polynomial<T>(tail, root(most(w, V(T(0)))) - V(T(3))), factor);
  return (factor * ((p + p) - one)) * V(T(1.4142135623730951));
}

}  // namespace
}  // namespace bristle::detail
