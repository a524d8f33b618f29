// Fluctuation on demand: a patch whose force fluctuates as that of n bristles (COHORTS.md, "Fluctuation").
//
// The mass that leaves a cohort is drawn in the pass over the cohorts that computes its mean (CohortNoise).
// Place of the snap, work, loss, renewals and births follow from the mass that did leave, so energy balances
// and no loss is negative. This file has the rest: the key of the draws, draws outside a piece of path, and
// the saved state.
#pragma once

#include "core/common/little_endian.hpp"
#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {

/// Sets the constants of random draws in the patch's law, from its options.
void set_fluctuation(Cohorts& r) noexcept;

/// Assigns each of n bristles to a cohort at random, after a slide that forgot how it began: as independent
/// as bristles are without shared renewal. Books the change of stored energy.
void scatter(const Cohorts& r, CohortState& s, double* rows, const CohortMove& move,
             CohortTotals& t) noexcept;

/// Returns the mean deflection of steady sliding, with which a carried path is counted in place of the
/// momentary, noisy one.
double carried_deflection(const Cohorts& r, const CohortMove& move, int axis) noexcept;

/// Draws the mass of cohort i that survives a change of the law: bristles whose fresh length exceeds their
/// deflection. `mass`: of the cohort; `mean_kept`: the expected result.
double draw_kept(Cohorts& r, std::uint32_t i, double mass, double mean_kept) noexcept;

/// Draws the cuts of a falling load: `kept` is the mean mass that each cohort keeps. Which bristles of a
/// cohort came last is random; how many leave is not. Changes the entries of `kept`, not their sum.
void draw_cut(Cohorts& r, double* kept) noexcept;

// --- saved state and hash; a patch that does not fluctuate adds nothing
constexpr std::size_t fluctuation_fields_size = 2 * 8;
template <class Io, class State>
void fluctuation_fields(Io& io, State& s) noexcept {
  io(s.draws);
  io(s.draws_due);
}

}  // namespace bristle::detail
