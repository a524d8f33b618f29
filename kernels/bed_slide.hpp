// The path of a dragged tip (tractrix) for beds, in two forms that slide.hpp lacks. The cheap form serves
// beds that are asked only for the force at the end of a step: it needs one division, no exp, and not the
// motion's direction. The other form serves beds that are stiffer along one axis than along the other.
#pragma once

#include "slide.hpp"

namespace bristle::detail {
namespace {

/// Result of a slide as two factors: the deflection z becomes keep z + push d, where d is the motion.
template <class V>
struct Dragged {
  V keep, push;
};

/// Slides a bristle of deflection z, bent to its limit l, along a straight motion d, and finds only the
/// deflection z' at the end. The caller gives t = x^2 = d^2 / l^2, q2 = 2 z d / l^2 and gap = 1 - z^2 / l^2.
/// With T = tanh(x / 2) / x,
///
///   z' = (z (1 - t T^2) + d T (2 + q2 T)) / (1 + t T^2 + q2 T),
///
/// which is as long as z for every T, so an inexact T turns the deflection but does not lengthen it. T =
/// above / below is a quotient of polynomials with an error of 6e-7 up to t = 1. Four doublings of the
/// argument of tanh reach t = 256; beyond, tanh is 1. The gap is 0 but for rounding, which one Newton step
/// removes.
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

/// Motion along which a bristle of equal stiffness in all directions would slide to the same end as one that
/// is stiffer along one axis.
template <class V>
struct Course {
  V ex, ey;        ///< direction of the displacement, which the motion has too
  V shift;         ///< displacement over the limit, times the gain
  V path;          ///< length of the motion over the limit
  V cosine, sine;  ///< of the angle phi from the deflection before the slide to the displacement
  V tangent;       ///< of half that angle
};

/// Reduces the slide of a bristle that is stiffer along one axis to that of an isotropic bristle, whose path
/// is known. Its deflection u, at its limit, grows by `gain` times as much along y as along x; the remaining
/// motion (dx, dy) already has the gain in it. Returns the isotropic motion with the same end.
///
/// A tip slides against its force, so u turns towards the displacement (dx, dy / gain). With a the angle of
/// the displacement, phi the angle from u to the displacement, and s the displacement over the limit,
///
///   dphi/ds = -gain sin(phi) / D,   D = cos(a - phi)^2 + gain sin(a - phi)^2.
///
/// An isotropic motion of length x limit, along which dphi/dx = -sin(phi), has the same end if
///
///   D(0) x = gain s + (1 - gain) (cos(2a - phi) at the end less that at the start).
///
/// Newton's method solves this for x, with D at the end as the slope. It halves the interval that contains x
/// where Newton's method would leave it.
template <class V>
inline Course<V> askew_course(V ux, V uy, V dx, V dy, V limit, float gain) {
  constexpr int iterations = 8;
  const V none(0.0f), one(1.0f), half(0.5f), smallest(1e-30f), g(gain), lack(1.0f - gain);
  const V ry = dy * V(1.0f / gain);
  const V length = root(dx * dx + ry * ry);
  const V per = divide(one, most(length, smallest));
  const V ex = dx * per, ey = ry * per;
  const V per_size = divide(one, most(root(ux * ux + uy * uy), smallest));
  const V cosine = (ux * ex + uy * ey) * per_size, sine = (ux * ey - uy * ex) * per_size;
  // Tangent of half the angle phi, of which one form is inexact near 0 and the other near 180 degrees.
  const auto ahead = cosine >= none;
  const V sure = select_lanes(sine * sine > smallest, sine, V(1e-15f));
  const V tangent = divide(select_lanes(ahead, sine, one - cosine), select_lanes(ahead, one + cosine, sure));
  const V cos2 = ex * ex - ey * ey, sin2 = (ex + ex) * ey;
  const V at_end = ex * ex + g * (ey * ey);
  const V longest(1e6f);  // limits; after a longer path the tip lies along the motion
  const V over_limit = g * least(divide(length, most(limit, smallest)), longest);
  const V target = over_limit - lack * (cos2 * cosine + sin2 * sine);
  const auto slope_at = [&](V c, V s) {  // D
    return half * (one + g) + half * lack * (cos2 * (c * c - s * s) + sin2 * ((c + c) * s));
  };
  V low = over_limit * V(gain > 1.0f ? 1.0f / gain : 1.0f);
  V high = over_limit * V(gain > 1.0f ? 1.0f : 1.0f / gain);
  V x = most(least(divide(target + lack * cos2, at_end), high), low);
  for (int i = 0; i < iterations; ++i) {
    const V t = tangent * decay<float>(x).left;
    const V inverse = divide(one, one + t * t);
    const V c = (one - t * t) * inverse, s = (t + t) * inverse;
    const V excess = at_end * x - target - lack * (cos2 * c + sin2 * s);
    const auto too_long = excess > none;
    high = select_lanes(too_long, x, high);
    low = select_lanes(too_long, low, x);
    x = x - divide(excess, slope_at(c, s));
    x = select_lanes((x >= low) & (high >= x), x, half * (low + high));
  }
  // Takes the slope D at the start for a short path. Single precision would lose the differences, and D
  // hardly changes.
  x = select_lanes(V(1e-3f) > over_limit, divide(over_limit, slope_at(cosine, sine)), x);
  return {ex, ey, over_limit, x, cosine, sine, tangent};
}

/// Deflection of a bristle after its slide, and its mean over the displacement.
template <class V>
struct AskewSlide {
  V x, y, mean_x, mean_y;
};

/// Slides a bristle along its course, for which askew_course() gives the equations. The displacement s grows
/// with the isotropic path x as gain ds = D dx, so the mean deflection is the integral of u D over x divided
/// by gain s. The integral is elementary, because dphi/dx = -sin(phi).
template <class V>
inline AskewSlide<V> slide_askew(const Course<V>& course, V limit, float gain) {
  const V none(0.0f), one(1.0f), half(0.5f), right_angle(1.57079632679f);
  const V ex = course.ex, ey = course.ey, x = course.path;
  const V c0 = course.cosine, s0 = course.sine, t0 = course.tangent;
  const V t1 = t0 * decay<float>(x).left;
  const V grown = one + t1 * t1, inverse = divide(one, grown);
  const V c1 = (one - t1 * t1) * inverse, s1 = (t1 + t1) * inverse;
  const V end_x = c1 * ex + s1 * ey, end_y = c1 * ey - s1 * ex;
  // Integrals over x of cos(phi) and sin(phi). The latter is the angle by which the deflection turns.
  const V along = x - natural_log<float>(divide(one + t0 * t0, grown));
  const V turned = t0 - t1, straight = one + t0 * t1;
  const V size = select_lanes(turned >= none, turned, none - turned);
  const auto wide = size > straight;
  const V part =
      arc_tangent<float>(divide(select_lanes(wide, straight, size), select_lanes(wide, size, straight)));
  const V angle = select_lanes(wide, right_angle - part, part);
  const V aside = select_lanes(turned >= none, angle + angle, none - (angle + angle));
  // Adds the integrals of cos(phi) and sin(phi) times cos(2a - 2 phi), by which D differs from its mean.
  const V even(0.5f * (1.0f + gain)), uneven(0.5f * (1.0f - gain));
  const V cos2 = ex * ex - ey * ey, sin2 = (ex + ex) * ey;
  const V squares = s1 * s1 - s0 * s0, products = s0 * c0 - s1 * c1;
  const V with = even * along + uneven * (cos2 * (along + squares) + sin2 * (aside + products));
  const V across = even * aside + uneven * (cos2 * products - sin2 * squares);
  const V per = divide(one, most(course.shift, V(1e-30f)));
  // Takes the mean of both ends for a short path, because single precision would lose the differences.
  const auto is_short = V(1e-2f) > x;
  const V start_x = c0 * ex + s0 * ey, start_y = c0 * ey - s0 * ex;
  return {limit * end_x, limit * end_y,
          limit * select_lanes(is_short, half * (start_x + end_x), per * (with * ex + across * ey)),
          limit * select_lanes(is_short, half * (start_y + end_y), per * (with * ey - across * ex))};
}

}  // namespace
}  // namespace bristle::detail
