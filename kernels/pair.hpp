// Two vectors processed together: in the chain of dependent operations of a slide (quotient, exp, quotient)
// each waits for the one before, and a second chain fills the wait. Members have names, because an array of
// two would be kept in memory. (Four vectors are slower: they exceed the registers.)
#pragma once

#include "lanes.hpp"

namespace bristle::detail {
namespace {

#define BRISTLE_PAIR_INLINE [[gnu::always_inline]] inline

template <class T>
struct PairMask {
  Mask<T> a, b;
};

template <class T>
struct Pair {
  Lanes<T> a, b;

  Pair() = default;
  Pair(Lanes<T> first, Lanes<T> second) : a(first), b(second) {}
  explicit Pair(T x) : a(x), b(x) {}
  explicit Pair(Lanes<T> x) : a(x), b(x) {}
};

#define BRISTLE_PAIR_OPERATOR(result, operand, op)                                      \
  template <class T>                                                                    \
  BRISTLE_PAIR_INLINE result<T> operator op(const operand<T>& x, const operand<T>& y) { \
    return {x.a op y.a, x.b op y.b};                                                    \
  }
BRISTLE_PAIR_OPERATOR(Pair, Pair, +)
BRISTLE_PAIR_OPERATOR(Pair, Pair, -)
BRISTLE_PAIR_OPERATOR(Pair, Pair, *)
BRISTLE_PAIR_OPERATOR(PairMask, Pair, <)
BRISTLE_PAIR_OPERATOR(PairMask, Pair, >)
BRISTLE_PAIR_OPERATOR(PairMask, PairMask, &)
BRISTLE_PAIR_OPERATOR(PairMask, PairMask, |)
#undef BRISTLE_PAIR_OPERATOR

#define BRISTLE_PAIR_FUNCTION(name)                                      \
  template <class T>                                                     \
  BRISTLE_PAIR_INLINE Pair<T> name(const Pair<T>& x, const Pair<T>& y) { \
    return {name(x.a, y.a), name(x.b, y.b)};                             \
  }
BRISTLE_PAIR_FUNCTION(divide)
BRISTLE_PAIR_FUNCTION(least)
BRISTLE_PAIR_FUNCTION(most)
#undef BRISTLE_PAIR_FUNCTION

template <class T>
BRISTLE_PAIR_INLINE Pair<T> root(const Pair<T>& x) {
  return {root(x.a), root(x.b)};
}
template <class T>
BRISTLE_PAIR_INLINE Pair<T> power_of_two(const Pair<T>& x) {
  return {power_of_two<T>(x.a), power_of_two<T>(x.b)};
}
template <class T>
BRISTLE_PAIR_INLINE Pair<T> select_lanes(const PairMask<T>& which, const Pair<T>& x, const Pair<T>& y) {
  return {select_lanes<T>(which.a, x.a, y.a), select_lanes<T>(which.b, x.b, y.b)};
}
template <class T>
BRISTLE_PAIR_INLINE bool any_lane(const PairMask<T>& which) {
  return xsimd::any(which.a | which.b);
}

/// Loads one vector or a pair of vectors, whichever the type V is, from a column.
template <class V, class T>
BRISTLE_PAIR_INLINE V load_as(const T* from) {
  if constexpr (sizeof(V) == sizeof(Lanes<T>))
    return load(from);
  else
    return {load(from), load(from + Lanes<T>::size)};
}
template <class T>
BRISTLE_PAIR_INLINE void store(const Lanes<T>& from, T* to) {
  from.store_aligned(to);
}
template <class T>
BRISTLE_PAIR_INLINE void store(const Pair<T>& from, T* to) {
  from.a.store_aligned(to);
  from.b.store_aligned(to + Lanes<T>::size);
}
/// Adds the values x of the vector of bristles from i on to the sum of a row, lane by lane.
template <class T>
BRISTLE_PAIR_INLINE void add_to(Row<T>& row, std::uint32_t i, const Lanes<T>& x) {
  const std::uint32_t part = i / Lanes<T>::size % Row<T>::parts;
  row.part[part] = row.part[part] + x;
}
template <class T>
BRISTLE_PAIR_INLINE void add_to(Row<T>& row, std::uint32_t i, const Pair<T>& x) {
  add_to(row, i, x.a);
  add_to(row, i + Lanes<T>::size, x.b);
}

#undef BRISTLE_PAIR_INLINE

}  // namespace
}  // namespace bristle::detail
