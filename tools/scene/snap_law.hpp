// Makes laws of the snap length from family, mean and spread, as fitting and experiments vary them, and gives
// their limits.
#pragma once

#include <bristle/material.hpp>

namespace cli {

/// Largest standard deviation over mean that the library accepts: with redraw, and with keep (core/MODEL.md,
/// "Jumps").
constexpr double widest_redraw_cv = 1.25, widest_cv = 3.0;

/// Makes a law with this mean and spread (standard deviation over mean): lognormal, normal (cut at 0; the
/// spread is the uncut law's), uniform, exponential or single (whose spread is fixed). Throws bristle::Error
/// if the family has no such spread.
bristle::SnapLength make_snap_length(bristle::SnapLaw family, double mean_m, double spread);

/// Returns the largest spread that make_snap_length and the rule allow.
double largest_spread(bristle::SnapLaw family, bristle::SnapRule rule);

/// Returns the mean deflection in steady sliding over the mean snap length.
double kinetic_bend(bristle::SnapRule rule, double cv);

}  // namespace cli
