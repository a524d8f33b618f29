// The infinite brush, cohort by cohort: written to be read beside core/patches/COHORTS.md. The vector kernels
// (cohort_step.hpp) give the same bits, because all sums have 8 lanes and one order.
#include "cohort_parts.hpp"

namespace bristle::detail {
namespace {

/// Eight lanes of a sum over cohorts; cohort i adds to lane i mod 8.
struct LaneSum {
  double lane[cohort_lanes] = {};
  double total() const {
    const double* const l = lane;
    return ((l[0] + l[4]) + (l[2] + l[6])) + ((l[1] + l[5]) + (l[3] + l[7]));
  }
};

struct ReferenceSums {
  LaneSum lost, gap, gap_gap, gap_x, gap_y, squares, ranks, rank_squares, x, y, renewable;
  CohortBits emptied;

  /// Adds cohort i to the sums. The cohort is bent by z at the end of a piece; of its mass `kept` is left,
  /// and `left_behind` was lost at a path `g` before the end.
  void add(const double* rows, std::uint32_t i, double zx, double zy, double square, double kept,
           double left_behind, double g) {
    const std::uint32_t k = i % cohort_lanes;
    const double low = entry(rows, i, cohort_low);
    const double high = entry(rows, i, cohort_high);
    const double lost_gap = left_behind * g;
    lost.lane[k] += left_behind;
    gap.lane[k] += lost_gap;
    gap_gap.lane[k] += lost_gap * g;
    gap_x.lane[k] += lost_gap * zx;
    gap_y.lane[k] += lost_gap * zy;
    squares.lane[k] += left_behind * square;
    ranks.lane[k] += left_behind * rank_mean(low, high);
    rank_squares.lane[k] += left_behind * rank_square(low, high);
    x.lane[k] += kept * entry(rows, i, cohort_x);
    y.lane[k] += kept * entry(rows, i, cohort_y);
  }
  PieceSums totals() const {
    return {lost.total(),  gap.total(),     gap_gap.total(),   gap_x.total(),
            gap_y.total(), squares.total(), ranks.total(),     rank_squares.total(),
            x.total(),     y.total(),       renewable.total(), emptied};
  }
};

/// Returns the share of a piece along which a bristle is bent by more than the residual l_r, so that it can
/// be renewed. `along` is its deflection along the motion at the end.
double renewable_path(const CohortLaw& law, double along, double length) {
  return least(most(along - law.residual, 0.0), length) / length;
}

/// Snaps those bristles of one cohort whose length is below the deflection at the end of a piece. Returns
/// whether the cohort is bent further than ever before.
template <int axes, bool rubs, bool ages>
bool bend(const CohortLaw& law, double least_mass, double* rows, std::uint32_t i, const CohortMove& a,
          double length, const double at[2], const CohortTimes& times, ReferenceSums& sums) {
  const std::uint32_t lane = i % cohort_lanes;
  const double x = entry(rows, i, cohort_x);
  const double y = entry(rows, i, cohort_y);
  const double zx = at[0] - x;
  const double zy = at[1] - y;
  const double square = axes == 2 ? zx * zx + zy * zy : zx * zx;
  double bent = rubs ? most(root(square) - law.residual, 0.0) : root(square);
  const double reach = entry(rows, i, cohort_reach);
  Strength strength{};
  if (ages) {
    strength = strength_at(times, most(times.now - times.births[i], 0.0));
    bent = bent / strength.factor;
  }
  const double mass = mass_of(rows, i);
  const double along = axes == 2 ? zx * a.direction[0] + zy * a.direction[1] : zx * a.direction[0];
  const double renewable = rubs ? renewable_path(law, along, length) : 0.0;
  if (!(bent > reach)) {
    if (rubs) sums.renewable.lane[lane] += mass * renewable;
    sums.x.lane[lane] += mass * x;
    sums.y.lane[lane] += mass * y;
    return false;
  }
  const double fresh = entry(rows, i, cohort_fresh);
  const double left = entry(rows, i, cohort_left);
  const double moment = entry(rows, i, cohort_moment);
  const Survival now = survival_at(law, bent);
  double kept = least(whole_part(fresh * now.left), mass);
  if (kept < least_mass) kept = 0.0;
  const double lost = mass - kept;

  // Mean length at which the bristles snapped, from which the part of the piece left after their snaps
  // follows.
  const double share = left - now.left;
  double snapped_at = share > 0.0 ? (now.moment - moment) / share : bent;
  snapped_at = least(most(snapped_at, reach), bent);
  double gap = 0.0;
  if (ages) {
    gap = aged_gap(law, strength, snapped_at, times.per_length, square, along);
  } else {
    if (rubs) snapped_at = snapped_at + law.residual;
    const double across = most(square - along * along, 0.0);
    const double before = root(most(snapped_at * snapped_at - across, 0.0));
    gap = along - before;
  }
  gap = least(most(gap, 0.0), length);

  sums.add(rows, i, zx, zy, square, kept, lost, gap);
  if (rubs) sums.renewable.lane[lane] += kept * renewable;

  entry(rows, i, cohort_reach) = bent + reach_margin;
  if (kept == 0.0) sums.emptied.set(i);
  entry(rows, i, cohort_fresh) = kept > 0.0 ? fresh : 0.0;
  entry(rows, i, cohort_left) = now.left;
  entry(rows, i, cohort_moment) = now.moment;
  return true;
}

/// Renews one cohort at the end of a piece in which something snapped: the share 1 - exp(-hazard) of its
/// renewable bristles slips to l_r with new lengths, halfway along the path on which they can be renewed.
template <int axes>
void renew_share(const CohortLaw& law, double least_mass, double* rows, std::uint32_t i, const CohortMove& a,
                 double length, const double at[2], double hazard, ReferenceSums& sums) {
  const double zx = at[0] - entry(rows, i, cohort_x);
  const double zy = at[1] - entry(rows, i, cohort_y);
  const double square = axes == 2 ? zx * zx + zy * zy : zx * zx;
  const double along = axes == 2 ? zx * a.direction[0] + zy * a.direction[1] : zx * a.direction[0];
  const double path = renewable_path(law, along, length);
  const double mass = mass_of(rows, i);

  const double quarter = 0.25 * hazard * path;
  // Share left after a quarter of the hazard: exp(-quarter) to second order.
  const double root_left = 1.0 - quarter * (1.0 - 0.5 * quarter);
  const double twice = root_left * root_left;
  double fresh = entry(rows, i, cohort_fresh) * (twice * twice);
  const double left = entry(rows, i, cohort_left);
  double kept = least(whole_part(fresh * left), mass);
  if (path > 0.0 && kept < least_mass) kept = 0.0;
  if (!(kept > 0.0)) fresh = 0.0;
  if (kept == 0.0 && mass > 0.0) sums.emptied.set(i);
  const double lost = mass - kept;

  const double gap = 0.5 * path * length;
  sums.add(rows, i, zx, zy, square, kept, lost, gap);
  entry(rows, i, cohort_fresh) = fresh;
}

/// Returns the path from `at` within which no cohort is bent further than ever before.
template <int axes, bool ages>
double find_slack(const CohortLaw& law, const CohortState& s, const double* rows, const double at[2],
                  const CohortTimes& times) {
  double slack = unused_reach;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double zx = at[0] - entry(rows, i, cohort_x);
    const double zy = at[1] - entry(rows, i, cohort_y);
    const double bent = root(axes == 2 ? zx * zx + zy * zy : zx * zx);
    double reach = entry(rows, i, cohort_reach);
    if (ages) reach = reach * ageing_at(times, most(times.now - times.births[i], 0.0));
    slack = least(slack, reach + law.residual - bent);
  }
  return slack;
}

/// Finds the cohort after i that is cheapest to merge with i; of equally cheap ones the first.
template <bool ages>
Partner find_partner(const double* rows, const double* masses, const double* grown, std::uint32_t count,
                     std::uint32_t i) {
  Partner best{unlimited_cost, i, i};
  for (std::uint32_t j = i + 1; j < count; ++j) {
    const double dx = entry(rows, j, cohort_x) - entry(rows, i, cohort_x);
    const double dy = entry(rows, j, cohort_y) - entry(rows, i, cohort_y);
    const double dr = entry(rows, j, cohort_reach) - entry(rows, i, cohort_reach);
    const double reduced = masses[i] * masses[j] / (masses[i] + masses[j]);
    double apart = (dx * dx + dy * dy) + dr * dr;
    if (ages) apart = apart + square_of(grown[j] - grown[i]);
    const double cost = reduced * apart;
    if (cost < best.cost) best = {cost, i, j};
  }
  return best;
}

template <int axes, bool rubs, bool ages>
bool bend_cohorts(const CohortLaw& law, const CohortState& s, double* rows, const CohortMove& a,
                  double length, const double at[2], const CohortTimes& times, PieceSums& p) {
  ReferenceSums sums;
  bool bent = false;
  const double least_mass = s.mass * law.negligible;
  for (std::uint32_t i = 0; i < s.count; ++i)
    if (bend<axes, rubs, ages>(law, least_mass, rows, i, a, length, at, times, sums)) bent = true;
  p = sums.totals();
  return bent;
}
template <int axes>
PieceSums renew_cohorts(const CohortLaw& law, const CohortState& s, double* rows, const CohortMove& a,
                        double length, const double at[2], double hazard) {
  ReferenceSums sums;
  const double least_mass = s.mass * law.negligible;
  for (std::uint32_t i = 0; i < s.count; ++i)
    renew_share<axes>(law, least_mass, rows, i, a, length, at, hazard, sums);
  return sums.totals();
}

struct Reference {
  /// Advances all cohorts by one piece of the patch's path, which ends with the patch at `at`.
  template <int axes, bool rubs, bool ages>
  static bool bend_all(const CohortLaw& law, const CohortState& s, double* rows, const CohortMove& a,
                       double length, const double at[2], const CohortTimes& times, PieceSums& p) {
    return bend_cohorts<axes, rubs, ages>(law, s, rows, a, length, at, times, p);
  }
  template <int axes>
  static PieceSums renew_all(const CohortLaw& law, const CohortState& s, double* rows, const CohortMove& a,
                             double length, const double at[2], double hazard) {
    return renew_cohorts<axes>(law, s, rows, a, length, at, hazard);
  }
  template <int axes, bool ages>
  static double find_slack(const CohortLaw& law, const CohortState& s, const double* rows, const double at[2],
                           const CohortTimes& times) {
    return detail::find_slack<axes, ages>(law, s, rows, at, times);
  }
  template <bool ages>
  static Partner find_partner(const double* rows, const double* masses, const double* grown,
                              std::uint32_t count, std::uint32_t i, double) {
    return detail::find_partner<ages>(rows, masses, grown, count, i);
  }
};

/// Returns the mass whose rank (order of coming into contact) is above `cut`, and the mass per rank there.
void mass_above(const CohortState& s, const double* rows, double cut, double* mass, double* density) {
  LaneSum masses, densities;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double low = entry(rows, i, cohort_low);
    const double high = entry(rows, i, cohort_high);
    const double m = mass_of(rows, i);
    const double per_rank = m / (high - low);  // the interval is never empty: see ranks_of(), cut_cohort()
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
    {&move_cohorts<Reference, 1, false, false>, &move_cohorts<Reference, 2, false, false>,
     &move_cohorts<Reference, 1, true, false>, &move_cohorts<Reference, 2, true, false>,
     &move_cohorts<Reference, 1, true, true>, &move_cohorts<Reference, 2, true, true>},
    &find_slack_at<Reference>,
    {&make_room<Reference, false>, &make_room<Reference, true>},
    &mass_above,
    {&enter<false>, &enter<true>},
    &renew,
};

}  // namespace bristle::detail
