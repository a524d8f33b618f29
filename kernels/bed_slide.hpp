// The path of a dragged tip (tractrix) for beds, in two forms. One is for beds that ask only for the end of a
// step: it needs neither the motion's direction nor exp, and one division. The other is for beds that are
// stiffer along one axis than along the other.
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
/// z' at the end. Given are t = x^2 = d^2 / l^2, q2 = 2 z d / l^2 and gap = 1 - z^2 / l^2. Only rounding
/// makes the gap differ from 0; one Newton step brings z' to the limit. With T = tanh(x / 2) / x, z' = (z (1
/// - t T^2) + d T (2 + q2 T)) / (1 + t T^2 + q2 T), which is as long as z for every T. T = above / below is a
/// polynomial with an error of 6e-7 up to t = 1. Four doublings of the argument of tanh reach t = 256;
/// beyond, tanh is 1.
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

/// Motion (x, y) on which an isotropic bristle slides to the end of another one's slide.
template <class V>
struct Course {
  V x, y;
};

/// Returns the isotropic motion for a bristle of deflection u at its limit whose deflection grows by `gain`
/// times as much along y as along x. The remaining motion (dx, dy) has the gain in it. A tip slides against
/// its force, so u turns to the displacement (dx, dy / gain), in place of (dx, dy). With a the displacement's
/// angle, phi that from u to the displacement, and s the displacement over the limit
///
///   dphi/ds = -gain sin(phi) / D,   D = cos(a - phi)^2 + gain sin(a - phi)^2
///
/// The isotropic motion of length x limit with dphi/dx = -sin(phi) has the same end if
///
///   D(0) x = gain s + (1 - gain) (cos(2a - phi) at the end less that at the start),
///
/// which Newton's method solves: D at the end is the slope.
template <class V>
inline Course<V> askew_course(V ux, V uy, V dx, V dy, V limit, float gain) {
  constexpr int iterations = 4;
  const V none(0.0f), one(1.0f), smallest(1e-30f), g(gain), lack(1.0f - gain);
  const V ry = dy * V(1.0f / gain);
  const V length = root(dx * dx + ry * ry);
  const V per = divide(one, most(length, smallest));
  const V ex = dx * per, ey = ry * per;
  const V size = most(root(ux * ux + uy * uy), smallest);
  const V per_size = divide(one, size);
  const V cosine = (ux * ex + uy * ey) * per_size, sine = (ux * ey - uy * ex) * per_size;
  const V tangent = divide(sine, most(one + cosine, V(1e-6f)));  // tangent of half the angle phi
  const V cos2 = ex * ex - ey * ey, sin2 = (ex + ex) * ey;
  const V at_end = ex * ex + g * (ey * ey);
  const V longest(1e6f);  // limits; after a longer path the tip lies along the motion
  const V over_limit = g * least(divide(length, most(limit, smallest)), longest);
  const V way = over_limit - lack * (cos2 * cosine + sin2 * sine);
  const auto slope_at = [&](V c, V s) {  // D
    const V half(0.5f);
    return half * (one + g) + half * lack * (cos2 * (c * c - s * s) + sin2 * ((c + c) * s));
  };
  V x = most(divide(way + lack * cos2, at_end), none);
  for (int i = 0; i < iterations; ++i) {
    const V t = tangent * decay<float>(x).left;
    const V inverse = divide(one, one + t * t);
    const V c = (one - t * t) * inverse, s = (t + t) * inverse;
    x = most(x - divide(at_end * x - way - lack * (cos2 * c + sin2 * s), slope_at(c, s)), none);
  }
  // Uses the slope at the start on a short path, where single precision would lose the differences and D
  // hardly changes.
  x = select_lanes(V(1e-3f) > over_limit, divide(over_limit, slope_at(cosine, sine)), x);
  const V to = x * limit;
  return {ex * to, ey * to};
}

}  // namespace
}  // namespace bristle::detail
