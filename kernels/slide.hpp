// The rule `slide`: a bristle that reaches its limit slides at it until the motion reverses. Works on one
// bristle or on a vector of bristles, each with its own direction and length (core/MODEL.md, section 30, with
// the symbols). Beds and joints take whole steps from this file, contacts in lanes (lane_slide.hpp) the parts
// of a step.
//
// A step moves the root of a bristle by `length` along the unit vector e. The tip sticks over the distance
// tau, until |z| is the limit l. From there the tip is dragged along a tractrix: the angle theta between z
// and e shrinks as tan(theta'/2) = tan(theta/2) exp(-s/l) over the distance s. A tip sticks while z unloads,
// so sliding always begins with theta <= 90 degrees; half-angles are at most 45 degrees, and nothing
// overflows.
#pragma once

#include <limits>

#include "elementary.hpp"

namespace bristle::detail {
namespace {

/// Evaluates a polynomial, lowest power first, as two of half the degree. The chain of dependent operations,
/// each waiting for the one before, is then half as long.
template <class T, class V, std::size_t n>
[[gnu::always_inline]] inline V polynomial_in_halves(const double (&coefficients)[n], V x) {
  constexpr int last = static_cast<int>(n) - 1;
  const V x2 = x * x;
  V even(static_cast<T>(coefficients[last - last % 2])),
      odd(static_cast<T>(coefficients[last - 1 + last % 2]));
  for (int i = last - last % 2 - 2; i >= 0; i -= 2) even = even * x2 + V(static_cast<T>(coefficients[i]));
  for (int i = last - 3 + last % 2; i >= 1; i -= 2) odd = odd * x2 + V(static_cast<T>(coefficients[i]));
  return even + x * odd;
}

/// The pair exp(-y) and 1 - exp(-y) for y >= 0, both to a few ulp. A y above 80 counts as 80.
template <class V>
struct Decay {
  V left, lost;
};
template <class T, class V>
[[gnu::always_inline]] inline Decay<V> decay(V y) {
  // Computes exp(-y) as 2^-x with x = k + f, k whole and |f| at most a half. Adding `magic` to x rounds it to
  // k.
  constexpr T magic = T(1.5) * (sizeof(T) == 4 ? T(8388608) : T(4503599627370496));
  const V x = least(y, V(T(80))) * V(T(1.4426950408889634));
  const V minus_k = (V(magic) - x) - V(magic);
  const V f = x + minus_k;
  // Coefficients of the polynomial for (1 - 2^-f) / f: in single precision a minimax fit, largest error
  // 1e-8; in double the Taylor series.
  constexpr double single[] = {0.6931471879266934,    -0.24022649794958215, 0.0555035743363792,
                               -0.009618237495071513, 0.001339073547708347, -0.0001540351232574011};
  constexpr double taylor[] = {0.6931471805599453,     -0.24022650695910072,    0.05550410866482158,
                               -0.009618129107628477,  0.0013333558146428443,   -0.0001540353039338161,
                               1.5252733804059841e-05, -1.3215486790144307e-06, 1.0178086009239699e-07,
                               -7.054911620801123e-09, 4.44553827187081e-10,    -2.5678435993488206e-11,
                               1.3691488853904128e-12};
  V series;
  if constexpr (sizeof(T) == 4)
    series = polynomial_in_halves<T>(single, f);
  else
    series = polynomial_in_halves<T>(taylor, f);
  const V scale = power_of_two<T>(minus_k);
  const V less = scale * (f * series);
  return {scale - less, (V(T(1)) - scale) + less};
}

/// Returns artanh(t) / t as a polynomial in t^2, for t <= 1/3.
template <class T, class V>
[[gnu::always_inline]] inline V log_series(V t2) {
  constexpr double single[] = {1.0000000039605197, 0.33333157341063313, 0.20012455137606738,
                               0.13980301428296538, 0.14089167218473486};
  constexpr double taylor[] = {1.0,      1.0 / 3,  1.0 / 5,  1.0 / 7,  1.0 / 9,  1.0 / 11,
                               1.0 / 13, 1.0 / 15, 1.0 / 17, 1.0 / 19, 1.0 / 21, 1.0 / 23,
                               1.0 / 25, 1.0 / 27, 1.0 / 29, 1.0 / 31, 1.0 / 33};
  if constexpr (sizeof(T) == 4)
    return polynomial_in_halves<T>(single, t2);
  else
    return polynomial_in_halves<T>(taylor, t2);
}

/// Returns ln(1 + part / whole) for 0 <= part <= whole, accurate even where the result is small: 2 artanh(t)
/// with t = part / (2 whole + part).
template <class T, class V>
[[gnu::always_inline]] inline V log_of_one_plus(V part, V whole) {
  const V t = divide(part, (whole + whole) + part);
  return (t + t) * log_series<T>(t * t);
}

/// Returns arctan(u) for |u| <= 1, accurate even where u is small. In double precision halves the angle twice
/// first.
template <class T, class V>
[[gnu::always_inline]] inline V arc_tangent(V u) {
  constexpr double single[] = {0.9999999846670059,  -0.33333071910176365,  0.1999258568843616,
                               -0.1420334635383251, 0.10639651206002876,   -0.07501320095496422,
                               0.04265356152088699, -0.016043546652153916, 0.002843188724029338};
  constexpr double taylor[] = {1.0,      -1.0 / 3,  1.0 / 5,  -1.0 / 7,  1.0 / 9,  -1.0 / 11,
                               1.0 / 13, -1.0 / 15, 1.0 / 17, -1.0 / 19, 1.0 / 21, -1.0 / 23};
  if constexpr (sizeof(T) == 4) return u * polynomial_in_halves<T>(single, u * u);
  for (int i = 0; i < 2; ++i) u = divide(u, V(T(1)) + root(V(T(1)) + u * u));
  return V(T(4)) * (u * polynomial_in_halves<T>(taylor, u * u));
}

/// Deflection z of a bristle before a step, and its parts along and across the motion. With one axis there is
/// no part across.
template <class V>
struct SlideStart {
  V x, y, along, aside;
};
template <class T, int axes, class V>
[[gnu::always_inline]] inline SlideStart<V> slide_start(V x, V y, V ex, V ey) {
  if constexpr (axes == 1) return {x, y, x * ex, V(T(0))};
  return {x, y, x * ex + y * ey, x * ey - y * ex};
}

/// Returns the distance along the motion after which a deflection grows beyond the length `limit`; 0 if it is
/// that long already and does not shrink. The equation has two roots; this form cannot give the wrong one.
template <class T, int axes, class V>
[[gnu::always_inline]] inline V path_to_slide(const SlideStart<V>& start, V limit) {
  const V none(T(0));
  if constexpr (axes == 1) return most(limit - start.along, none);
  return most(root(most(limit * limit - start.aside * start.aside, none)) - start.along, none);
}

/// Slide of a tip along its tractrix over the distance s, with theta the angle between deflection and motion.
/// p stands for l + l cos(theta) and a for l sin(theta), both times the same factor. Half the angle then has
/// the tangent a / p at the start and w / p at the end, with w = a exp(-s / l).
template <class V>
struct Tractrix {
  V a, p, w, p2, both;  ///< `both` is p^2 + w^2
  Decay<V> fade;        ///< exp(-s / l) and 1 - exp(-s / l)

