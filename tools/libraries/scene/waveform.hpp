// Computes sines in plain arithmetic for prescribed motions. The last bits of libm's sines differ between
// machines and would change the state hash of a scene.
#pragma once

#include <cmath>

namespace cli {

/// Returns sin(2 pi turns), within 2e-16 of the true value for |turns| < 2^40.
inline double sine_of_turns(double turns) noexcept {
  const double phase = turns - std::floor(turns);  // phase of the sine in turns, exact, in [0, 1)
  const double quarter = std::floor(4.0 * phase + 0.5);
  const double a = (phase - 0.25 * quarter) * 6.283185307179586477;  // angle of at most pi / 4 in magnitude
  const double a2 = a * a;
  // Evaluates the Taylor polynomials of sine and cosine. The first term that they omit is below 1e-17 for |a|
  // <= pi / 4.
  const double sine =
      a + a * a2 *
              (-1.0 / 6 +
               a2 * (1.0 / 120 +
                     a2 * (-1.0 / 5040 + a2 * (1.0 / 362880 + a2 * (-1.0 / 39916800 +
                                                                    a2 * (1.0 / 6227020800.0 +
                                                                          a2 * (-1.0 / 1307674368000.0)))))));
  const double cosine =
      1.0 +
      a2 * (-0.5 + a2 * (1.0 / 24 +
                         a2 * (-1.0 / 720 + a2 * (1.0 / 40320 + a2 * (-1.0 / 3628800 +
                                                                      a2 * (1.0 / 479001600.0 +
                                                                            a2 * (-1.0 / 87178291200.0)))))));
  switch (static_cast<int>(quarter)) {
    case 1:
      return cosine;
    case 2:
      return -sine;
    case 3:
      return -cosine;
    default:
      return sine;  // quarter is 0, or 4 just below a whole turn
  }
}

/// Returns cos(2 pi turns), within 2e-16 of the true value for |turns| < 2^40, as sine_of_turns() does.
inline double cosine_of_turns(double turns) noexcept { return sine_of_turns(turns + 0.25); }

}  // namespace cli
