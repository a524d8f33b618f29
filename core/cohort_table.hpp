// The seam between core and kernels for the infinite brush: plain structs of raw pointers and a table of
// functions, as in kernel_table.hpp. The equations are in core/patches/COHORTS.md.
//
// Lengths are scaled (kernel_table.hpp). Places of cohorts are doubles, counted from a base that follows the
// patch, so that they stay short; positions of the patch are fixed point. Masses are whole numbers of a fixed
// unit, held in doubles: their sums are exact in any order.
#pragma once

#include <cstdint>

#include "core/kernel_table.hpp"

namespace bristle::detail {

constexpr std::uint32_t cohort_lanes = 8;  ///< logical lanes of a row, on every instruction set
constexpr std::uint32_t most_cohorts = 512;

/// Columns of a row of 8 cohorts, 64 bytes each: one cohort is a lane of a row.
enum CohortColumn : std::uint32_t {
  cohort_x,       ///< where the bristles were last straight, scaled, from CohortState::base
  cohort_y,       ///< 0 with one axis
  cohort_reach,   ///< R, the farthest they have been bent since, beyond l_r: those left are stronger
  cohort_fresh,   ///< u, mass they would have if none had snapped; the mass is floor(u S(R))
  cohort_left,    ///< S(R), share of a fresh population that is stronger than R
  cohort_moment,  ///< E[delta; delta < R], scaled: moment of those that have snapped
  cohort_low,     ///< ranks (order of coming into contact, units of mass) are spread evenly over [low, high)
  cohort_high,
  cohort_columns
};
constexpr std::uint32_t cohort_row = cohort_lanes * cohort_columns;  ///< doubles of a row
/// R is this much above the deflection that set it (scaled): a patch that trembles comes back to its farthest
/// place, and to the place at which the last were born, without another look.
constexpr double reach_margin = 0x1p-32;
constexpr double unused_reach = 8192.0;  ///< R of a lane that holds no cohort: nothing is bent so far

/// Survival function of a law, linear between nodes. Cells are 1/128 of (x + 1/16) wide: cell number by the
/// upper bits of x + 1/16.
struct alignas(32) SurvivalCell {
  double survival;  ///< S at `start`
  double slope;     ///< of S, never above 0
  double moment;    ///< E[delta; delta < start]
  double start;     ///< scaled
};
constexpr double survival_offset = 0.0625;
constexpr int survival_shift = 52 - 7;                ///< mantissa bits that number the cells of an octave: 7
constexpr std::uint64_t survival_first = 1019u << 7;  ///< upper bits of survival_offset

/// Longest piece over the longest snap length; a piece may be a fifth longer than asked for.
constexpr double longest_piece_share = 0.6;

struct CohortLaw {
  const SurvivalCell* cells;
  double end;             ///< S(end) = 0; longer arguments are taken as `end`
  double sure;            ///< S(sure) = 1 to the last unit of mass: a cohort's R is at least this
  double mean;            ///< scaled
  double piece;           ///< longest piece of path taken at once, scaled
  double forget;          ///< straight path after which a patch has forgotten how it began, scaled
  double negligible;      ///< share of a patch's mass: a cohort that has less snaps as a whole
  double slow;            ///< from this distance on pieces of a long step may grow with it, scaled
  double longest_growth;  ///< of these pieces, as a factor
  double most_apart;      ///< squared distance of a pair of cohorts that was moved apart over what it was
  double residual;        ///< l_r, scaled: what a snap leaves; R counts from it
  double renewal;         ///< kappa: bristles renewed by a snap
  double snap_rate;       ///< snaps of a bristle per scaled length of steady sliding
  /// For a patch that fluctuates as n bristles: the mass of one bristle (0 = no noise), and the key of its
  /// draws.
  double bristle;
  std::uint64_t draw_key;
};

/// Times of a patch that ages. Bristles snap at l_r + delta g(age), and R is (deflection - l_r) / g. In s,
/// from the patch's base of time. Null and 0 for kernels without ageing.
struct CohortTimes {
  double* births;      ///< by cohort: when its bristles were last straight
  double now;          ///< at the end of a move or a piece of it
  double per_length;   ///< s per scaled length of the path
  double strength;     ///< beta or gain
  double rate;         ///< 1 / tau, 1/s
  unsigned saturates;  ///< 1: g = 1 + gain (1 - exp(-a / tau)); 0: g = 1 + beta ln(1 + a / tau)
};

constexpr std::uint32_t no_cohort = 0xFFFFFFFFu;

/// State of a patch apart from its rows of cohorts.
struct CohortState {
  std::int64_t base[2] = {0, 0};     ///< from which places count: whole scaled lengths
  double mass = 0.0;                 ///< of all cohorts, whole units
  double moment[2] = {0.0, 0.0};     ///< sum of mass x place
  double direction[2] = {0.0, 0.0};  ///< of the straight slide that the patch is in
  double run = 0.0;                  ///< its length so far, scaled
  /// Cohorts that may still grow: [0] of bristles that snapped, [1] of bristles that came into contact. Each
  /// absorbs births within a piece of `begin` (where its first bristles would be straight).
  double begin[2][2] = {{0.0, 0.0}, {0.0, 0.0}};
  /// [2]: of bristles that snapped, closed, and to be moved apart from [0] when that one closes.
  std::uint32_t open[3] = {no_cohort, no_cohort, no_cohort};
  double spread =
      0.0;  ///< of the places in [0] and [2], lost by joining them: sum of mass x length^2, stored
  /// 0: all came into contact at once, and every cohort's ranks are [0, mass). 1: load has risen since.
  std::uint32_t layered = 0;
  std::uint32_t count = 0;
  std::uint32_t capacity = 0;  ///< at least 8
  /// Passes of random draws so far, and the renewals that are still to be drawn for: less than one.
  std::uint64_t draws = 0;
  double draws_due = 0.0;
  /// Result of a move: no bristle snaps within this distance of the middle of the bound; below 0 = unknown.
  /// Not part of the saved state.
  double slack = -1.0;
};

namespace {  // a copy for each object: instruction sets share no function

inline double& entry(double* rows, std::uint32_t i, CohortColumn column) noexcept {
  return rows[i / cohort_lanes * cohort_row + column * cohort_lanes + i % cohort_lanes];
}
inline double entry(const double* rows, std::uint32_t i, CohortColumn column) noexcept {
  return rows[i / cohort_lanes * cohort_row + column * cohort_lanes + i % cohort_lanes];
}
inline double mass_of(const double* rows, std::uint32_t i) noexcept {
  return __builtin_floor(entry(rows, i, cohort_fresh) * entry(rows, i, cohort_left));
}
/// Returns u for a cohort whose mass is the whole number m and of which the share S is left: floor(u S) gives
/// m again, half a unit from the next number.
inline double fresh_mass(double mass, double left) noexcept { return (mass + 0.5) / left; }

/// Clears a lane, so that it holds no cohort: it never snaps and weighs nothing.
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

/// A straight move of a patch; positions count from the base of the places.
struct CohortMove {
  double from[2], to[2];
  double direction[2];
  double length;      ///< scaled, > 0
  CohortTimes times;  ///< `now`: at the beginning of the move
  bool books = true;  ///< false: CohortTotals::integral and lost are not asked for, and may be wrong
};

/// Sums of one move, in units of mass.
struct CohortTotals {
  double integral[2];  ///< of the sum of mass x deflection, over the path
  double lost;         ///< twice the energy lost: mass x length^2
  double snapped;      ///< mass that snapped; what was renewed is not counted
  std::uint32_t pieces;
  std::uint32_t merges;
};

struct CohortKernels {
  /// Advances a patch along a move, cut in pieces; index: axes - 1, and 2 more for laws with residual or
  /// renewal, 4 more for laws that age. Changes rows, births and state but for base, direction and run.
  void (*move[6])(const CohortLaw&, CohortState&, double* rows, const CohortMove&, CohortTotals&);
  /// Smallest distance, over all cohorts, by which the deflection at a place stays below its farthest so far;
  /// scaled. Below 0: a cohort is bent farther than ever. Without ageing.
  double (*find_slack)(const CohortLaw&, const CohortState&, const double* rows, const double at[2]);
  /// Merges the cheapest pairs, so that at least one more cohort has room. Returns twice the energy lost.
  /// Index: 1 for laws that age.
  double (*make_room[2])(const CohortLaw&, CohortState&, double* rows, const double at[2],
                         const CohortTimes&);
  /// Mass above the rank `cut`, and its density there (mass per rank): for the load.
  void (*mass_above)(const CohortState&, const double* rows, double cut, double* mass, double* density);
  /// Bristles come into contact straight at `at`. Returns twice the energy that joining others loses. Index:
  /// 1 for laws that age.
  double (*enter[2])(const CohortLaw&, CohortState&, double* rows, const double at[2], double mass,
                     double low, double high, bool joins, const CohortTimes&);
  /// Gives cohort i fresh snap lengths, conditioned on exceeding its reach (at least `bent`), from the mass
  /// floor(u). Returns the surviving mass.
  double (*renew)(const CohortLaw&, double* rows, std::uint32_t i, double bent);
};

/// Draws for a patch that fluctuates as n bristles do: the mass that leaves a cohort is drawn, bristle by
/// bristle. One table serves every instruction set: draws and their pass are scalar, so the bits are equal.
struct CohortNoise {
  /// As CohortKernels::move.
  void (*move[6])(const CohortLaw&, CohortState&, double* rows, const CohortMove&, CohortTotals&);
  /// Draws the mass that leaves when each bristle of `mass` leaves with the probability `chance`: whole
  /// bristles, binomial; a fraction of a bristle leaves as one. `pass` and `number` key the draw.
  double (*leave)(const CohortLaw&, std::uint64_t pass, std::uint32_t number, double mass, double chance);
};
extern const CohortNoise cohort_noise;

}  // namespace bristle::detail
