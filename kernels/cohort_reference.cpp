// The infinite brush, cohort by cohort: written to be read beside core/patches/COHORTS.md. The vector kernels
// (cohort_step.hpp) give the same bits: sums have 8 lanes and a fixed tree.
#include "cohort_parts.hpp"

namespace bristle::detail {
namespace {

/// Eight lanes of a sum over cohorts; cohort i belongs to lane i mod 8.
struct LaneSum {
  double lane[cohort_lanes] = {};
  double total() const {
    const double* const l = lane;
    return ((l[0] + l[4]) + (l[2] + l[6])) + ((l[1] + l[5]) + (l[3] + l[7]));
  }
};

struct ReferenceSums {
  LaneSum lost, gap, gap_gap, gap_x, gap_y, squares, ranks, rank_squares, x, y;
};

/// One cohort at the end of a piece: those that are not stronger than the deflection have snapped. True = it
/// was bent farther than before.
template <int axes>
bool bend(const CohortLaw& law, double least_mass, double* rows, std::uint32_t i, const CohortMove& a,
          double length, const double at[2], ReferenceSums& sums) {
  const std::uint32_t lane = i % cohort_lanes;
  const double x = cohort(rows, i, cohort_x);
  const double y = cohort(rows, i, cohort_y);
  const double zx = at[0] - x;
  const double zy = at[1] - y;
  const double square = axes == 2 ? zx * zx + zy * zy : zx * zx;
  const double bent = root(square);
  const double reach = cohort(rows, i, cohort_reach);
  const double mass = mass_of(rows, i);
  if (!(bent > reach)) {
    sums.x.lane[lane] += mass * x;
    sums.y.lane[lane] += mass * y;
    return false;
  }
  const double fresh = cohort(rows, i, cohort_fresh);
  const double left = cohort(rows, i, cohort_left);
  const double moment = cohort(rows, i, cohort_moment);
  const Survival now = survival_at(law, bent);
  double kept = least(whole_part(fresh * now.left), mass);
  if (kept < least_mass) kept = 0.0;
  const double lost = mass - kept;

  // They snapped at this length on average, with this much of the piece left.
  const double share = left - now.left;
  double snapped_at = share > 0.0 ? (now.moment - moment) / share : bent;
  snapped_at = least(most(snapped_at, reach), bent);
  const double along = axes == 2 ? zx * a.direction[0] + zy * a.direction[1] : zx * a.direction[0];
  const double across = most(square - along * along, 0.0);
  const double before = root(most(snapped_at * snapped_at - across, 0.0));
  const double gap = least(most(along - before, 0.0), length);

  const double lost_gap = lost * gap;
  const double low = cohort(rows, i, cohort_low);
  const double high = cohort(rows, i, cohort_high);
  sums.lost.lane[lane] += lost;
  sums.gap.lane[lane] += lost_gap;
  sums.gap_gap.lane[lane] += lost_gap * gap;
  sums.gap_x.lane[lane] += lost_gap * zx;
  sums.gap_y.lane[lane] += lost_gap * zy;
  sums.squares.lane[lane] += lost * square;
  sums.ranks.lane[lane] += lost * rank_mean(low, high);
  sums.rank_squares.lane[lane] += lost * rank_square(low, high);
  sums.x.lane[lane] += kept * x;
  sums.y.lane[lane] += kept * y;

  cohort(rows, i, cohort_reach) = bent;
  cohort(rows, i, cohort_fresh) = kept > 0.0 ? fresh : 0.0;
  cohort(rows, i, cohort_left) = now.left;
  cohort(rows, i, cohort_moment) = now.moment;
  return true;
}

/// Way to the nearest place at which a cohort is bent farther than ever, from `at`.
template <int axes>
double find_slack(const CohortState& s, const double* rows, const double at[2]) {
  double slack = unused_reach;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double zx = at[0] - cohort(rows, i, cohort_x);
    const double zy = at[1] - cohort(rows, i, cohort_y);
    const double bent = root(axes == 2 ? zx * zx + zy * zy : zx * zx);
    slack = least(slack, cohort(rows, i, cohort_reach) - bent);
  }
  return slack;
}

/// The cheapest partner of cohort i among those after it; of equal ones the first.
Partner find_partner(const double* rows, const double* masses, std::uint32_t count, std::uint32_t i) {
  Partner best{unlimited_cost, i, i};
  for (std::uint32_t j = i + 1; j < count; ++j) {
    const double dx = cohort(rows, j, cohort_x) - cohort(rows, i, cohort_x);
    const double dy = cohort(rows, j, cohort_y) - cohort(rows, i, cohort_y);
    const double dr = cohort(rows, j, cohort_reach) - cohort(rows, i, cohort_reach);
    const double reduced = masses[i] * masses[j] / (masses[i] + masses[j]);
    const double cost = reduced * ((dx * dx + dy * dy) + dr * dr);
    if (cost < best.cost) best = {cost, i, j};
  }
  return best;
}

/// One piece of the path, from `from` to `at`.
template <int axes>
bool bend_all(const CohortLaw& law, CohortState& s, double* rows, const CohortMove& a, double length,
              const double at[2], PieceSums& p) {
  ReferenceSums sums;
  bool bent = false;
  const double least_mass = s.mass * law.negligible;
  for (std::uint32_t i = 0; i < s.count; ++i)
    if (bend<axes>(law, least_mass, rows, i, a, length, at, sums)) bent = true;
  p = {sums.lost.total(),  sums.gap.total(),     sums.gap_gap.total(), sums.gap_x.total(),
       sums.gap_y.total(), sums.squares.total(), sums.ranks.total(),   sums.rank_squares.total(),
       sums.x.total(),     sums.y.total()};
  return bent;
}

struct Reference {
  template <int axes>
  static bool bend_all(const CohortLaw& law, CohortState& s, double* rows, const CohortMove& a, double length,
                       const double at[2], PieceSums& p) {
    return detail::bend_all<axes>(law, s, rows, a, length, at, p);
  }
  template <int axes>
  static double find_slack(const CohortState& s, const double* rows, const double at[2]) {
    return detail::find_slack<axes>(s, rows, at);
  }
  static Partner find_partner(const double* rows, const double* masses, std::uint32_t count,
                              std::uint32_t i) {
    return detail::find_partner(rows, masses, count, i);
  }
};

/// Mass above a rank, and how much of it a unit of rank holds there.
void mass_above(const CohortState& s, const double* rows, double cut, double* mass, double* density) {
  LaneSum masses, densities;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double low = cohort(rows, i, cohort_low);
    const double high = cohort(rows, i, cohort_high);
    const double m = mass_of(rows, i);
    const double per_rank = m / (high - low);  // never empty: ranks_of, cut_cohort
    const double above = least(most(high - cut, 0.0), high - low);
    masses.lane[i % cohort_lanes] += above * per_rank;
    densities.lane[i % cohort_lanes] += low < cut && cut <= high ? per_rank : 0.0;
  }
  *mass = masses.total();
  *density = densities.total();
}

}  // namespace

extern const CohortKernels cohort_kernels_scalar;
const CohortKernels cohort_kernels_scalar = {
    "scalar",
    {&move_cohorts<Reference, 1>, &move_cohorts<Reference, 2>},
    &make_room<Reference>,
    &mass_above,
    &enter,
    &renew,
};

}  // namespace bristle::detail
