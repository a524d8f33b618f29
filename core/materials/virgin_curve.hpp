// Virgin curves (force of first loading) and steady sliding, in units of the mean snap length. Deflections
// are counted beyond the residual length.
#pragma once

#include "bristle/material.hpp"

namespace bristle::detail {

/// Returns the mean deflection in slow steady sliding, from which kinetic friction follows.
double kinetic_deflection(const SnapLength& law, SnapRule rule, double shared_renewal);
/// Returns the highest value of the virgin curve, from which the peak of friction follows: the largest mean
/// deflection in first loading.
double peak_deflection(const SnapLength& law, SnapRule rule, double shared_renewal);
/// Returns the mean deflection after a path x > 0 of first loading, from straight bristles.
double virgin_curve(const SnapLength& law, SnapRule rule, double shared_renewal, double x);

/// Returns the mean deflection with SnapRule::slide after a path x > 0 from rest. The bristles stick up to
/// `growth` times their length and then slide at (1 - drop) of their length.
double slide_curve(const SnapLength& law, double drop, double growth, double x);
/// Highest value of slide_curve(), from which the peak of friction follows, and its derivative by `growth`.
struct SlidePeak {
  double force, slope;
};
SlidePeak slide_peak(const SnapLength& law, double drop, double growth);

}  // namespace bristle::detail
