// Virgin curves and steady sliding in units of the mean snap length, deflections beyond the residual length.
#pragma once

#include "bristle/material.hpp"

namespace bristle::detail {

/// Mean deflection in slow steady sliding.
double kinetic_deflection(const SnapLength& law, SnapRule rule, double shared_renewal);
/// Supremum of the virgin curve.
double peak_deflection(const SnapLength& law, SnapRule rule, double shared_renewal);
/// Mean deflection after a path x > 0 from all deflections zero.
double virgin_curve(const SnapLength& law, SnapRule rule, double shared_renewal, double x);

}  // namespace bristle::detail
