// Virgin curves and steady sliding in units of the mean snap length, deflections beyond the residual length.
#pragma once

#include "bristle/material.hpp"

namespace bristle::detail {

/// Returns the mean deflection in slow steady sliding.
double kinetic_deflection(const SnapLength& law, SnapRule rule, double shared_renewal);
/// Returns the supremum of the virgin curve: the highest mean deflection at first loading.
double peak_deflection(const SnapLength& law, SnapRule rule, double shared_renewal);
/// Returns the mean deflection after a path x > 0 from all deflections zero.
double virgin_curve(const SnapLength& law, SnapRule rule, double shared_renewal, double x);

/// Returns the mean deflection by SnapRule::slide after a path x > 0 from rest, of bristles that hold
/// `growth` times their length until they slide, and (1 - drop) of it while sliding.
double slide_curve(const SnapLength& law, double drop, double growth, double x);
/// Returns the supremum of slide_curve(), and its derivative by `growth`.
struct SlidePeak {
  double force, slope;
};
SlidePeak slide_peak(const SnapLength& law, double drop, double growth);

}  // namespace bristle::detail
