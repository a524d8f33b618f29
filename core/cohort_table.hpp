// The interface between core and kernels for the infinite brush: plain structs of raw pointers and a table of
// functions, as in kernel_table.hpp. A cohort is all bristles that were last straight at one place of the
// path and have been bent alike since. core/patches/COHORTS.md has the equations.
//
// Lengths are scaled (kernel_table.hpp). Places of cohorts are doubles relative to a base that follows the
// patch, so that they stay small; positions of the patch are fixed point. Masses (numbers of bristles) are
// whole numbers of a fixed unit, stored in doubles, so that their sums are exact in any order.
#pragma once

#include <cstdint>

#include "core/kernel_table.hpp"

namespace bristle::detail {

constexpr std::uint32_t cohort_lanes = 8;  ///< number of cohorts that a row holds, on every instruction set
constexpr std::uint32_t most_cohorts = 512;

/// Columns of a row of 8 cohorts, 64 bytes each. A cohort has one lane of each column of its row.
enum CohortColumn : std::uint32_t {
  /// X coordinate of the patch when the cohort's bristles were last straight, scaled, relative to
  /// CohortState::base.
  cohort_x,
  cohort_y,  ///< y of that position; 0 with one axis
  /// Reach R: the largest deflection of the cohort's bristles so far, beyond l_r. Bristles still in the
  /// cohort have longer snap lengths.
  cohort_reach,
  /// Mass u that the cohort would have if none of its bristles had snapped. Its mass is floor(u S(R)).
  cohort_fresh,
  cohort_left,    ///< S(R), the share of fresh snap lengths that are longer than R
  cohort_moment,  ///< E[delta; delta < R], scaled: part of the mean snap length from lengths below R
  /// Lower end of the cohort's ranks, which are uniform over [low, high). The rank of a bristle is the mass
  /// that came into contact before it.
  cohort_low,
  cohort_high,
  cohort_columns
};
/// Number of doubles in a row of eight cohorts: one for each cohort and column.
constexpr std::uint32_t cohort_row = cohort_lanes * cohort_columns;

/// Margin, in scaled units, by which a stored reach R exceeds the deflection that set it. Without it a patch
/// that trembles would visit its cohorts at every return to its farthest position, or to that of its newest
/// cohort.
constexpr double reach_margin = 0x1p-32;
constexpr double unused_reach = 8192.0;  ///< reach R of an unused lane, so long that no deflection exceeds it

/// Cell of the tabulated survival function S of a law, on which S is linear. The cell of a snap length x is
/// 1/128 as wide as the power of two at or below x + 1/16, so the upper bits of x + 1/16 are its number.
struct alignas(32) SurvivalCell {
  double survival;  ///< value of S at `start`
  double slope;     ///< slope of S in the cell, never above 0
  double moment;    ///< E[delta; delta < start]: first moment of the snap lengths below `start`
  double start;     ///< x, snap length at the beginning of the cell, scaled
};
constexpr double survival_offset = 0.0625;
/// Shift that leaves exponent and 7 mantissa bits of x + 1/16, which number the cell: 128 cells for each
/// octave.
constexpr int survival_shift = 52 - 7;
/// Number of the first cell: the upper bits of the offset 1/16 (survival_offset).
constexpr std::uint64_t survival_first = 1019u << 7;

/// Longest planned piece of path, as a share of the longest snap length, so that bristles that snap early in
/// a piece can survive to its end. The last piece of a move may be a fifth longer.
constexpr double longest_piece_share = 0.6;

struct CohortLaw {
  const SurvivalCell* cells;
  double end;  ///< snap length from which S is 0; longer deflections count as this one
  /// Snap length up to which the survival S is 1 to the last unit of mass, so that no bristle snaps. A
  /// cohort's R is at least this.
  double sure;
  double mean;  ///< mean snap length, scaled
  /// Usual length, scaled, of a piece of path that is computed at once. Pieces in the middle of long moves
  /// are longer.
  double piece;
  /// Path of a straight slide, scaled, after which the force does not depend on how the slide began. A step
  /// this long needs no pieces.
  double forget;
  double negligible;  ///< share of the patch's mass below which the rest of a cohort snaps as a whole
  /// Distance from either end of a move, scaled, beyond which its pieces may grow in proportion to the
  /// distance.
  double slow;
  double longest_growth;  ///< largest factor by which pieces grow in the middle of a move
  /// Largest factor by which close_open() may raise the squared distance of two cohorts, so that they have
  /// the variance of their bristles' places. 1: it moves none.
  double most_apart;
  double residual;   ///< l_r, scaled: deflection left after a snap; the reach R counts from it
  double renewal;    ///< kappa, number of bristles that a snap renews
  double snap_rate;  ///< snaps per bristle and scaled length of path in steady sliding
};

/// Times of a patch that ages, in s from the patch's base of time. Bristles snap at l_r + delta g(age), and
/// the reach R is (deflection - l_r) / g. For kernels without ageing the pointer is null and all numbers are
/// 0.
struct CohortTimes {
  double* births;     ///< times at which the bristles of each cohort were last straight
  double now;         ///< present time: the end of a piece of a move; in CohortMove the beginning of the move
  double per_length;  ///< time that a scaled length of the path takes, s
  double strength;    ///< strength of ageing: beta (logarithmic) or gain (saturating)
  double rate;        ///< 1 / tau, tau the ageing time; 1/s
  unsigned saturates;  ///< 1: g = 1 + gain (1 - exp(-a / tau)); 0: g = 1 + beta ln(1 + a / tau)
};

constexpr std::uint32_t no_cohort = 0xFFFFFFFFu;

/// State of an infinite brush apart from its rows of cohorts.
struct CohortState {
  /// Position from which the places of cohorts are counted, fixed point. It is moved by whole scaled lengths.
  std::int64_t base[2] = {0, 0};
  double mass = 0.0;                 ///< mass of all cohorts, an integer
  double moment[2] = {0.0, 0.0};     ///< sum over the cohorts of mass x place, for x and y
  double direction[2] = {0.0, 0.0};  ///< direction of the present straight slide of the patch
  double run = 0.0;                  ///< length of the present straight slide so far, scaled

