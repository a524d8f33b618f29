// exp, log, the normal distribution and its inverse in plain scalar arithmetic, for set-up code. Of the C
// library only sqrt is used: glibc selects variants of the other functions by CPU at run time, with different
// last bits, and these results enter the state of patches, which must be equal everywhere. Build with
// -ffp-contract=off. (kernels/elementary.hpp has the vector versions, which trade the last digits for speed.)
#pragma once

#include <cstdint>
#include <cstring>

namespace bristle::detail {

inline constexpr double infinity = __builtin_inf();
inline constexpr double not_a_number = __builtin_nan("");

inline double square_root(double x) noexcept { return __builtin_sqrt(x); }
inline double magnitude(double x) noexcept { return x < 0.0 ? -x : x; }
inline double square(double x) noexcept { return x * x; }

inline std::uint64_t bits_of(double x) noexcept {
  std::uint64_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}

inline double from_bits(std::uint64_t bits) noexcept {
  double x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

/// Returns 2^k for -1022 <= k <= 1023, made from its bits.
inline double power_of_two(int k) noexcept { return from_bits(static_cast<std::uint64_t>(k + 1023) << 52); }

/// Returns (exp(r) - 1 - r) / r^2 for |r| <= 0.35 by its Taylor series; the first term left out is 1e-19.
inline double exp_remainder(double r) noexcept {
  constexpr double inverse_factorial[] = {1.0 / 2,          1.0 / 6,        1.0 / 24,        1.0 / 120,
                                          1.0 / 720,        1.0 / 5040,     1.0 / 40320,     1.0 / 362880,
                                          1.0 / 3628800,    1.0 / 39916800, 1.0 / 479001600, 1.0 / 6227020800,
                                          1.0 / 87178291200};
  double sum = inverse_factorial[12];
  for (int i = 11; i >= 0; --i) sum = sum * r + inverse_factorial[i];
  return sum;
}

// ln 2 as the sum of two numbers, so that x - k ln 2 loses no digits: products of the first number with
// integers up to 2^11 are exact.
inline constexpr double ln2_high = 0x1.62e42feep-1;
inline constexpr double ln2_low = 0x1.a39ef35793c76p-33;

/// Returns exp(x), error below 1 ulp; 0 and infinity beyond the range of double.
inline double exp(double x) noexcept {
  if (x != x) return x;
  if (x > 709.79) return infinity;
  if (x < -745.2) return 0.0;
  const int k = static_cast<int>(x * 1.4426950408889634 + (x < 0.0 ? -0.5 : 0.5));
  const double high = x - k * ln2_high;
  const double low = k * ln2_low;
  const double r = high - low;
  const double y = 1.0 + (high + (r * r * exp_remainder(r) - low));
  // Multiplies by 2^k in two factors. A single factor would overflow or vanish where the result near an end
  // of the range of double does not.
  const int half = k / 2;
  return y * power_of_two(half) * power_of_two(k - half);
}

/// Returns exp(x) - 1. At small x no digits cancel, as they would in exp(x) less 1.
inline double expm1(double x) noexcept {
  if (magnitude(x) < 0.35) return x + x * x * exp_remainder(x);
  return exp(x) - 1.0;
}

/// Returns the natural logarithm, error below 1 ulp. log(0) = -infinity, NaN below 0.
inline double log(double x) noexcept {
  if (x != x || x < 0.0) return not_a_number;
  if (x == 0.0) return -infinity;
  if (x == infinity) return infinity;
  int k = 0;
  if (x < 0x1p-1022) {
    x *= 0x1p54;
    k = -54;
  }
  const std::uint64_t bits = bits_of(x);
  k += static_cast<int>(bits >> 52) - 1023;
  double m = from_bits((bits & 0x000fffffffffffffULL) | 0x3ff0000000000000ULL);
  if (m > 1.4142135623730951) {
    m *= 0.5;
    ++k;
  }
  // Computes log(1 + f) = 2 artanh(s) with s = f / (2 + f), |s| <= 0.172. The leading terms f - f^2/2 are
  // added separately, so they do not have the rounding error of s.
  const double f = m - 1.0;
  const double s = f / (2.0 + f);
  const double s2 = s * s;
  double series = 2.0 / 25;
  for (int j = 23; j >= 3; j -= 2) series = series * s2 + 2.0 / j;
  series *= s2;
  const double half_f2 = 0.5 * f * f;
  return k * ln2_high - ((half_f2 - (s * (half_f2 + series) + k * ln2_low)) - f);
}

/// Returns log(1 + x). At small x no digits are lost, as they would be in the sum 1 + x.
inline double log1p(double x) noexcept {
  const double u = 1.0 + x;
  if (u == 1.0) return x;
  if (u == 0.0 || u == infinity) return log(u);
  // Corrects the rounding error of u = 1 + x to first order (Kahan).
  return log(u) + (x - (u - 1.0)) / u;
}

/// Returns asinh(x) for x >= 0.
inline double asinh(double x) noexcept {
  if (x > 1e8) return log(x) + 0.6931471805599453;
  return log1p(x + x * x / (1.0 + square_root(1.0 + x * x)));
}

/// Returns exp(-x^2/2), accurate also in the far tails, because x^2 is split into an exact part and a small
/// remainder.
inline double exp_half_square(double x) noexcept {
  const double high = from_bits(bits_of(x) & 0xfffffffff8000000ULL);
  const double low = x - high;
  if (!(magnitude(x) < 40.0)) return x == x ? 0.0 : x;
  return exp(-0.5 * high * high) * exp(-0.5 * low * (x + high));
}

/// Returns the density of the standard normal law at x.
inline double normal_density(double x) noexcept { return 0.3989422804014327 * exp_half_square(x); }

/// Computes P(X > z) of the standard normal law for several z >= 0, as the Mills ratio times the density. (4
/// + z) times that ratio is a Chebyshev series in t = (z - 4) / (z + 4), with coefficients from 113-bit
/// arithmetic. Several z are computed side by side, because the steps for one z wait for each other.
template <int n>
inline void normal_upper_tails(const double (&z)[n], double (&tail)[n]) noexcept {
  constexpr double chebyshev[] = {
      1.94090240913215317e+00,  -7.51708816839570582e-01, 2.22193555675251037e-01,  -4.85177532604460851e-02,
      6.92592049624248061e-03,  -3.20598474398149950e-04, -1.00547391632106788e-04, 1.89033690197069647e-05,
      1.01035688547463097e-06,  -6.14533474939782407e-07, -3.38102012006917555e-09, 2.06865080617428327e-08,
      -1.12826036324695066e-10, -7.77401522838869461e-10, -9.94142419140470796e-12, 3.17448294985830310e-11,
      1.84248068447049385e-12,  -1.31286164667109651e-12, -1.74153626526548131e-13, 4.90727403170442438e-14,
      1.29313843261655758e-14,  -1.21806635217263412e-15, -8.05214737262093315e-16, -2.86049414426162132e-17,
      4.05706442433535364e-17,  7.00640077281459613e-18};
  double t[n], b1[n] = {}, b2[n] = {};  // variables of Clenshaw's recurrence
  for (int i = 0; i < n; ++i) {
    const double within = z[i] > 40.0 ? 40.0 : z[i];  // keeps infinity out of the division below
    t[i] = (within - 4.0) / (within + 4.0);
  }
  for (int k = 25; k >= 1; --k)
    for (int i = 0; i < n; ++i) {
      const double b0 = 2.0 * t[i] * b1[i] - b2[i] + chebyshev[k];
      b2[i] = b1[i];
      b1[i] = b0;
    }
  for (int i = 0; i < n; ++i) {
    const double mills = t[i] * b1[i] - b2[i] + 0.5 * chebyshev[0];
    tail[i] = z[i] > 40.0 ? 0.0 : exp_half_square(z[i]) * mills / (4.0 + z[i]);
  }
}
inline double normal_upper_tail(double z) noexcept {
  const double at[1] = {z};
  double tail[1];
  normal_upper_tails(at, tail);
  return tail[0];
}

/// Maps t in [0, 1] to a share of a law. Equal steps of t give shares that lie close together at both ends of
/// the law.
inline double crowded_share(double t) noexcept { return t * t * t * (10.0 - 15.0 * t + 6.0 * t * t); }

/// Returns the distribution function of the standard normal law; small relative error in the lower tail.
inline double normal_cdf(double z) noexcept {
  if (z != z) return z;
  return z < 0.0 ? normal_upper_tail(-z) : 1.0 - normal_upper_tail(z);
}

/// Returns the inverse of normal_cdf, relative error about 1e-16 (Wichura, algorithm AS 241, PPND16, Appl.
/// Statist. 37, 1988). -infinity at 0, infinity at 1, NaN outside.
inline double normal_quantile(double p) noexcept {
  if (!(p >= 0.0 && p <= 1.0)) return not_a_number;
  const double q = p - 0.5;
  if (magnitude(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q *
           (((((((2509.0809287301226727 * r + 33430.575583588128105) * r + 67265.770927008700853) * r +
                45921.953931549871457) *
                   r +
               13731.693765509461125) *
                  r +
              1971.5909503065514427) *
                 r +
             133.14166789178437745) *
                r +
            3.387132872796366608) /
           (((((((5226.495278852854561 * r + 28729.085735721942674) * r + 39307.89580009271061) * r +
                21213.794301586595867) *
                   r +
               5394.1960214247511077) *
                  r +
              687.1870074920579083) *
                 r +
             42.313330701600911252) *
                r +
            1.0);
  }
  const double tail = q < 0.0 ? p : 1.0 - p;
  if (tail == 0.0) return q < 0.0 ? -infinity : infinity;
  double r = square_root(-log(tail));
  double z;
  if (r <= 5.0) {
    r -= 1.6;
    z = (((((((7.7454501427834140764e-4 * r + 0.0227238449892691845833) * r + 0.24178072517745061177) * r +
             1.27045825245236838258) *
                r +
            3.64784832476320460504) *
               r +
           5.7694972214606914055) *
              r +
          4.6303378461565452959) *
             r +
         1.42343711074968357734) /
        (((((((1.05075007164441684324e-9 * r + 5.475938084995344946e-4) * r + 0.0151986665636164571966) * r +
             0.14810397642748007459) *
                r +
            0.68976733498510000455) *
               r +
           1.6763848301838038494) *
              r +
          2.05319162663775882187) *
             r +
         1.0);
  } else {
    r -= 5.0;
    z = (((((((2.01033439929228813265e-7 * r + 2.71155556874348757815e-5) * r + 0.0012426609473880784386) *
                 r +
             0.026532189526576123093) *
                r +
            0.29656057182850489123) *
               r +
           1.7848265399172913358) *
              r +
          5.4637849111641143699) *
             r +
         6.6579046435011037772) /
        (((((((2.04426310338993978564e-15 * r + 1.4215117583164458887e-7) * r + 1.8463183175100546818e-5) *
                 r +
             7.868691311456132591e-4) *
                r +
            0.0148753612908506148525) *
               r +
           0.13692988092273580531) *
              r +
          0.59983220655588793769) *
             r +
         1.0);
  }
  return q < 0.0 ? -z : z;
}

}  // namespace bristle::detail
