// Slow steady sliding of infinitely many bristles of which every snap renews others (core/MODEL.md,
// "Rubbing"). Lengths in units of the mean snap length; deflections counted from the residual length.
#pragma once

#include "bristle/material.hpp"

namespace bristle::detail {

/// With SnapRule::keep the shorter bristles, in mean lengths, are left out of the closed forms: they are few
/// (Material::validate), and how often they snap depends on the number of bristles.
inline constexpr double shortest_that_counts = 1.0 / 1024;

struct SteadySliding {
  double snap_rate;   ///< nu: snaps per bristle in contact and mean length
  double growth;      ///< lambda = kappa nu: renewals per bristle and mean length
  double deflection;  ///< mean deflection beyond the residual length
};

/// `shared_renewal` > 0. Some ten microseconds; more for long tables.
SteadySliding find_steady_sliding(const SnapLength& law, SnapRule rule, double shared_renewal);
/// Snaps per bristle and mean length without shared renewal: 1, or E[1/delta] with keep.
double snap_rate_without_renewal(const SnapLength& law, SnapRule rule);

}  // namespace bristle::detail
