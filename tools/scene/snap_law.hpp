// Laws of the snap length by family, mean and spread, as fitting and experiments vary them, and their limits.
#pragma once

#include <bristle/material.hpp>

namespace cli {

/// Standard deviation over mean that the library takes: with redraw, and with keep (core/MODEL.md, "Jumps").
constexpr double widest_redraw_cv = 1.25, widest_cv = 3.0;

/// A law of the family with this mean and spread (standard deviation over mean). lognormal, normal (cut at 0,
/// the spread that of the uncut law), uniform, exponential and single (no spread to choose). Throws
/// bristle::Error where the family has no such spread.
bristle::SnapLength make_snap_length(bristle::SnapLaw family, double mean_m, double spread);

/// Largest spread that make_snap_length and the rule allow.
double largest_spread(bristle::SnapLaw family, bristle::SnapRule rule);

/// Mean deflection in steady sliding over the mean snap length.
double kinetic_bend(bristle::SnapRule rule, double cv);

}  // namespace cli