  Tractrix(V the_a, V the_p, const Decay<V>& the_decay)
      : a(the_a), p(the_p), w(a * the_decay.left), p2(p * p), both(p2 + w * w), fade(the_decay) {}

  /// Return by how much the deflection grows along the motion and shrinks across it, if a and p are lengths.
  /// Neither result is a difference of nearly equal numbers, so both are accurate for short slides.
  template <class T>
  V gained_along() const {
    return divide(a * fade.lost, both) * (a * (V(T(1)) + fade.left)) * p;
  }
  V lost_aside() const { return divide(a * fade.lost, both) * (p2 - a * w); }

  /// Returns the logarithm in the integral of the deflection along the motion, l s - l^2 ln((1 + t^2) / (1 +
  /// t'^2)), with t and t' the tangents of the half-angle before and after. The quotient is 1 + a^2 (1 - E^2)
  /// / (p^2 + w^2), E = exp(-s / l).
  template <class T>
  V log_of_turn() const {
    return log_of_one_plus<T>((a * a) * (fade.lost * (V(T(1)) + fade.left)), both);
  }
  /// Returns theta - theta', the angle by which the deflection turns. Times l^2 it is the integral of the
  /// deflection across the motion. Half of it has the tangent (t - t') / (1 + t t').
  template <class T>
  V angle() const {
    const V half = arc_tangent<T>(divide((a * p) * fade.lost, p2 + a * w));
    return half + half;
  }
};

/// State of a bristle after a step. Integrals and dissipated energy are filled only if asked for.
template <class V>
struct Slid {
  V x, y;             ///< z', the deflection at the end of the step
  V path;             ///< path over which the tip sticks; it slides along the remaining path
  V integral_x = {};  ///< integral of the deflection z over the step (only with `mean`)
  V integral_y = {};
  V dissipated = {};  ///< dissipated energy over stiffness (only with `energy`)
};

/// Moves bristles whose tips stick over `path` <= length. Those whose path is shorter than the step then
/// slide at `limit`. `start_limit` is |z| at the start of sliding; where it exceeds the limit, the deflection
/// drops to the limit there.
template <class T, int axes, bool mean, bool energy, class V>
[[gnu::always_inline]] inline Slid<V> slide_after(const SlideStart<V>& start, V path, V start_limit, V limit,
                                                  V ex, V ey, V length) {
  const V none(T(0));
  const V half(T(0.5));
  const auto slides = path < length;
  Slid<V> end;
  end.path = path;
  end.x = limit * ex;
  end.y = limit * ey;
  const V s = length - path;
  // Integrals of the deflection, along the motion and across it, over the distance on which the tip slides.
  V along_integral = limit * s;
  V aside_integral = none;
  if constexpr (axes == 2) {
    // Treats an angle up to 4 eps s / l, at most 4 eps, as 0 (s: distance of the slide, l: limit). Neglected
    // angles then add up to 4 eps at most along a path l, whatever the length of the steps.
    constexpr T few = 4 * std::numeric_limits<T>::epsilon();
    const V a = start.aside;
    const V rounds = least(s, limit) * V(few);
    const auto turns = slides & (a * a > rounds * rounds);
    if (any_lane(turns)) {
      // Starts the tractrix where the deflection along the motion is l cos(theta). In this form no quotient
      // is needed until the end.
      const Tractrix<V> path_of_tip(a, most(start_limit + (start.along + path), V(T(1e-15))),
                                    decay<T>(divide(s, most(limit, V(T(1e-30))))));
      const V p = path_of_tip.p, p2 = path_of_tip.p2, w = path_of_tip.w;
      const V scale = divide(limit, path_of_tip.both);
      const V along = (p2 - w * w) * scale;
      const V aside = ((p + p) * w) * scale;
      end.x = select_lanes(turns, along * ex + aside * ey, end.x);
      end.y = select_lanes(turns, along * ey - aside * ex, end.y);
      if constexpr (mean || energy)
        along_integral =
            select_lanes(turns, limit * (s - limit * path_of_tip.template log_of_turn<T>()), along_integral);
      if constexpr (mean)
        aside_integral = select_lanes(turns, (limit * limit) * path_of_tip.template angle<T>(), none);
    }
  }
  end.x = select_lanes(slides, end.x, start.x + ex * length);
  end.y = select_lanes(slides, end.y, start.y + ey * length);
  if constexpr (energy)
    end.dissipated =
        select_lanes(slides, along_integral + half * ((start_limit - limit) * (start_limit + limit)), none);
  if constexpr (mean) {
    const V stuck = half * path * path + select_lanes(slides, along_integral, none);
    end.integral_x = start.x * path + stuck * ex;
    end.integral_y = none;
    if constexpr (axes == 2) {
      end.integral_x = end.integral_x + aside_integral * ey;
      end.integral_y = start.y * path + (stuck * ey - aside_integral * ex);
    }
  }
  return end;
}

/// Returns the share (0 to 1) of the motion d over which the tip sticks before it slides, which is the root
/// of |z + share d| = reach. `gap` is reach^2 - |z|^2, at least 0; b is z . d; d2 is |d|^2.
template <class V>
[[gnu::always_inline]] inline V share_that_sticks(V gap, V b, V d2) {
  const V none(0.0f);
  const V r = root(most(b * b + d2 * gap, none));
  const auto outward = b > none;
  const V share =
      divide(select_lanes(outward, gap, r - b), most(select_lanes(outward, r + b, d2), V(1e-30f)));
  return least(share, V(1.0f));
}

}  // namespace
}  // namespace bristle::detail
