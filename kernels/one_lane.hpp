// The operations of lanes.hpp for a vector of one number. The kernels' source compiled with these operations
// is the instruction set "scalar", the reference for all others.
#pragma once

#include <cstdint>
#include <cstring>

#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

template <class T>
struct Lanes {
  static constexpr std::uint32_t size = 1;
  T x;

  Lanes() = default;
  explicit Lanes(T value) : x(value) {}
  static Lanes load_aligned(const T* from) { return Lanes(*from); }
  void store_aligned(T* to) const { *to = x; }
  static Lanes load_unaligned(const T* from) { return Lanes(*from); }
  void store_unaligned(T* to) const { *to = x; }
};

template <class T>
struct Mask {
  bool is;
};

#define BRISTLE_LANE_OPERATOR(op)                       \
  template <class T>                                    \
  inline Lanes<T> operator op(Lanes<T> a, Lanes<T> b) { \
    return Lanes<T>(static_cast<T>(a.x op b.x));        \
  }
BRISTLE_LANE_OPERATOR(+)
BRISTLE_LANE_OPERATOR(-)
BRISTLE_LANE_OPERATOR(*)
BRISTLE_LANE_OPERATOR(/)
BRISTLE_LANE_OPERATOR(&)
BRISTLE_LANE_OPERATOR(|)
#undef BRISTLE_LANE_OPERATOR

#define BRISTLE_LANE_COMPARISON(op)                    \
  template <class T>                                   \
  inline Mask<T> operator op(Lanes<T> a, Lanes<T> b) { \
    return {a.x op b.x};                               \
  }
BRISTLE_LANE_COMPARISON(<)
BRISTLE_LANE_COMPARISON(>)
BRISTLE_LANE_COMPARISON(>=)
BRISTLE_LANE_COMPARISON(<=)
BRISTLE_LANE_COMPARISON(==)
BRISTLE_LANE_COMPARISON(!=)
#undef BRISTLE_LANE_COMPARISON

template <class T>
inline Lanes<T> operator<<(Lanes<T> a, int by) {
  return Lanes<T>(a.x << by);
}
template <class T>
inline Lanes<T> operator>>(Lanes<T> a, int by) {
  return Lanes<T>(a.x >> by);
}
template <class T>
inline Mask<T> operator&(Mask<T> a, Mask<T> b) {
  return {a.is && b.is};
}
template <class T>
inline Mask<T> operator!(Mask<T> a) {
  return {!a.is};
}
template <class T>
inline Mask<T> operator|(Mask<T> a, Mask<T> b) {
  return {a.is || b.is};
}

template <class T>
inline Lanes<T> divide(Lanes<T> a, Lanes<T> b) {
  return a / b;
}
template <class T>
inline Lanes<T> root(Lanes<T> a) {
  return Lanes<T>(root(a.x));
}
template <class T>
inline Lanes<T> magnitude(Lanes<T> a) {
  return Lanes<T>(a.x < T(0) ? -a.x : a.x);
}
template <class T>
inline Lanes<T> positive_part(Lanes<T> a) {
  return Lanes<T>(most(a.x, T(0)));
}
template <class T>
inline Lanes<T> whole_part(Lanes<T> a) {
  return Lanes<T>(whole_part(a.x));
}
template <class T>
inline Lanes<T> select_lanes(Mask<T> which, Lanes<T> a, Lanes<T> b) {
  return which.is ? a : b;
}
template <class T>
inline bool any_lane(Mask<T> which) {
  return which.is;
}
template <class T>
inline std::uint32_t bits_of_mask(Mask<T> which) {
  return which.is ? 1u : 0u;
}
template <class T>
inline Lanes<T> table_entry(const T* table, Lanes<T> index) {
  return Lanes<T>(table[static_cast<std::int32_t>(index.x)]);
}
template <class T>
inline Lanes<T> small_table_entry(const T* table, Lanes<T> index) {
  return table_entry(table, index);
}
template <class T>
inline Lanes<T> least(Lanes<T> a, Lanes<T> b) {
  return Lanes<T>(least(a.x, b.x));
}
template <class T>
inline Lanes<T> most(Lanes<T> a, Lanes<T> b) {
  return Lanes<T>(most(a.x, b.x));
}

/// Returns the bits of x as a number of another type.
template <class To, class From>
inline Lanes<To> same_bits(Lanes<From> x) {
  static_assert(sizeof(To) == sizeof(From));
  Lanes<To> out;
  std::memcpy(&out.x, &x.x, sizeof out.x);
  return out;
}

/// Returns the sum of all lanes of v, of which there is one.
template <std::uint32_t count, class T>
inline T fold_lanes(Lanes<T> v) {
  static_assert(count == 1);
  return v.x;
}

/// Random state of one bristle. `next` advances it if the mask is set, and gives a number strictly between 0
/// and 1 (see share_of).
template <class T>
struct RandomStates {
  std::uint32_t state;

  RandomStates() = default;
  explicit RandomStates(const std::uint32_t* from) : state(*from) {}
  void store(std::uint32_t* to) const { *to = state; }

  Lanes<T> next(Mask<T> which) {
    if (which.is) state += random_stride;
    return Lanes<T>(share_of<T>(mix(state)));
  }
};

}  // namespace
}  // namespace bristle::detail
