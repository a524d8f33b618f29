// The law of the lengths at which bristles of an ageing contact snap in sliding at one speed: a bristle with
// the fresh length delta snaps at l = delta g(l / v) (core/MODEL.md, "Ageing").
#pragma once

#include "core/materials/steady_sliding.hpp"

namespace bristle::detail {

/// Returns a law for the aged lengths, in units of law.mean(). A uniform law and a table give a table; a
/// normal and a lognormal law give one of their family with the mean and cv of the aged lengths (error of the
/// peak up to 2e-3 and 3e-4), an exponential law one with their mean.
SnapLength aged_law(const SnapLength& law, const WayAgeing& ageing);

/// Returns the peak of first loading at this speed: the highest mean deflection beyond the residual, in units
/// of law.mean(), of bristles that have the age 0 at first. For set-up code.
double aged_peak(const SnapLength& law, SnapRule rule, double shared_renewal, const WayAgeing& ageing);

/// Returns the relative fall of the kinetic force with speed, -d ln(kinetic force) / d ln(speed); `residual`
/// in units of law.mean().
double kinetic_fall(const SnapLength& law, SnapRule rule, double shared_renewal, double residual,
                    const WayAgeing& ageing);

}  // namespace bristle::detail
