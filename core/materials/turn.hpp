// Rotations in the plane as unit complex numbers. The C library is not used, because its bits differ from
// machine to machine.
#pragma once

#include "core/materials/elementary.hpp"

namespace bristle::detail {

inline constexpr double pi = 3.141592653589793;

/// Rotation in the plane, which turns the vector (1, 0) into (cosine, sine).
struct Turn {
  double cosine = 1.0, sine = 0.0;

  void apply(const double (&v)[2], double (&turned)[2]) const noexcept {
    turned[0] = cosine * v[0] - sine * v[1];
    turned[1] = sine * v[0] + cosine * v[1];
  }
};

inline Turn operator*(const Turn& a, const Turn& b) noexcept {
  return {a.cosine * b.cosine - a.sine * b.sine, a.sine * b.cosine + a.cosine * b.sine};
}

/// Restores the length 1 of a unit vector after rounding errors, to first order.
inline Turn normalized(const Turn& t) noexcept {
  const double correction = 1.5 - 0.5 * (t.cosine * t.cosine + t.sine * t.sine);
  return {t.cosine * correction, t.sine * correction};
}

/// Returns the rotation by an angle, rad. Halves the angle until the series of sine and cosine are exact to
/// rounding, so it must be of moderate size. The sine of a small angle keeps its relative accuracy.
inline Turn turn_by(double angle) noexcept {
  int doublings = 0;
  for (; magnitude(angle) > 0.25 && doublings < 64; ++doublings) angle *= 0.5;
  const double x = angle * angle;
  Turn t;
  t.cosine = 1.0 - x * 0.5 *
                       (1.0 - x * (1.0 / 12) *
                                  (1.0 - x * (1.0 / 30) * (1.0 - x * (1.0 / 56) * (1.0 - x * (1.0 / 90)))));
  t.sine = angle *
           (1.0 - x * (1.0 / 6) *
                      (1.0 - x * (1.0 / 20) *
                                 (1.0 - x * (1.0 / 42) * (1.0 - x * (1.0 / 72) * (1.0 - x * (1.0 / 110))))));
  for (; doublings > 0; --doublings) t = normalized(t * t);
  return t;
}

}  // namespace bristle::detail
