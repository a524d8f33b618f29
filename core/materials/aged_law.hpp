// The law of the lengths at which bristles of an ageing contact snap in sliding at one speed: a bristle with
// the fresh length delta snaps at l = delta g(l / v) (core/MODEL.md, "Ageing").
#pragma once

#include "core/materials/steady_sliding.hpp"

namespace bristle::detail {

/// Returns a law for the aged lengths, in units of law.mean(): for a uniform law or a table it is a table.
/// Otherwise it is a law of the family of `law`, with the mean and (normal, lognormal) the cv of the aged
/// lengths. Error of the peak at the strength 0.05: 2e-3 (normal, cv 0.25), 3e-4 (lognormal, cv 0.3;
/// test_ageing_law).
SnapLength aged_law(const SnapLength& law, const WayAgeing& ageing);

/// Returns the peak of first loading at this speed: the highest mean deflection beyond the residual, in units
/// of law.mean(), of bristles that have the age 0 at first. For set-up code.
double aged_peak(const SnapLength& law, SnapRule rule, double shared_renewal, const WayAgeing& ageing);

/// Returns the relative fall of the kinetic force with speed, -d ln(kinetic force) / d ln(speed); `residual`
/// in units of law.mean().
double kinetic_fall(const SnapLength& law, SnapRule rule, double shared_renewal, double residual,
                    const WayAgeing& ageing);

}  // namespace bristle::detail
