// What shared renewal means for steady sliding: its rate, its bend, and the path after which it is reached.
#pragma once

#include "bristle/material.hpp"

namespace bristle::detail {

/// In units of the mean snap length, counted from the residual.
struct RenewalLaw {
  double bend = 0.0;    ///< mean deflection in steady sliding
  double snaps = 0.0;   ///< of a bristle, per mean snap length of steady sliding
  double forget = 0.0;  ///< path after which a straight slide is steady, whatever was before

  static constexpr int again_knots = 16;
  static constexpr double again_reach = 0.25;
  /// Of bristles that begin anew somewhere within a short path, spread evenly: the share that snaps before
  /// its end. At paths of k again_reach / again_knots.
  double again[again_knots + 1] = {};
};

/// For a material with Material::shared_renewal > 0 (core/patches/RUBBING.md). Takes milliseconds.
RenewalLaw find_renewal_law(const Material& material);

}  // namespace bristle::detail
