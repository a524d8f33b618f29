// The seam between core and kernels for the infinite brush: plain structs of raw pointers and a table of
// functions, as in kernel_table.hpp. The equations are in core/patches/COHORTS.md.
//
// Lengths are scaled (kernel_table.hpp). Places of cohorts are doubles relative to a base that follows the
// patch, so that they stay small; positions of the patch are fixed point. Masses are integers of a fixed
// unit, held in doubles, so that their sums are exact in any order.
#pragma once

#include <cstdint>

#include "core/kernel_table.hpp"

namespace bristle::detail {

constexpr std::uint32_t cohort_lanes = 8;  ///< logical lanes of a row, on every instruction set
constexpr std::uint32_t most_cohorts = 512;

/// Columns of a row of 8 cohorts, 64 bytes each: one cohort is a lane of a row.
enum CohortColumn : std::uint32_t {
  cohort_x,       ///< place where the bristles were last straight, scaled, relative to CohortState::base
  cohort_y,       ///< second coordinate of that place, 0 with one axis
  cohort_reach,   ///< R, the farthest they have been bent since, beyond l_r; the bristles left have longer
                  ///< snap lengths
  cohort_fresh,   ///< u, their mass if none had snapped; the mass is floor(u S(R))
  cohort_left,    ///< S(R), the share of fresh lengths that exceeds R
  cohort_moment,  ///< E[delta; delta < R], scaled: moment of the lengths that have snapped
  cohort_low,     ///< ranks (order of coming into contact, in units of mass) are uniform over [low, high)
  cohort_high,
  cohort_columns
};
constexpr std::uint32_t cohort_row = cohort_lanes * cohort_columns;  ///< number of doubles in a row of eight
                                                                     ///< cohorts
/// R exceeds the deflection that set it by this much (scaled): a patch that trembles returns to its farthest
/// place, and to the place of the newest cohort, without a visit.
constexpr double reach_margin = 0x1p-32;
constexpr double unused_reach = 8192.0;  ///< R of a lane without a cohort, so long that nothing reaches it

/// Survival function of a law, linear between nodes. A cell is 1/128 of (x + 1/16) wide, so the upper bits
/// of x + 1/16 are its number.
struct alignas(32) SurvivalCell {
  double survival;  ///< value of S at `start`
  double slope;     ///< slope of S, never above 0
  double moment;    ///< first moment of the lengths below `start`, E[delta; delta < start]
  double start;     ///< x at the beginning of the cell, scaled
};
constexpr double survival_offset = 0.0625;
constexpr int survival_shift = 52 - 7;                ///< mantissa bits below the cell's number; 7 bits
                                                      ///< number the cells of an octave
constexpr std::uint64_t survival_first = 1019u << 7;  ///< number of the first cell: the upper bits of
                                                      ///< survival_offset

/// Longest piece over the longest snap length; pieces may be a fifth longer than asked for.
constexpr double longest_piece_share = 0.6;

struct CohortLaw {
  const SurvivalCell* cells;
  double end;             ///< length from which S is 0; longer arguments count as `end`
  double sure;            ///< length up to which S is 1 to the last unit of mass; a cohort's R is at least
                          ///< this
  double mean;            ///< mean snap length, scaled
  double piece;           ///< longest piece of path taken at once, scaled
  double forget;          ///< straight path after which a patch has forgotten its start, scaled
  double negligible;      ///< share of a patch's mass; a cohort with less snaps as a whole
  double slow;            ///< distance from which on pieces of a long step may grow with it, scaled
  double longest_growth;  ///< largest growth of these pieces, as a factor
  double most_apart;      ///< largest ratio of squared distances when a pair of cohorts is moved apart
  double residual;        ///< l_r, scaled: deflection after a snap, from which R counts
  double renewal;         ///< kappa: bristles that a snap renews
  double snap_rate;       ///< snaps of a bristle per scaled length of steady sliding
  /// For a patch that fluctuates as n bristles: the mass of one bristle (0 = no noise), and the key of its
  /// draws.
  double bristle;
  std::uint64_t draw_key;
};

/// Times of a patch that ages. Bristles snap at l_r + delta g(age), and R is (deflection - l_r) / g. In s,
/// from the patch's base of time. Null and 0 for kernels without ageing.
struct CohortTimes {
  double* births;      ///< for each cohort: time when its bristles were last straight
  double now;          ///< time at the end of a move or of a piece of it
  double per_length;   ///< time that a scaled length of the path takes, s
  double strength;     ///< strength of ageing: beta (logarithmic) or gain (saturating)
  double rate;         ///< 1 / tau, 1/s
  unsigned saturates;  ///< 1: g = 1 + gain (1 - exp(-a / tau)); 0: g = 1 + beta ln(1 + a / tau)
};

constexpr std::uint32_t no_cohort = 0xFFFFFFFFu;

/// State of a patch apart from its rows of cohorts.
struct CohortState {
  std::int64_t base[2] = {0, 0};     ///< origin of places, in whole scaled lengths
  double mass = 0.0;                 ///< mass of all cohorts, an integer
  double moment[2] = {0.0, 0.0};     ///< sum of mass x place
  double direction[2] = {0.0, 0.0};  ///< direction of the straight slide that the patch is in
  double run = 0.0;                  ///< length of that slide so far, scaled
  /// Places where the first bristles of the open cohorts [0] and [1] would be straight. Such a cohort absorbs
  /// births within a piece of its place.
  double begin[2][2] = {{0.0, 0.0}, {0.0, 0.0}};
  /// Cohorts that may still grow: [0] of bristles that snapped, [1] of bristles that came into contact. [2]
  /// is a closed one of bristles that snapped, to be moved apart from [0] when [0] closes.
  std::uint32_t open[3] = {no_cohort, no_cohort, no_cohort};
  double spread =
      0.0;  ///< stored spread of the places in [0] and [2] that joining them removed: sum of mass x length^2
  /// 0: all came into contact at once, and every cohort's ranks are [0, mass). 1: the load has risen since.
  std::uint32_t layered = 0;
  std::uint32_t count = 0;
  std::uint32_t capacity = 0;  ///< most cohorts, at least 8
  /// `draws`: passes of random draws so far. Then the renewals that are still to be drawn for, less than one.
  std::uint64_t draws = 0;
  double draws_due = 0.0;
  /// Result of a move: within this distance of the middle of the bound no bristle snaps; below 0 = unknown.
  /// Not part of the saved state.
  double slack = -1.0;
};

namespace {  // gives each object a copy, because instruction sets share no function

inline double& entry(double* rows, std::uint32_t i, CohortColumn column) noexcept {
  return rows[i / cohort_lanes * cohort_row + column * cohort_lanes + i % cohort_lanes];
}
inline double entry(const double* rows, std::uint32_t i, CohortColumn column) noexcept {
  return rows[i / cohort_lanes * cohort_row + column * cohort_lanes + i % cohort_lanes];
}
inline double mass_of(const double* rows, std::uint32_t i) noexcept {
  return __builtin_floor(entry(rows, i, cohort_fresh) * entry(rows, i, cohort_left));
}
/// Returns u for a cohort whose mass is the integer m and of which the share S is left, half a unit from the
/// next integer, so that floor(u S) gives m again.
inline double fresh_mass(double mass, double left) noexcept { return (mass + 0.5) / left; }

/// Clears a lane to hold no cohort: it never snaps and weighs nothing.
inline void clear_lane(double* rows, std::uint32_t i) noexcept {
  for (std::uint32_t c = 0; c < cohort_columns; ++c) entry(rows, i, static_cast<CohortColumn>(c)) = 0.0;
  entry(rows, i, cohort_reach) = unused_reach;
}

/// Removes cohort i: the last cohort takes its place. `births`: null without ageing.
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

/// A straight move of a patch; positions are relative to the base of the places.
struct CohortMove {
  double from[2], to[2];
  double direction[2];
  double length;      ///< length of the move, scaled, > 0
  CohortTimes times;  ///< times of the move; `now` is its beginning
  bool books = true;  ///< whether CohortTotals::integral and lost are asked for; if not they may be wrong
};

/// Sums of one move, in units of mass.
struct CohortTotals {
  double integral[2];  ///< path integral of the sum of mass x deflection
  double lost;         ///< twice the energy lost, in mass x length^2
  double snapped;      ///< mass that snapped, without renewed mass
  std::uint32_t pieces;
  std::uint32_t merges;
};

struct CohortKernels {
  /// Advances a patch along a move, cut into pieces. Index: axes - 1, plus 2 for laws with residual or
  /// renewal, or plus 4 for laws that age. Changes rows, births and state except base, direction and run.
  void (*move[6])(const CohortLaw&, CohortState&, double* rows, const CohortMove&, CohortTotals&);
  /// Returns the smallest distance, over all cohorts, by which the deflection at a place stays below its
  /// farthest so far; scaled. Below 0: a cohort is bent beyond its farthest. Without ageing.
  double (*find_slack)(const CohortLaw&, const CohortState&, const double* rows, const double at[2]);
  /// Merges the cheapest pairs, so that one more cohort has room. Returns twice the energy lost. Index: 1 for
  /// laws that age.
  double (*make_room[2])(const CohortLaw&, CohortState&, double* rows, const double at[2],
                         const CohortTimes&);
  /// Computes the mass above the rank `cut`, and its density there (mass per rank), for a falling load.
  void (*mass_above)(const CohortState&, const double* rows, double cut, double* mass, double* density);
  /// Adds straight bristles that come into contact at `at`. Returns twice the energy that joining another
  /// cohort loses. Index: 1 for laws that age.
  double (*enter[2])(const CohortLaw&, CohortState&, double* rows, const double at[2], double mass,
                     double low, double high, bool joins, const CohortTimes&);
  /// Gives cohort i fresh snap lengths, conditioned on exceeding its reach (at least `bent`), from the mass
  /// floor(u). Returns the surviving mass.
  double (*renew)(const CohortLaw&, double* rows, std::uint32_t i, double bent);
};

/// Functions of a patch that fluctuates as n bristles: the mass that leaves a cohort is drawn, bristle by
/// bristle. One table serves every instruction set, because draws are scalar, so the bits are equal.
struct CohortNoise {
  /// Advances a patch, as CohortKernels::move.
  void (*move[6])(const CohortLaw&, CohortState&, double* rows, const CohortMove&, CohortTotals&);
  /// Draws the mass that leaves if each bristle of `mass` leaves with the probability `chance`: a binomial
  /// number of whole bristles; a fraction of a bristle leaves as one. `pass` and `number` key the draw.
  double (*leave)(const CohortLaw&, std::uint64_t pass, std::uint32_t number, double mass, double chance);
};
extern const CohortNoise cohort_noise;

}  // namespace bristle::detail
