// Steady sliding of infinitely many bristles with ageing and shared renewal (core/MODEL.md, "Rubbing",
// "Ageing"). Lengths are in units of the mean snap length; deflections are counted from the residual length.
#pragma once

#include "bristle/material.hpp"
#include "bristle/span.hpp"

namespace bristle::detail {

/// Snap length, in mean lengths, below which bristles are left out of the closed forms of SnapRule::keep.
/// Such bristles are few (Material::validate), and how often they snap depends on the number of bristles.
inline constexpr double shortest_that_counts = 1.0 / 1024;

/// Growth of snap lengths at a constant speed, as a function of the path r of a bristle since its last snap
/// (in mean snap lengths): g = 1 + strength ln(1 + r / path) or 1 + strength (1 - exp(-r / path)).
struct PathAgeing {
  AgeingForm form = AgeingForm::logarithmic;
  double strength = 0.0;  ///< beta or gain of ageing; 0 = none
  double path = 1.0;      ///< speed times ageing time, in mean snap lengths, > 0

  /// Returns the factor g by which a snap length has grown after the path `run` since the last snap, in mean
  /// snap lengths; slope() is its derivative.
  double factor(double run) const noexcept;
  double slope(double run) const noexcept;
};

/// Returns the ageing of a material along the path of sliding at one speed. Speeds below slowest_sliding
/// count as slowest_sliding.
PathAgeing ageing_at(const Material& material, double speed_m_per_s);

/// Returns the deflection beyond the residual at which a bristle of this fresh length snaps: the solution l
/// of l = length g(l).
double aged_length(double length, const PathAgeing& ageing) noexcept;

/// Mean and coefficient of variation of the lengths at which ageing bristles snap, in units of the mean fresh
/// snap length.
struct AgedMoments {
  double mean, cv;
};
AgedMoments find_aged_moments(const SnapLength& law, const PathAgeing& ageing);

/// Node of a sum over a law: a fresh snap length, its share of the bristles, and the length at which it snaps
/// when aged.
struct AgedNode {
  double length, share, aged = 0.0;
};

struct SteadySliding {
  double snap_rate;   ///< nu: snaps per bristle in contact, per mean snap length of path
  double growth;      ///< lambda = kappa nu: renewals per bristle, per mean snap length of path
  double deflection;  ///< mean deflection beyond the residual length, in mean snap lengths
  double fresh;       ///< mean fresh snap length of the bristles in contact, in mean snap lengths
};

/// Computes mean deflection and rates of steady sliding for `shared_renewal` >= 0. Takes longer with ageing,
/// and for a table of many lengths.
SteadySliding find_steady_sliding(const SnapLength& law, SnapRule rule, double shared_renewal,
                                  const PathAgeing& ageing = {});
/// Computes steady sliding for a law given by nodes and by `mean`, the mean length at which its bristles
/// snap; all in one unit of length. Does not allocate, so a step may call it.
SteadySliding find_steady_sliding(Span<const AgedNode> nodes, double mean, SnapRule rule,
                                  double shared_renewal) noexcept;
/// Returns the snaps of a bristle on a path of one mean snap length, without shared renewal: 1, or E[1/delta]
/// (delta in mean lengths) with SnapRule::keep.
double snap_rate_without_renewal(const SnapLength& law, SnapRule rule);

}  // namespace bristle::detail
