// Four vectors at once: a chain of dependent operations (log, polynomial, exp) waits for each result, and
// four chains fill the wait.
#pragma once

#include "lanes.hpp"

namespace bristle::detail {
namespace {

constexpr std::uint32_t quad_size = 4;

template <class T>
struct QuadMask {
  Mask<T> v[quad_size];
};

template <class T>
struct Quad {
  Lanes<T> v[quad_size];

  Quad() = default;
  explicit Quad(T x) {
    for (Lanes<T>& lanes : v) lanes = Lanes<T>(x);
  }
};

#define BRISTLE_QUAD_OPERATOR(result, op)                                      \
  template <class T>                                                           \
  inline result<T> operator op(Quad<T> a, Quad<T> b) {                         \
    result<T> out;                                                             \
    for (std::uint32_t k = 0; k < quad_size; ++k) out.v[k] = a.v[k] op b.v[k]; \
    return out;                                                                \
  }
BRISTLE_QUAD_OPERATOR(Quad, +)
BRISTLE_QUAD_OPERATOR(Quad, -)
BRISTLE_QUAD_OPERATOR(Quad, *)
BRISTLE_QUAD_OPERATOR(QuadMask, >)
BRISTLE_QUAD_OPERATOR(QuadMask, >=)
#undef BRISTLE_QUAD_OPERATOR

template <class T>
inline QuadMask<T> operator&(QuadMask<T> a, QuadMask<T> b) {
  for (std::uint32_t k = 0; k < quad_size; ++k) a.v[k] = a.v[k] & b.v[k];
  return a;
}

#define BRISTLE_QUAD_FUNCTION1(name)      \
  template <class T>                      \
  inline Quad<T> name(Quad<T> a) {        \
    for (Lanes<T> & x : a.v) x = name(x); \
    return a;                             \
  }
BRISTLE_QUAD_FUNCTION1(root)
BRISTLE_QUAD_FUNCTION1(whole_part)
BRISTLE_QUAD_FUNCTION1(positive_part)
#undef BRISTLE_QUAD_FUNCTION1

#define BRISTLE_QUAD_FUNCTION2(name)                                             \
  template <class T>                                                             \
  inline Quad<T> name(Quad<T> a, Quad<T> b) {                                    \
    for (std::uint32_t k = 0; k < quad_size; ++k) a.v[k] = name(a.v[k], b.v[k]); \
    return a;                                                                    \
  }
BRISTLE_QUAD_FUNCTION2(divide)
BRISTLE_QUAD_FUNCTION2(least)
BRISTLE_QUAD_FUNCTION2(most)
#undef BRISTLE_QUAD_FUNCTION2

template <class T>
inline Quad<T> select_lanes(QuadMask<T> which, Quad<T> a, Quad<T> b) {
  for (std::uint32_t k = 0; k < quad_size; ++k) a.v[k] = select_lanes<T>(which.v[k], a.v[k], b.v[k]);
  return a;
}
template <class T>
inline bool any_lane(QuadMask<T> which) {
  Mask<T> any = which.v[0];
  for (std::uint32_t k = 1; k < quad_size; ++k) any = any | which.v[k];
  return xsimd::any(any);
}
template <class T>
inline Quad<T> exponent_of(Quad<T> a) {
  for (Lanes<T>& x : a.v) x = exponent_of<T>(x);
  return a;
}
template <class T>
inline Quad<T> mantissa_of(Quad<T> a) {
  for (Lanes<T>& x : a.v) x = mantissa_of<T>(x);
  return a;
}
template <class T>
inline Quad<T> power_of_two(Quad<T> a) {
  for (Lanes<T>& x : a.v) x = power_of_two<T>(x);
  return a;
}
template <class T>
inline Quad<T> look_up(const double* table, std::int32_t last, Quad<T> share) {
  for (Lanes<T>& x : share.v) x = look_up<T>(table, last, x);
  return share;
}

}  // namespace
}  // namespace bristle::detail
