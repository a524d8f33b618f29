// Makes laws of the snap length from family, mean and spread, as fits and experiments vary them, and gives
// the limits of the spread.
#pragma once

#include <cstddef>

#include <bristle/fields.hpp>
#include <bristle/material.hpp>

namespace cli {

/// Largest spreads (standard deviation over mean) of snap lengths that the library accepts: for the rule
/// redraw, and for keep (core/MODEL.md, "Jumps").
using bristle::widest_redraw_cv;
constexpr double widest_cv = 3.0;

/// Makes a law of snap lengths with this mean (m) and spread (standard deviation over mean): lognormal,
/// normal (cut at 0; the spread is the uncut law's), uniform, exponential or single (whose spread is fixed).
/// Throws bristle::Error if the family cannot have the spread.
bristle::SnapLength make_snap_length(bristle::SnapLaw family, double mean_m, double spread);

/// Returns the largest spread (standard deviation over mean) that both the law and the snap rule allow.
double largest_spread(bristle::SnapLaw family, bristle::SnapRule rule);

/// Returns the mean deflection of the bristles in steady sliding, over the mean snap length.
double kinetic_bend(bristle::SnapRule rule, double cv);

/// Names of the snap rules in files, options and reports, in the order of SnapRule.
using bristle::snap_rule_names;
inline const char* to_string(bristle::SnapRule rule) noexcept {
  return snap_rule_names[static_cast<std::size_t>(rule)];
}

}  // namespace cli
