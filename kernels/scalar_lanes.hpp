// The operations of lanes.hpp for plain numbers. They serve vectors of one lane, and steps so long that each
// bristle is stepped by itself.
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

inline std::uint32_t bits_of_number(float x) {
  std::uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}
inline std::uint64_t bits_of_number(double x) {
  std::uint64_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}
inline float number_from(std::uint32_t bits) {
  float x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}
inline double number_from(std::uint64_t bits) {
  double x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

template <class T>
T exponent_of(T x);
template <>
inline float exponent_of(float x) {
  return static_cast<float>(static_cast<std::int32_t>(bits_of_number(x) >> 23) - 127);
}
template <>
inline double exponent_of(double x) {
  return static_cast<double>(static_cast<std::int64_t>(bits_of_number(x) >> 52) - 1023);
}
template <class T>
T mantissa_of(T x);
template <>
inline float mantissa_of(float x) {
  return number_from((bits_of_number(x) & 0x7FFFFFu) | 0x3F800000u);
}
template <>
inline double mantissa_of(double x) {
  return number_from((bits_of_number(x) & std::uint64_t{0xFFFFFFFFFFFFF}) |
                     std::uint64_t{0x3FF0000000000000});
}
template <class T>
T power_of_two(T k);
template <>
inline float power_of_two(float k) {
  return number_from(static_cast<std::uint32_t>(static_cast<std::int32_t>(k) + 127) << 23);
}
template <>
inline double power_of_two(double k) {
  return number_from(static_cast<std::uint64_t>(static_cast<std::int64_t>(k) + 1023) << 52);
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

/// Mixes 64 bits by SplitMix64's finaliser, a bijection, to make random numbers from keys.
inline std::uint64_t mix64(std::uint64_t x) {
  x ^= x >> 30;
  x *= 0xBF58476D1CE4E5B9u;
  x ^= x >> 27;
  x *= 0x94D049BB133111EBu;
  x ^= x >> 31;
  return x;
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
