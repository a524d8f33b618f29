// Fluctuation on demand: a patch whose force fluctuates as that of n bristles (COHORTS.md, "Fluctuation").
//
// The pass over the cohorts that computes the mean mass leaving each also draws the mass that does leave
// (CohortNoise). Places of snaps, work, loss, renewals and births follow from the drawn mass, so energy
// balances and no loss is negative. This file has the key of the draws, draws outside a piece of path, and
// the saved state.
#pragma once

#include "core/common/little_endian.hpp"
#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {

/// Sets the constants of random draws in the law of the patch (CohortLaw), from the patch's options.
void set_fluctuation(Cohorts& r) noexcept;

/// Deals the n bristles out to the cohorts at random, after a slide so long that its start is forgotten;
/// without shared renewal bristles are then independent. Stored energy that this takes away counts as lost.
void scatter(const Cohorts& r, CohortState& s, double* rows, const CohortMove& move,
             CohortTotals& t) noexcept;

/// Returns the mean deflection of steady sliding, which stands for the momentary, noisy one along a carried
/// path (one whose cohorts stay the same).
double carried_deflection(const Cohorts& r, const CohortMove& move, int axis) noexcept;

/// Draws the mass of cohort i that survives a change of law: bristles whose fresh length exceeds their
/// deflection. `mass`: mass of the cohort before; `mean_kept`: its expected mass after.
double draw_kept(Cohorts& r, std::uint32_t i, double mass, double mean_kept) noexcept;

/// Draws the cuts of a falling load: `kept` is the mean mass that each cohort keeps. The number of bristles
/// that leave is fixed; which bristles of a cohort came last is random. Changes the entries of `kept`, not
/// their sum.
void draw_cut(Cohorts& r, double* kept) noexcept;

// --- saved state and hash; a patch that does not fluctuate adds nothing to them
constexpr std::size_t fluctuation_fields_size = 2 * 8;
template <class Io, class State>
void fluctuation_fields(Io& io, State& s) noexcept {
  io(s.draws);
  io(s.draws_due);
}

}  // namespace bristle::detail