  /// Position of the patch at which the first bristles of the cohorts open[0] and open[1] were straight. An
  /// open cohort absorbs bristles that become straight within a piece of path from there, so that not every
  /// bristle needs a cohort.
  double begin[2][2] = {{0.0, 0.0}, {0.0, 0.0}};
  /// Indices of cohorts: [0] absorbs bristles that snap, [1] those that come into contact. [2] is the closed
  /// cohort from which [0] is moved apart when [0] closes.
  std::uint32_t open[3] = {no_cohort, no_cohort, no_cohort};
  /// Sum over the bristles of the cohorts open[0] and open[2] of mass x squared distance between the place of
  /// the bristle and that of its cohort.
  double spread = 0.0;

  /// 1 if the load has risen since first contact. With 0, all bristles came into contact together, and every
  /// cohort has bristles of all ranks, [0, mass).
  std::uint32_t layered = 0;
  std::uint32_t count = 0;
  std::uint32_t capacity = 0;  ///< most cohorts that the rows can hold, at least 8

  /// Distance from the middle of the last move within which no bristle snaps; below 0 = unknown, as after a
  /// move in which bristles snapped. A cache, not part of the saved state.
  double slack = -1.0;
};

namespace {  // unnamed: each object gets its copies, since instruction sets must not share a function

inline double& entry(double* rows, std::uint32_t i, CohortColumn column) noexcept {
  return rows[i / cohort_lanes * cohort_row + column * cohort_lanes + i % cohort_lanes];
}
inline double entry(const double* rows, std::uint32_t i, CohortColumn column) noexcept {
  return rows[i / cohort_lanes * cohort_row + column * cohort_lanes + i % cohort_lanes];
}
inline double mass_of(const double* rows, std::uint32_t i) noexcept {
  return __builtin_floor(entry(rows, i, cohort_fresh) * entry(rows, i, cohort_left));
}
/// Returns u, the mass without snaps, of a cohort that has the mass m (a whole number) of which the share S
/// is left. Adds half a unit to m, so that floor(u S) gives m again.
inline double fresh_mass(double mass, double left) noexcept { return (mass + 0.5) / left; }

/// Empties the lane of cohort i: no mass, and a reach that no deflection exceeds.
inline void clear_lane(double* rows, std::uint32_t i) noexcept {
  for (std::uint32_t c = 0; c < cohort_columns; ++c) entry(rows, i, static_cast<CohortColumn>(c)) = 0.0;
  entry(rows, i, cohort_reach) = unused_reach;
}

/// Removes cohort i and moves the last cohort to its place. `births`: null without ageing.
inline void remove_cohort(CohortState& s, double* rows, double* births, std::uint32_t i) noexcept {
  const std::uint32_t last = --s.count;
  for (std::uint32_t& open : s.open)
    if (open == i)
      open = no_cohort;
    else if (open == last)
      open = i;
  if (i != last)
    for (std::uint32_t c = 0; c < cohort_columns; ++c)
      entry(rows, i, static_cast<CohortColumn>(c)) = entry(rows, last, static_cast<CohortColumn>(c));
  if (births != nullptr) births[i] = births[last];
  clear_lane(rows, last);
}

}  // namespace

/// A straight move of a patch, the input of a kernel. Positions are relative to the base of the places.
struct CohortMove {
  double from[2], to[2];
  double direction[2];
  double length;      ///< length of the move, scaled, > 0
  CohortTimes times;  ///< times of the move; `now` is its beginning
  /// Whether the caller needs the outputs CohortTotals::integral and lost; if not, they are not computed.
  bool books = true;
};

/// Sums of one move, from which the response follows. Masses are in units of mass.
struct CohortTotals {
  double integral[2];  ///< integral along the path of the sum over the cohorts of mass x deflection
  double lost;         ///< twice the energy lost in the move, in mass x length^2
  double snapped;      ///< mass of the bristles that snapped, not counting renewed ones
  std::uint32_t pieces;
  std::uint32_t merges;
};

struct CohortKernels {
  /// Advances a patch along a move, cut into pieces. Index: axes - 1, plus 2 for laws with residual or
  /// renewal, or plus 4 for laws that age. Changes rows, births and state except CohortState::base, direction
  /// and run.
  void (*move[6])(const CohortLaw&, CohortState&, double* rows, const CohortMove&, CohortTotals&);
  /// Returns the distance, scaled, that the patch at `at` may move before a cohort is bent beyond l_r + R (R
  /// its reach). Within it no bristle snaps; below 0 a cohort is bent beyond its reach already. For laws
  /// without ageing.
  double (*find_slack)(const CohortLaw&, const CohortState&, const double* rows, const double at[2]);
  /// Merges the pairs of cohorts that cost the least energy to merge (Partner, kernels/cohort_parts.hpp), to
  /// make room for new cohorts. Returns twice the energy that merging loses. Index: 1 for laws that age.
  double (*make_room[2])(const CohortLaw&, CohortState&, double* rows, const double at[2],
                         const CohortTimes&);
  /// Computes the mass whose rank is above `cut`, and the mass per rank there. When the load falls, the mass
  /// above a cut leaves contact.
  void (*mass_above)(const CohortState&, const double* rows, double cut, double* mass, double* density);
  /// Adds straight bristles of ranks [low, high) that come into contact with the patch at `at`. They form a
  /// new cohort or join the cohort open[1] (`joins`), which loses some energy. Returns twice that energy.
  /// Index: 1 for laws that age.
  double (*enter[2])(const CohortLaw&, CohortState&, double* rows, const double at[2], double mass,
                     double low, double high, bool joins, const CohortTimes&);
  /// Gives the bristles of cohort i, of mass floor(u), fresh snap lengths. Sets its reach to `bent` (at least
  /// CohortLaw::sure) and removes bristles whose length is not above it. Returns the mass left.
  double (*renew)(const CohortLaw&, double* rows, std::uint32_t i, double bent);
};

}  // namespace bristle::detail
