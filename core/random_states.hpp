// Random numbers of bristles. A bristle's state is advanced by random_stride (kernel_table.hpp) and mixed to
// give a number. Kernels include this header, so its functions have internal linkage.
#pragma once

#include <cstdint>

namespace bristle::detail {
namespace {

/// Mixes 32 bits by two multiplications, a bijection whose low bits are poor. share_of() takes the 23 high
/// bits, so the usual last shift, which would mix the low ones, is left out.
inline std::uint32_t mix(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x21F0AAADu;
  x ^= x >> 15;
  x *= 0x735A2D97u;
  return x;
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

/// Returns a number strictly between 0 and 1 from 23 random bits. It is exact in float, as is one minus the
/// number.
template <class T>
inline T share_of(std::uint32_t random) {
  return (static_cast<T>(random >> 9) + T(0.5)) * T(1.1920928955078125e-07);  // 2^-23
}

}  // namespace
}  // namespace bristle::detail
