// Constants of shared renewal for representatives: the path after which a slide is steady, and the share of
// newborn bristles that snap again soon. Steady sliding itself: steady_sliding.hpp.
#pragma once

#include "bristle/material.hpp"

namespace bristle::detail {

/// Constants of shared renewal; lengths in mean snap lengths.
struct RenewalLaw {
  double forget = 0.0;  ///< path after which a straight slide is steady, whatever came before

  static constexpr int again_knots = 16;
  static constexpr double again_reach = 0.25;
  /// again[k]: share of the bristles renewed evenly along a path k again_reach / again_knots that snap before
  /// its end.
  double again[again_knots + 1] = {};
};

/// Finds the constants of a material with Material::shared_renewal > 0 (core/patches/RUBBING.md). Takes
/// milliseconds.
RenewalLaw find_renewal_law(const Material& material);

}  // namespace bristle::detail
