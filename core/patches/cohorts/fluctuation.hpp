// Fluctuation on demand: an infinite brush whose force fluctuates as that of n bristles (COHORTS.md,
// "Fluctuation"). The pass over the cohorts that computes the mean mass leaving each cohort also samples the
// mass that really leaves (CohortNoise). Places of snaps, work, energy lost and renewals follow from the
// sampled mass, so energy balances and no loss is negative. This file has the key of the random numbers, the
// sampling outside a piece of path, and the saved state.
#pragma once

#include "core/common/little_endian.hpp"
#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {

/// Sets the constants for sampling in the law of the patch (CohortLaw), from the patch's options.
void set_fluctuation(Cohorts& r) noexcept;

/// Distributes the n bristles to the cohorts at random, after a slide so long that its start is forgotten.
/// Without shared renewal the bristles are independent of each other then. The stored energy that this
/// takes away is counted as lost.
void scatter(const Cohorts& r, CohortState& s, double* rows, const CohortMove& move,
             CohortTotals& t) noexcept;

/// Returns the mean deflection of steady sliding. It replaces the momentary, noisy mean along a carried path,
/// on which the cohorts stay the same.
double carried_deflection(const Cohorts& r, const CohortMove& move, int axis) noexcept;

/// Samples the mass of cohort i that remains after a change of law: the bristles whose fresh length exceeds
/// their deflection. `mass`: mass of the cohort before; `mean_kept`: its expected mass after.
double draw_kept(Cohorts& r, std::uint32_t i, double mass, double mean_kept) noexcept;

/// Samples how many bristles leave each cohort when the load falls: `kept` is the mean mass that each cohort
/// keeps. The total number that leaves is fixed; which bristles of a cohort came last is random. Changes the
/// entries of `kept`, not their sum.
void draw_cut(Cohorts& r, double* kept) noexcept;

// --- saved state and hash; a patch that does not fluctuate adds nothing to them
template <class Io, class State>
void fluctuation_fields(Io& io, State& s) noexcept {
  io(s.draws);
  io(s.draws_due);
}

}  // namespace bristle::detail
