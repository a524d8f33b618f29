// The instruction set "scalar", the reference for all others: a vector of lanes.hpp is a plain number, and a
// mask is a bool.
#pragma once

#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

template <class T>
using Lanes = T;
template <class T>
using Mask = bool;
template <class T>
constexpr std::uint32_t width_of = 1;

template <class T>
inline T load(const T* from) {
  return *from;
}
template <class T>
inline T load_any(const T* from) {
  return *from;
}
template <class T>
inline void put_lanes(T* to, T x) {
  *to = x;
}
template <class T>
inline void put_any(T* to, T x) {
  *to = x;
}
template <class T>
inline T magnitude(T a) {
  return a < T(0) ? -a : a;
}
template <class T>
inline T positive_part(T a) {
  return most(a, T(0));
}
template <class T>
inline std::uint32_t bits_of_mask(bool which) {
  return which ? 1u : 0u;
}

/// Random state of one bristle. `next` advances it if the mask is set, and gives a number strictly between 0
/// and 1 (see share_of).
template <class T>
struct RandomStates {
  std::uint32_t state;

  RandomStates() = default;
  explicit RandomStates(const std::uint32_t* from) : state(*from) {}
  void store(std::uint32_t* to) const { *to = state; }

  T next(bool which) {
    if (which) state += random_stride;
    return share_of<T>(mix(state));
  }
};

}  // namespace
}  // namespace bristle::detail
