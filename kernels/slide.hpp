// The rule `slide`: a bristle that reaches its limit slides at it until the motion turns back. For a vector
// of bristles or for one, with a direction and a length for each (core/MODEL.md, section 30, with the
// symbols).
//
// A step moves the root of a bristle by `length` along the unit vector e. The tip sticks over the distance
// tau, until |z| is the limit. From there it follows the tractrix: the angle theta between z and e shrinks as
// tan(theta'/2) = tan(theta/2) exp(-s/l) over the distance s. Sliding begins with theta <= 90 degrees,
// whatever came before, because the tip sticks while z unloads. So no half-angle exceeds 45 degrees, and
// nothing overflows.
#pragma once

#include "elementary.hpp"

namespace bristle::detail {
namespace {

/// exp(-y) and 1 - exp(-y) for y >= 0, both to a few ulp; y above 80 reads as 80.
template <class V>
struct Decay {
  V left, lost;
};
template <class T, class V>
inline Decay<V> decay(V y) {
  constexpr int terms = sizeof(T) == 4 ? 7 : 13;
  const V x = least(y, V(T(80)));
  const V k = whole_part(x * V(T(1.4426950408889634)) + V(T(0.5)));
  // ln 2 in two parts: k times the first is exact.
  const V r = (k * V(T(0.693145751953125)) - x) + k * V(T(1.4286068203094173e-06));
  // (exp(r) - 1) / r
  constexpr double inverse_factorial[] = {
      1.0,         1.0 / 2,      1.0 / 6,       1.0 / 24,       1.0 / 120,       1.0 / 720,       1.0 / 5040,
      1.0 / 40320, 1.0 / 362880, 1.0 / 3628800, 1.0 / 39916800, 1.0 / 479001600, 1.0 / 6227020800};
  V series(static_cast<T>(inverse_factorial[terms - 1]));
  for (int i = terms - 2; i >= 0; --i) series = series * r + V(static_cast<T>(inverse_factorial[i]));
  const V scale = power_of_two<T>(V(T(0)) - k);
  const V more = scale * (r * series);
  return {scale + more, (V(T(1)) - scale) - more};
}

/// ln(1 + x) for 0 <= x <= 1, also relative to a small x: 2 artanh(x / (2 + x)).
template <class T, class V>
inline V log_of_one_plus(V x) {
  constexpr int terms = sizeof(T) == 4 ? 7 : 16;
  const V t = divide(x, V(T(2)) + x);
  const V t2 = t * t;
  V series(static_cast<T>(1.0 / (2 * terms + 1)));
  for (int k = terms - 1; k >= 0; --k) series = series * t2 + V(static_cast<T>(1.0 / (2 * k + 1)));
  return (t + t) * series;
}

/// arctan(u) for |u| <= 1, also relative to a small u: angles halved once or twice, then the series.
template <class T, class V>
inline V arc_tangent(V u) {
  constexpr int halvings = sizeof(T) == 4 ? 1 : 2;
  constexpr int terms = sizeof(T) == 4 ? 8 : 11;
  for (int i = 0; i < halvings; ++i) u = divide(u, V(T(1)) + root(V(T(1)) + u * u));
  const V minus = V(T(0)) - u * u;
  V series(static_cast<T>(1.0 / (2 * terms + 1)));
  for (int k = terms - 1; k >= 0; --k) series = series * minus + V(static_cast<T>(1.0 / (2 * k + 1)));
  return V(T(1 << halvings)) * (u * series);
}

/// A bristle before a step: z in parts along and across the motion. One axis has no second part.
template <class V>
struct SlideStart {
  V x, y, along, aside;
};
template <class T, int axes, class V>
inline SlideStart<V> slide_start(V x, V y, V ex, V ey) {
  if constexpr (axes == 1) return {x, y, x * ex, V(T(0))};
  return {x, y, x * ex + y * ey, x * ey - y * ex};
}

/// Distance to the circle of radius `limit`, forward along e; 0 on it or outside. This form cannot go wrong
/// in sign or root.
template <class T, int axes, class V>
inline V way_to_slide(const SlideStart<V>& start, V limit) {
  const V none(T(0));
  if constexpr (axes == 1) return most(limit - start.along, none);
  return most(root(most(limit * limit - start.aside * start.aside, none)) - start.along, none);
}

/// A bristle after a step. The last four are filled where they are asked for.
template <class V>
struct Slid {
  V x, y;             ///< z'
  V path;             ///< the distance over which the tip stuck; it slid over the rest of the step
  V integral_x = {};  ///< of z over the step (`mean`)
  V integral_y = {};
  V dissipated = {};  ///< energy over stiffness (`energy`)
};

/// Advances bristles that stick over `path` <= length, and then slide at `limit`, if anything is left of the
/// length. `holds` is |z| where sliding begins; a bristle that holds more than its limit drops to it there.
template <class T, int axes, bool mean, bool energy, class V>
inline Slid<V> slide_after(const SlideStart<V>& start, V path, V holds, V limit, V ex, V ey, V length) {
  const V none(T(0));
  const V half(T(0.5));
  const V smallest(T(1e-30));
  const auto slides = path < length;
  Slid<V> end;
  end.path = path;
  const V s = length - path;
  V along_integral = none;  // of z along the motion, and across it, while the tip slides
  V aside_integral = none;
  if constexpr (axes == 1) {
    end.x = select_lanes(slides, limit * ex, start.x + ex * length);
    end.y = none;
    along_integral = limit * s;
  } else {
    // With p = l + l cos(theta) and a = l sin(theta), t = a / p: no quotient until the end. The tip begins to
    // slide where z along the motion is l cos(theta).
    const V bound = most(holds, none);
    const V a = least(most(start.aside, none - bound), bound);
    const V p = bound + most(start.along + path, none);
    const Decay<V> turn = decay<T>(divide(s, most(limit, smallest)));
    const V w = a * turn.left;
    const V p2 = p * p;
    const V inverse = divide(V(T(1)), (p2 + w * w) + smallest);
    const V along = limit * ((p2 - w * w) * inverse);
    const V aside = limit * ((p + p) * w * inverse);
    end.x = select_lanes(slides, along * ex + aside * ey, start.x + ex * length);
    end.y = select_lanes(slides, along * ey - aside * ex, start.y + ey * length);
    if constexpr (mean || energy) {
      // l s - l^2 ln((1 + t^2) / (1 + t'^2)), where the quotient is 1 + a^2 (1 - E^2) / (p^2 + w^2)
      const V grown = a * a * (turn.lost * (V(T(1)) + turn.left)) * inverse;
      along_integral = limit * (s - limit * log_of_one_plus<T>(least(grown, V(T(1)))));
    }
    if constexpr (mean) {
      // l^2 (theta - theta'), where half of it has the tangent (t - t') / (1 + t t')
      const V tangent = divide(a * p * turn.lost, (p2 + a * w) + smallest);
      aside_integral = limit * limit * (V(T(2)) * arc_tangent<T>(tangent));
    }
  }
  if constexpr (energy)
    end.dissipated = select_lanes(slides, along_integral + half * ((holds - limit) * (holds + limit)), none);
  if constexpr (mean) {
    const V stuck = half * path * path + select_lanes(slides, along_integral, none);
    end.integral_x = start.x * path + stuck * ex;
    end.integral_y = none;
    if constexpr (axes == 2) {
      const V across = select_lanes(slides, aside_integral, none);
      end.integral_x = end.integral_x + across * ey;
      end.integral_y = start.y * path + (stuck * ey - across * ex);
    }
  }
  return end;
}

/// The rule without drop and ageing: slides at the limit that it holds. The deflection is within it.
template <class T, int axes, bool mean, bool energy, class V>
inline Slid<V> slide(V x, V y, V limit, V ex, V ey, V length) {
  const SlideStart<V> start = slide_start<T, axes>(x, y, ex, ey);
  const V path = least(way_to_slide<T, axes>(start, limit), length);
  return slide_after<T, axes, mean, energy>(start, path, limit, limit, ex, ey, length);
}

/// The tractrix without direction, root or exp, where nothing but the end is asked for: a bristle slides at
/// its limit along a straight motion. u = z / l and d are in limits; u stays a unit vector:
/// u' = (u + d (S + q C)) / (1 + x^2 C + q S) with x = |d|, S = sinh(x) / x, C = (cosh(x) - 1) / x^2, q = u
/// d. Single precision; beyond x = 16 the bristle has turned into the motion to its last digit.
template <class V>
inline void turn_into(V& ux, V& uy, V dx, V dy) {
  const V one(1.0f);
  V t = dx * dx + dy * dy;
  const auto is_long = t > V(0.0625f);
  V sine = one + t * V(1.0f / 6.0f) * (one + t * V(0.05f));
  V cosine = V(0.5f) + t * (V(1.0f / 24.0f) + t * V(1.0f / 720.0f));
  if (any_lane(is_long)) {
    const auto too_long = t > V(256.0f);
    if (any_lane(too_long)) {
      const V shorter = select_lanes(too_long, divide(V(16.0f), root(t)), one);
      dx = dx * shorter;
      dy = dy * shorter;
      t = least(t, V(256.0f));
    }
    // x / 16, doubled four times.
    V part = t * V(1.0f / 256.0f);
    V s = one + part * V(1.0f / 6.0f) *
                    (one + part * V(0.05f) * (one + part * V(1.0f / 42.0f) * (one + part * V(1.0f / 72.0f))));
    V c = V(0.5f) + part * V(1.0f / 24.0f) *
                        (one + part * V(1.0f / 30.0f) *
                                   (one + part * V(1.0f / 56.0f) * (one + part * V(1.0f / 90.0f))));
    for (int i = 0; i < 4; ++i) {
      const V cosh = one + part * c;
      c = V(0.5f) * s * s;
      s = s * cosh;
      part = part * V(4.0f);
    }
    sine = select_lanes(is_long, s, sine);
    cosine = select_lanes(is_long, c, cosine);
  }
  const V q = ux * dx + uy * dy;
  const V over = divide(one, (one + t * cosine) + q * sine);
  const V push = sine + q * cosine;
  ux = (ux + dx * push) * over;
  uy = (uy + dy * push) * over;
}

/// Share of the motion d over which the tip sticks, 0 to 1, of a bristle that slides within the step: the
/// root of |z + share d| = reach. `gap` = reach^2 - |z|^2, at least 0, and b = z d.
template <class V>
inline V share_that_sticks(V gap, V b, V d2) {
  const V none(0.0f);
  const V r = root(most(b * b + d2 * gap, none));
  const auto outward = b > none;
  const V share =
      divide(select_lanes(outward, gap, r - b), most(select_lanes(outward, r + b, d2), V(1e-30f)));
  return least(share, V(1.0f));
}

}  // namespace
}  // namespace bristle::detail
