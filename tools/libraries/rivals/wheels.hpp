// Rival models of wheels that roll and creep sideways: Coulomb's, a slip formula, a LuGre tyre, and FASTSIM
// on one strip. The input of a step is how far the wheel has slipped sideways over the ground, and how far it
// has rolled.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace rivals {

/// Traction at a point of the contact: position over the half length; traction and its bound, both over the
/// largest traction.
using Traction = std::array<double, 3>;

/// Lateral force against the creep (N), and self-aligning moment (N m), which turns the wheel into its
/// motion.
struct WheelForce {
  double force = 0.0, moment = 0.0;
};

struct Wheel {
  double load = 0.0, limit = 0.0;  ///< normal load and highest friction, N
  double half = 0.0;               ///< half length of the contact, m
  double stiffness = 0.0;          ///< N per unit of creepage (sideways slip over rolled distance)
  double low_speed = 0.0;          ///< smallest speed by which the slip is divided to give the creepage, m/s
  int cells = 32;

  double full_slip() const { return 3.0 * limit / stiffness; }  ///< creepage at which the whole contact slips
  double creepage(double aside, double rolled, double dt) const {
    return aside / std::max(std::fabs(rolled), low_speed * dt);
  }
};

struct CoulombWheel : Wheel {
  WheelForce step(double aside, double, double dt) {
    return {limit * std::clamp(aside / (1e-3 * dt), -1.0, 1.0), 0.0};
  }
};

/// Slip formula of Bakker, Nyborg and Pacejka (SAE 870421), with their shape and curvature factors at 4 kN.
/// Stiffness and highest force are the wheel's own, and the moment is scaled by them.
struct SlipFormula : Wheel {
  static double formula(double x, double shape, double curvature) {
    return std::sin(shape * std::atan(x - curvature * (x - std::atan(x))));
  }
  WheelForce step(double aside, double rolled, double dt) {
    const double slip = creepage(aside, rolled, dt), highest = 27.0 / 256.0 * limit * half;
    return {limit * formula(stiffness * slip / (1.3 * limit), 1.3, -0.709),
            highest * formula(stiffness * slip * half / 3.0 / (2.4 * highest), 2.4, -2.588)};
  }
};

/// Lumped tyre model of Canudas de Wit and Tsiotras (CDC 1999), with Coulomb friction.
struct LuGreTyre : Wheel {
  double deflection = 0.0;  // deflection of the bristle, m
  WheelForce step(double aside, double rolled, double) {
    const double spring = 7.0 / 6.0 * stiffness / (2.0 * half);  // stiffness of the bristle, N/m
    const double rate = std::fabs(aside) * spring / limit + 7.0 / 6.0 * std::fabs(rolled) / (2.0 * half);
    if (rate > 0.0) deflection = deflection * std::exp(-rate) - aside / rate * std::expm1(-rate);
    return {spring * deflection, 0.0};
  }
};

/// Kalker's FASTSIM on one strip in steady rolling, computed cell by cell from the leading edge.
struct Fastsim : Wheel {
  std::vector<Traction> tractions = {};
  WheelForce step(double aside, double rolled, double dt) {
    const double slip = creepage(aside, rolled, dt), width = 2.0 * half / cells;
    const double stiff = stiffness / (2.0 * half * half);  // force per length and deflection, N/m^2
    WheelForce sum;
    double traction = 0.0;
    tractions.clear();
    for (int i = 0; i < cells; ++i) {
      const double x = half - (i + 0.5) * width, bound = 0.75 * limit / half * (1.0 - x * x / (half * half));
      traction = std::clamp(traction + stiff * slip * width, -bound, bound);
      sum.force += traction * width;
      sum.moment -= traction * width * x;
      tractions.push_back({x / half, traction * half / (0.75 * limit), bound * half / (0.75 * limit)});
    }
    return sum;
  }
};

}  // namespace rivals
