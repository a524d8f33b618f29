// Numerical solvers for set-up code: a root in an interval, a root by Newton's method where the slope is
// known, and a maximum.
#pragma once

#include "core/materials/elementary.hpp"

namespace bristle::detail {

/// Tolerances of find_zero().
struct ZeroTolerance {
  double width;        ///< width of an interval that is narrow enough
  double value = 0.0;  ///< value that counts as 0, where the values at both ends of the interval are larger
};

/// Finds where f changes its sign between `low` and `high`, where its values are `at_low` and `at_high`.
/// Takes the zero of the line through both ends (false position), and halves the value at an end that stays
/// (Illinois method). Bisects where that does not halve the interval, and while an end counts as 0; of a
/// function that is 0 from some point on, that point is found. Returns the end of the last interval at which
/// f has the sign of `at_high`.
template <class Function>
double find_zero(const Function& f, double low, double high, double at_low, double at_high,
                 ZeroTolerance tolerance) {
  constexpr int most_steps = 200;
  const bool rises = at_high > at_low;
  int side = 0;
  bool bisects = false;
  for (int i = 0; i < most_steps && high - low > tolerance.width; ++i) {
    const double width = high - low;
    const bool flat = magnitude(at_low) <= tolerance.value || magnitude(at_high) <= tolerance.value;
    double x = low + width * (at_low / (at_low - at_high));
    if (bisects || flat || !(x > low && x < high)) x = 0.5 * (low + high);
    const double value = f(x);
    if (!flat && magnitude(value) <= tolerance.value) return x;
    const bool is_low = rises ? value < 0.0 : value > 0.0;
    (is_low ? low : high) = x;
    (is_low ? at_low : at_high) = value;
    if (side == (is_low ? -1 : 1)) (is_low ? at_high : at_low) *= 0.5;
    side = is_low ? -1 : 1;
    bisects = !bisects && high - low > 0.5 * width;
  }
  return high;
}

/// Follows Newton's method from x to the root of a convex or concave function, from the side on which no
/// iterate passes the root. `step_from(x)`: Newton's step at x.
template <class Step>
double newton(double x, const Step& step_from) {
  constexpr int most_steps = 100;
  double first = 0.0;
  for (int i = 0; i < most_steps; ++i) {
    const double step = step_from(x);
    if (first == 0.0) first = step;
    if (!(step * first > 0.0)) break;  // a step in the other direction comes from rounding alone
    x += step;
    if (!(magnitude(step) > 1e-15 * magnitude(x))) break;
  }
  return x;
}

/// Argument and value of a maximum.
struct Maximum {
  double at, value;
};

/// Finds the maximum of a function with one hump between `low` and `high`, by golden section. The error of
/// its position is (high - low) 1.618^-iterations.
template <class Function>
Maximum find_maximum(const Function& f, double low, double high, int iterations) {
  constexpr double golden = 0.6180339887498949;
  double x1 = high - golden * (high - low), x2 = low + golden * (high - low);
  double f1 = f(x1), f2 = f(x2);
  for (int i = 0; i < iterations; ++i) {
    if (f1 < f2) {
      low = x1;
      x1 = x2;
      f1 = f2;
      f2 = f(x2 = low + golden * (high - low));
    } else {
      high = x2;
      x2 = x1;
      f2 = f1;
      f1 = f(x1 = high - golden * (high - low));
    }
  }
  return f1 < f2 ? Maximum{x2, f2} : Maximum{x1, f1};
}

}  // namespace bristle::detail
