// Decay rate of the slowest wave of a renewing population.
#pragma once

#include <vector>

#include "core/cohort_table.hpp"

namespace bristle::detail {

/// A wave of the rate of snaps, exp(-decay x) cos(frequency x) over the path x, per unit of the table's
/// lengths.
struct SlowWave {
  double decay, frequency;
};

/// Finds the wave of the snap rate that decays most slowly. Bristles that began to slide together snap in
/// step, and each draws a fresh length, so the rate obeys the renewal equation; its waves are the roots s =
/// -decay + i frequency of p(s) = 1, s != 0, where p is the Laplace transform of the density of lengths.
/// Returns an infinite decay if it finds no wave: then none outlives the longest bristles. `cells`: those of
/// a survival table (straight in each cell), the last one its end. Looks at wave lengths down to 1/24 of the
/// mean, at least.
SlowWave find_slow_wave(const std::vector<SurvivalCell>& cells, double mean);

}  // namespace bristle::detail
