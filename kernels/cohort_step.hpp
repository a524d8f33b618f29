// A step of the infinite brush: moves the patch straight on, piece by piece, and merges cohorts where their
// list is full.
#pragma once

#include "cohort_pass.hpp"

namespace bristle::detail {
namespace {

/// Makes room in the list of cohorts by merging the cheapest pair. Merges other pairs that cost little more
/// as well, because the search takes most of the time.
template <bool ages>
double make_room(const CohortLaw& law, CohortState& s, double* rows, const double at[2],
                 const CohortTimes& times) {
  alignas(64) double masses[most_cohorts];
  Partner partners[most_cohorts];
  const std::uint32_t padded = (s.count + cohort_lanes - 1) / cohort_lanes * cohort_lanes;
  for (std::uint32_t i = 0; i < padded; ++i) masses[i] = mass_of(rows, i);
  // Twice the mean snap length times the growth factor g of each cohort. It enters the cost of a merge, so
  // that cohorts of different age rarely merge. Without the factor 2 the error is a fifth larger.
  alignas(64) double grown[most_cohorts];
  if (ages)
    for (std::uint32_t i = 0; i < padded; ++i)
      grown[i] = 2.0 * law.mean * ageing_at(times, most(times.now - times.births[i], 0.0));
  double limit = unlimited_cost;  // cost above which no pair is merged

  // Begins the search with the newest cohorts, which are close to each other. They give a low limit, with
  // which the search skips most others.
  for (std::uint32_t i = s.count - 1; i-- > 0;) {
    partners[i] = find_partner<ages>(rows, masses, grown, s.count, i, limit);
    limit = least(limit, merge_margin * partners[i].cost);
  }

  bool used[most_cohorts] = {};
  double lost = 0.0;
  CohortBits emptied;
  std::uint32_t left = s.count / merged_at_once;
  const std::uint32_t near = sort_cheapest(partners, s.count - 1);
  for (std::uint32_t k = 0; k < near && left > 0; ++k) {
    const Partner& pair = partners[k];
    const std::uint32_t i = pair.i;
    if (used[i] || used[pair.j]) continue;
    used[i] = used[pair.j] = true;
    lost += merge<ages>(law, s, rows, i, pair.j, at, times);
    for (std::uint32_t o = 0; o < 3; ++o)
      if (s.open[o] == i || s.open[o] == pair.j) {
        s.open[o] = no_cohort;
        if (o == 1) continue;
        lost += s.spread;
        s.spread = 0.0;
      }
    entry(rows, pair.j, cohort_fresh) = 0.0;
    emptied.set(pair.j);
    --left;
  }
  remove_empty<ages>(s, rows, times.births, emptied);
  return lost;
}

/// Advances a patch of cohorts along a straight move, piece by piece.
template <int axes, bool rubs, bool ages>
void move_cohorts(const CohortLaw& law, CohortState& s, double* rows, const CohortMove& a, CohortTotals& t) {
  // Checks for snaps at the end of the move alone. Deflections are convex along a line, so a cohort within
  // its reach at the end (and at the start) does not exceed it on the way.
  const double middle[2] = {0.5 * (a.from[0] + a.to[0]), 0.5 * (a.from[1] + a.to[1])};
  // Checks ageing cohorts at the end alone, too. Their deflection over the growth factor g is quasi-convex,
  // and falls as g grows, so waiting carries no cohort past its reach.
  CohortTimes times{};
  if (ages) {
    times = a.times;
    times.now = a.times.now + a.length * times.per_length;
  }
  if (a.length > 1.2 * law.piece && find_slack<axes, ages>(law, s, rows, a.to, times) >= 0.0) {
    s.slack = find_slack<axes, ages>(law, s, rows, middle, times);
    return;
  }
  double from[2] = {a.from[0], a.from[1]};
  double done = 0.0;
  for (bool last = false; !last;) {
    const double length = next_piece(law, done, a.length);
    last = length == a.length - done;
    done += length;
    double at[2] = {a.to[0], a.to[1]};
    if (!last)
      for (int axis = 0; axis < axes; ++axis) at[axis] = a.from[axis] + a.direction[axis] * done;
    if (ages) times.now = a.times.now + done * times.per_length;
    PieceSums sums{};
    const bool bent = bend_cohorts<axes, rubs, ages>(law, s, rows, a, length, at, times, sums);
    if (!bent && t.pieces == 0 && last) {  // the move was one piece in which nothing snapped
      s.slack = find_slack<axes, ages>(law, s, rows, middle, times);
      return;
    }
    s.slack = -1.0;
    ++t.pieces;
    for (int axis = 0; axis < axes; ++axis)
      t.integral[axis] += length * (s.mass * ((from[axis] + at[axis]) * 0.5) - s.moment[axis]);
    if (sums.lost > 0.0) {
      double snapped = sums.lost;
      double renewed_rate = 0.0;
      if (rubs && law.renewal > 0.0) {
        const Draws draws = find_draws<ages>(law, s, sums, times);
        snapped = draws.snapped;
        renewed_rate = draws.hazard / length;
        add_renewed(sums, renew_cohorts<axes>(law, s, rows, a, length, at, draws.hazard));
      }
      double spread = 0.0;
      const Newborn newborn =
          bear<rubs, ages>(law, sums, a, length, at, snapped, renewed_rate, times, t, spread);
      s.moment[0] = sums.x + newborn.mass * newborn.x;
      s.moment[1] = sums.y + newborn.mass * newborn.y;
      sums.emptied.forget_lanes_from(s.count);
      for (std::uint32_t& open : s.open)
        if (open != no_cohort && sums.emptied.has(open)) open = no_cohort;
      // Places of the patch at which the piece's first and last newborn bristles would be straight.
      double first[2] = {from[0], from[1]};
      double last_born[2] = {at[0], at[1]};
      if (rubs)
        for (int axis = 0; axis < 2; ++axis) {
          first[axis] -= law.residual * a.direction[axis];
          last_born[axis] -= law.residual * a.direction[axis];
        }
      const double bx = last_born[0] - s.begin[0][0];
      const double by = last_born[1] - s.begin[0][1];
      if (s.open[0] != no_cohort && bx * bx + by * by <= law.piece * law.piece) {
        s.spread += join<ages>(law, s, rows, s.open[0], newborn, at, times, true);
      } else {
        t.lost += close_open<ages>(law, s, rows, at, times);
        // Puts the newborn cohort into the lane of a cohort that lost all its mass. In a slide the oldest
        // cohort ends as a newborn begins, so usually no cohort has to be moved.
        std::uint32_t free = sums.emptied.take_last(s.count);
        if (free == no_cohort && s.count == s.capacity) {
          t.lost += make_room<ages>(law, s, rows, at, times);
          ++t.merges;
        }
        if (free == no_cohort) free = s.count++;
        s.open[0] = free;
        for (int axis = 0; axis < 2; ++axis) s.begin[0][axis] = first[axis];
        append<ages>(law, s, rows, free, newborn, times);
      }
      remove_empty<ages>(s, rows, times.births, sums.emptied);
      s.spread += spread;
    }
    from[0] = at[0];
    from[1] = at[1];
  }
}

inline double find_slack_at(const CohortLaw& law, const CohortState& s, const double* rows,
                            const double at[2]) {
  return find_slack<2, false>(law, s, rows, at, CohortTimes{});
}

}  // namespace
}  // namespace bristle::detail
