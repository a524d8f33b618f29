// Decay rate of the slowest wave of a renewing population.
#pragma once

#include <vector>

#include "core/cohort_table.hpp"

namespace bristle::detail {

/// A wave of the rate of snaps, exp(-decay x) cos(frequency x) over the path x. Per unit of the table's
/// lengths.
struct SlowWave {
  double decay, frequency;
};

/// Bristles that began to slide together snap in step, and each draws a fresh length: the rate of snaps obeys
/// the renewal equation. Returns its wave that dies last: the root s = -decay + i frequency of p(s) = 1, p
/// the Laplace transform of the density of lengths, s != 0. The decay is infinite where no wave is seen: then
/// none outlives the longest bristles.
///
/// `cells`: of a survival table (straight in each cell), the last one its end. Looks at wave lengths down to
/// 1/24 of the mean, at least.
SlowWave find_slow_wave(const std::vector<SurvivalCell>& cells, double mean);

}  // namespace bristle::detail
