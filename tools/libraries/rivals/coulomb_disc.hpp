// Coulomb friction of a disc under uniform pressure that slides and spins, in closed form.
//
// Force F and torque T of a disc of radius R under the load N with coefficient mu, whose centre moves at v
// and which turns at omega; eps = v / (omega R), E and K are complete elliptic integrals of the modulus
// given:
//   eps <= 1: F = mu N 4 [(eps^2 + 1) E(eps) + (eps^2 - 1) K(eps)] / (3 pi eps)
//             T = mu N R 4 [(4 - 2 eps^2) E(eps) + (eps^2 - 1) K(eps)] / (9 pi)
//   eps > 1:  F = mu N 4 [(eps^2 + 1) E(1/eps) - (eps^2 - 1) K(1/eps)] / (3 pi)
//             T = mu N R 4 eps [(4 - 2 eps^2) E(1/eps) + (2 eps^2 - 5 + 3 / eps^2) K(1/eps)] / (9 pi)
// Source: Farkas, Bartels, Unger, Wolf, Frictional coupling between sliding and spinning motion, PRL 90,
// 248302, 2003. Above one by the reciprocal modulus transformation; checked by quadrature in the tests.
#pragma once

namespace rivals {

/// Friction over mu N and torque over mu N R of a uniform disc, both > 0, at a ratio eps >= 0; infinite eps
/// means no spin.
struct DiscFriction {
  double force = 0.0, torque = 0.0;
};
DiscFriction coulomb_disc(double eps) noexcept;

}  // namespace rivals
