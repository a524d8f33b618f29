// Fluctuation on demand: an infinite brush whose force fluctuates as that of n bristles (COHORTS.md,
// "Fluctuation"). The pass over the cohorts that computes the mean mass leaving each cohort also samples the
// mass that really leaves (CohortNoise). Places of snaps, work, energy lost and renewals follow from the
// sampled mass, so energy balances and no loss is negative. This file has the constants of the sampling, and
// the sampling outside a piece of path.
#pragma once

#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {

/// Sets, from the patch's options, the constants in its law with which bristles are sampled at random.
void set_fluctuation(Cohorts& r) noexcept;

/// Distributes n bristles to the cohorts at random, after a slide so long that its start is forgotten.
/// Without shared renewal bristles are then independent of each other. The change of stored energy that this
/// causes is counted as lost.
void scatter(const Cohorts& r, CohortState& s, double* rows, const CohortMove& move,
             CohortTotals& t) noexcept;

/// Returns the mean deflection of steady sliding along an axis. Along a path on which the cohorts stay the
/// same, it replaces their momentary, noisy mean.
double carried_deflection(const Cohorts& r, const CohortMove& move, int axis) noexcept;

/// Samples the mass of cohort number i that holds when the snap-length law changes: bristles whose new length
/// exceeds their deflection. `mass`: mass before the change; `mean_kept`: expected mass after it.
double draw_kept(Cohorts& r, std::uint32_t i, double mass, double mean_kept) noexcept;

/// Samples how many bristles leave each cohort when the load falls. `kept`: expected mass that each cohort
/// keeps, replaced by the sampled one. The total that leaves is fixed; which bristles of a cohort came last
/// is random.
void draw_cut(Cohorts& r, double* kept) noexcept;

}  // namespace bristle::detail
