// The operations of lanes.hpp for plain numbers. They serve the instruction set "scalar", and steps so long
// that each bristle is stepped by itself.
#pragma once

#include <cstdint>
#include <cstring>

#include "core/common/assert.hpp"
#include "core/kernel_table.hpp"
#include "core/random_states.hpp"

namespace bristle::detail {
namespace {

inline float select_lanes(bool which, float a, float b) { return which ? a : b; }
inline double select_lanes(bool which, double a, double b) { return which ? a : b; }
inline bool any_lane(bool which) { return which; }
inline float divide(float a, float b) { return a / b; }
inline double divide(double a, double b) { return a / b; }
inline float root(float a) { return __builtin_sqrtf(a); }
inline double root(double a) { return __builtin_sqrt(a); }
inline float least(float a, float b) { return a < b ? a : b; }
inline double least(double a, double b) { return a < b ? a : b; }
inline float most(float a, float b) { return a > b ? a : b; }
inline double most(double a, double b) { return a > b ? a : b; }
inline float whole_part(float a) { return __builtin_floorf(a); }
inline double whole_part(double a) { return __builtin_floor(a); }

/// Unsigned integer as wide as T, for work on the bits of a number.
template <class T>
struct BitsOf;
template <>
struct BitsOf<float> {
  using Type = std::uint32_t;
  static constexpr int mantissa = 23;
  static constexpr std::uint32_t exponent_bias = 127;
  // The number 2^23. Added to a float, it moves the float's whole part into the low bits, where it can be
  // read as an integer.
  static constexpr float integer_bit = 8388608.0f;
};
template <>
struct BitsOf<double> {
  using Type = std::uint64_t;
  static constexpr int mantissa = 52;
  static constexpr std::uint64_t exponent_bias = 1023;
  static constexpr double integer_bit = 4503599627370496.0;  // 2^52
};

template <class T>
inline typename BitsOf<T>::Type bits_of(T x) {
  typename BitsOf<T>::Type bits;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}
template <class T>
inline T from_bits(typename BitsOf<T>::Type bits) {
  T x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

/// Returns the value of a table over [0, 1] at `share`, linear between the entries.
template <class T>
inline T look_up(const double* table, std::int32_t last, T share) {
  BRISTLE_ASSERT(last >= 1);
  BRISTLE_ASSERT(share >= T(0) && share <= T(1));
  const T x = share * static_cast<T>(last);
  const T k = least(whole_part(x), static_cast<T>(last - 1));
  const auto at = static_cast<std::int32_t>(k);
  const T low = static_cast<T>(table[at]);
  const T high = static_cast<T>(table[at + 1]);
  return low + (high - low) * (x - k);
}

/// Returns the difference of two fixed-point positions. Positions wrap, so it is exact while below 2^63
/// units.
inline std::int64_t difference(std::int64_t to, std::int64_t from) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from));
}
/// Returns the difference of two fixed-point positions, to - from, as a scaled length.
inline double displacement(std::int64_t to, std::int64_t from) {
  return static_cast<double>(difference(to, from)) * length_per_fixed;
}

/// Converts a number of snaps to an integer. A number that is too large becomes 9e18.
inline std::uint64_t to_count(double x) {
  BRISTLE_ASSERT(x >= 0.0);
  return x < 9.0e18 ? static_cast<std::uint64_t>(x) : std::uint64_t{9000000000000000000u};
}

/// Rounds to the nearest integer, ties to even, as the vector instructions do.
inline std::int64_t to_integer(double x) {
  BRISTLE_ASSERT(x > -9.2e18 && x < 9.2e18);
  return __builtin_llrint(x);
}

/// Returns the sum of the 16 logical lanes, added in the same order on every instruction set. Overwrites its
/// argument.
template <class T>
inline T tree_sum(T (&lane)[lane_count]) {
  for (std::uint32_t half = lane_count / 2; half > 0; half /= 2)
    for (std::uint32_t i = 0; i < half; ++i) lane[i] += lane[i + half];
  return lane[0];
}

}  // namespace
}  // namespace bristle::detail
