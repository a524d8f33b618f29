// Constants of shared renewal: the path along which straight bristles reach steady sliding, and the share of
// renewed bristles that snap again soon after. Steady sliding itself is in steady_sliding.hpp.
#pragma once

#include "bristle/material.hpp"

namespace bristle::detail {

/// Constants of a material with shared renewal, by which steps recognise steady sliding; lengths in mean snap
/// lengths.
struct RenewalLaw {
  double forget = 0.0;  ///< path along which straight bristles come within 1e-3 of steady sliding

  static constexpr int again_knots = 16;
  static constexpr double again_reach = 0.25;
  /// again[k]: of the bristles renewed at even distances along a path of k again_reach / again_knots, the
  /// share that snaps before the end of the path.
  double again[again_knots + 1] = {};
};

/// Calculates the constants of a material with Material::shared_renewal > 0 (core/patches/RUBBING.md). Takes
/// milliseconds.
RenewalLaw find_renewal_law(const Material& material);

}  // namespace bristle::detail
