// The lengths at which bristles snap in a contact that ages. In sliding at a speed v, a bristle with the
// fresh snap length delta snaps at l = delta g(l / v), with g the growth factor of its age (core/MODEL.md,
// "Ageing").
#pragma once

#include "core/materials/steady_sliding.hpp"

namespace bristle::detail {

/// Returns a law for the lengths at which ageing bristles snap, in units of law.mean(), so that functions for
/// laws without ageing serve. For a uniform law or a table the result is a table; otherwise it is a law of
/// the family of `law`, with the mean and (normal, lognormal) the cv of the aged lengths. Error of the peak
/// at the strength 0.05: 2e-3 (normal, cv 0.25), 3e-4 (lognormal, cv 0.3; test_ageing_law).
SnapLength aged_law(const SnapLength& law, const PathAgeing& ageing);

/// Returns the peak of first loading at one speed, when all bristles have the age 0 at first: the highest
/// mean deflection beyond the residual, in units of law.mean(). Slow; for set-up.
double aged_peak(const SnapLength& law, SnapRule rule, double shared_renewal, const PathAgeing& ageing);

/// Returns how fast the kinetic force falls with speed: -d ln(kinetic force) / d ln(speed). `residual` is in
/// units of law.mean().
double kinetic_fall(const SnapLength& law, SnapRule rule, double shared_renewal, double residual,
                    const PathAgeing& ageing);

}  // namespace bristle::detail
