// Bundles of eight vectors that are processed side by side, to hide latency. In a chain of dependent
// operations (log, polynomial, exp) each operation waits for the one before; eight chains side by side fill
// the waiting time. (Four vectors take a quarter longer.) In a build without vectors a bundle is a single
// number, because single numbers can branch on what a bristle does.
#pragma once

#include "lanes.hpp"

namespace bristle::detail {
namespace {

constexpr std::uint32_t bundle_size = width_of<float> == 1 ? 1 : 8;

template <class T>
struct BundleMask {
  Mask<T> v[bundle_size];
};

template <class T>
struct Bundle {
  Lanes<T> v[bundle_size];

  Bundle() = default;
  explicit Bundle(T x) {
    for (Lanes<T>& lanes : v) lanes = Lanes<T>(x);
  }
};

#define BRISTLE_BUNDLE_OPERATOR(result, op)                                      \
  template <class T>                                                             \
  inline result<T> operator op(Bundle<T> a, Bundle<T> b) {                       \
    result<T> out;                                                               \
    for (std::uint32_t k = 0; k < bundle_size; ++k) out.v[k] = a.v[k] op b.v[k]; \
    return out;                                                                  \
  }
BRISTLE_BUNDLE_OPERATOR(Bundle, +)
BRISTLE_BUNDLE_OPERATOR(Bundle, -)
BRISTLE_BUNDLE_OPERATOR(Bundle, *)
BRISTLE_BUNDLE_OPERATOR(BundleMask, >)
BRISTLE_BUNDLE_OPERATOR(BundleMask, >=)
#undef BRISTLE_BUNDLE_OPERATOR

template <class T>
inline BundleMask<T> operator&(BundleMask<T> a, BundleMask<T> b) {
  for (std::uint32_t k = 0; k < bundle_size; ++k) a.v[k] = a.v[k] & b.v[k];
  return a;
}

#define BRISTLE_BUNDLE_FUNCTION1(name)    \
  template <class T>                      \
  inline Bundle<T> name(Bundle<T> a) {    \
    for (Lanes<T> & x : a.v) x = name(x); \
    return a;                             \
  }
BRISTLE_BUNDLE_FUNCTION1(root)
BRISTLE_BUNDLE_FUNCTION1(whole_part)
BRISTLE_BUNDLE_FUNCTION1(positive_part)
#undef BRISTLE_BUNDLE_FUNCTION1

#define BRISTLE_BUNDLE_FUNCTION2(name)                                             \
  template <class T>                                                               \
  inline Bundle<T> name(Bundle<T> a, Bundle<T> b) {                                \
    for (std::uint32_t k = 0; k < bundle_size; ++k) a.v[k] = name(a.v[k], b.v[k]); \
    return a;                                                                      \
  }
BRISTLE_BUNDLE_FUNCTION2(divide)
BRISTLE_BUNDLE_FUNCTION2(least)
BRISTLE_BUNDLE_FUNCTION2(most)
#undef BRISTLE_BUNDLE_FUNCTION2

template <class T>
inline Bundle<T> select_lanes(BundleMask<T> which, Bundle<T> a, Bundle<T> b) {
  for (std::uint32_t k = 0; k < bundle_size; ++k) a.v[k] = select_lanes(which.v[k], a.v[k], b.v[k]);
  return a;
}
template <class T>
inline bool any_lane(BundleMask<T> which) {
  Mask<T> any = which.v[0];
  for (std::uint32_t k = 1; k < bundle_size; ++k) any = any | which.v[k];
  return any_lane(any);
}
template <class T>
inline Bundle<T> exponent_of(Bundle<T> a) {
  for (Lanes<T>& x : a.v) x = exponent_of<T>(x);
  return a;
}
template <class T>
inline Bundle<T> mantissa_of(Bundle<T> a) {
  for (Lanes<T>& x : a.v) x = mantissa_of<T>(x);
  return a;
}
template <class T>
inline Bundle<T> power_of_two(Bundle<T> a) {
  for (Lanes<T>& x : a.v) x = power_of_two<T>(x);
  return a;
}
template <class T>
inline Bundle<T> look_up(const double* table, std::int32_t last, Bundle<T> share) {
  for (Lanes<T>& x : share.v) x = look_up<T>(table, last, x);
  return share;
}

}  // namespace
}  // namespace bristle::detail
