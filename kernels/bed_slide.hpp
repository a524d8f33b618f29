// The path of a dragged tip (tractrix) for beds that ask only for the end of a step: computed without the
// motion's direction, without exp, and with one division.
#pragma once

#include "slide.hpp"

namespace bristle::detail {
namespace {

/// Result of a slide: the deflection z becomes keep z + push d, where d is the motion.
template <class V>
struct Dragged {
  V keep, push;
};

/// Slides a bristle of deflection z at its limit l along a straight motion d, and finds only the deflection
/// z' at the end. Given are t = x^2 = d^2 / l^2, q2 = 2 z d / l^2 and gap = 1 - z^2 / l^2, which is 0 but for
/// rounding: one Newton step brings z' to the limit. With T = tanh(x / 2) / x, z' = (z (1 - t T^2) + d T (2 +
/// q2 T)) / (1 + t T^2 + q2 T), which is as long as z for every T. T = above / below is a polynomial with an
/// error of 6e-7 up to t = 1; four doublings of the argument of tanh reach t = 256; beyond, tanh is 1.
template <class V>
inline Dragged<V> drag(V t, V q2, V gap) {
  const V one(1.0f), two(2.0f);
  const auto rate = [](V s) {
    return (V(0.49999973f) - V(0.041657898f) * s) + (s * s) * (V(4.1219678e-3f) - V(3.4689239e-4f) * s);
  };
  V above = rate(t), below = one;
  const auto is_long = t > one;
  if (any_lane(is_long)) {
    V s = t * V(1.0f / 256.0f);
    V n = rate(s);
    V m = one;
    for (int i = 0; i < 4; ++i) {
      const V n2 = n * n;
      n = n * m;
      m = m * m + s * n2;
      s = s * V(4.0f);
    }
    above = select_lanes(is_long, n, above);
    below = select_lanes(is_long, m, below);
    const auto is_far = t > V(256.0f);
    if (any_lane(is_far)) {
      above = select_lanes(is_far, one, above);
      below = select_lanes(is_far, root(t), below);
    }
    const V square = (above * above) * t;
    const V ahead = (q2 * above);
    const V below2 = below * below;
    const V longer = (below2 + square) + ahead * below;
    const V scale = divide(most(two + gap, V(0.0f)), longer + longer);
    return {(below2 - square) * scale, (above * ((below + below) + ahead)) * scale};
  }
  const V square = (above * above) * t;
  const V ahead = q2 * above;
  const V longer = (one + square) + ahead;
  const V scale = divide(most(two + gap, V(0.0f)), longer + longer);
  return {(one - square) * scale, (above * (two + ahead)) * scale};
}

}  // namespace
}  // namespace bristle::detail
