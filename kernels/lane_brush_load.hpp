// How infinite brushes in lanes change with their load (lane_brush.hpp has the step). The rank of a bristle
// is the share of the load that came into contact before it. The bristles that came last, with the highest
// ranks, leave first.
#pragma once

#include <limits>

#include "lane_brush_list.hpp"

namespace bristle::detail {
namespace {

/// Largest distance, scaled, of bristles that come into contact from cohort 1, which they join, times the
/// part of a lower load that this may change.
constexpr double most_mixing = 0.004;

/// The cohorts of one vector of contacts, and changes of their loads.
template <class E, class T, int axes, bool books>
class BrushLoads : protected BrushList<E, T, axes, books> {
  using Base = BrushList<E, T, axes, books>;

 protected:
  using Base::ages, Base::cohort, Base::columns, Base::end, Base::get, Base::growth_of, Base::half,
      Base::has_ranks, Base::is_ranked, Base::law, Base::lost, Base::low_reach, Base::mean_square,
      Base::motion, Base::none, Base::one, Base::put, Base::spread, Base::tiny, Base::used, Base::zero;
  using Base::Base;
  using typename Base::Cohort;
  using typename Base::Columns;
  using typename Base::V;
  using typename Base::Vector;
  using typename Base::Which;

  /// Changes the loads to those of the step, with the patch at `end`. Returns twice the energy that is lost,
  /// for shares of the higher load.
  V change_load() {
    const Which rises = get(motion.rises) > none, falls = get(motion.falls) > none;
    const Which leaves = get(motion.leaves) > none, ranked = is_ranked();
    const V ratio = get(motion.load_ratio);
    V of_load = none;
    if (any_lane(falls | leaves)) of_load = shed(falls & ranked, falls | leaves, leaves, ratio);
    if (any_lane(rises)) {
      const V before = lost;
      admit(rises, ratio);
      of_load = of_load + (lost - before);
      lost = before;
    }
    const Which changed = rises | (falls & ranked);
    if (any_lane(changed)) {
      put(changed, columns.moment, find_moment());
      put(rises, *columns.slack, none - one);
    }
    if (any_lane(leaves)) empty(leaves);
    return of_load;
  }
  Vector find_moment() const {
    Vector sum = zero();
    for (std::uint32_t j = 0; j < used; ++j) {
      const Cohort c = cohort(j);
      sum = sum + c.share() * c.position;
    }
    return sum;
  }

  /// Removes the bristles that came into contact last where the load falls. While all have come together, in
  /// lanes without ranks, every cohort loses as much, so no share changes. `divides`: the lanes with ranks.
  V shed(Which divides, Which loses, Which leaves, V ratio) {
    V of_load = spread * select_lanes(leaves, one, one - ratio);
    spread = select_lanes(leaves, none, spread);
    Cut cut;
    const bool any_divides = any_lane(divides);
    if (any_divides) cut = find_cut(divides, ratio);
    const V scale = divide(one, most(cut.kept, tiny)), per_ratio = divide(one, most(ratio, tiny));
    for (std::uint32_t j = 0; j < used; ++j) {
      const Cohort c = cohort(j);
      V fresh = c.fresh;
      if (any_divides) {
        fresh = select_lanes(divides, c.fresh * part_below(j, cut.rank) * scale, fresh);
        put(divides, columns.fresh[j], fresh);
        // Ranks up to the present load remain. Where an interval ends above it, too few bristles of other
        // cohorts have low ranks, as intervals are only mean and variance of what they stand for. It moves
        // down.
        const V high = least(get(columns.high[j]), cut.rank), excess = most(high - ratio, none);
        put(divides, columns.low[j], most(get(columns.low[j]) - excess, none) * per_ratio);
        put(divides, columns.high[j], least((high - excess) * per_ratio, one));
      }
      const Vector z = end - c.position;
      const V stays = select_lanes(leaves, none, fresh * ratio);
      if constexpr (books) of_load = of_load + (c.fresh - stays) * c.left * dot(z, z);
    }
    return select_lanes(loses, of_load, none);
  }
  /// Returns the part of cohort j whose ranks are below `cut`.
  V part_below(std::uint32_t j, V cut) const {
    const V low = get(columns.low[j]), high = get(columns.high[j]);
    const V width = most(high - low, high * V(T(1e-6)) + tiny);
    return select_lanes(high <= cut, one, least(divide(most(cut - low, none), width), one));
  }
  /// A rank, and the share of the bristles that lies below it.
  struct Cut {
    V rank = V(T(1)), kept = V(T(1));
  };
  /// Finds the rank below which the share `wanted` of the bristles lies: the present load over the earlier
  /// one, but for a few roundings. Uses Newton's method on a sum that is linear between the ends of
  /// intervals, within a bracket. Under a load that ripples it takes one round or two.
  Cut find_cut(Which open, V wanted) const {
    constexpr T rounding = 16 * std::numeric_limits<T>::epsilon();
    wanted = most(wanted, V(T(1e-24)));
    Cut found;
    V low = none, high = one, rank = wanted;
    for (int round = 0; round < 24 && any_lane(open); ++round) {
      V kept = none, density = none;
      for (std::uint32_t j = 0; j < used; ++j) {
        const V share = cohort(j).share(), from = get(columns.low[j]), to = get(columns.high[j]);
        const V per_rank = divide(share, most(to - from, to * V(T(1e-6)) + tiny));
        kept = kept + select_lanes(to <= rank, share, least(per_rank * most(rank - from, none), share));
        density = density + select_lanes((from < rank) & (rank < to), per_rank, none);
      }
      const V lack = wanted - kept;
      // Takes the last rank that keeps enough bristles, or one that keeps what is wanted.
      const Which ends = magnitude(lack) <= V(rounding) * wanted, enough = open & (ends | (lack <= none));
      found.rank = select_lanes(enough, rank, found.rank);
      found.kept = select_lanes(enough, kept, found.kept);
      high = select_lanes(open & (lack <= none), rank, high);
      low = select_lanes(open & (lack > none), rank, low);
      open = open & !ends;
      const V next = rank + divide(lack, most(density, V(T(1e-6))));
      const Which within = (next > low) & (next < high);
      rank = select_lanes(open, select_lanes(within, next, half * (low + high)), rank);
    }
    return found;
  }

  /// Lets straight bristles into contact where the load rises. They get the highest ranks.
  void admit(Which rises, V ratio) {
    const Which begins = rises & (ratio == none), goes_on = rises & !begins;
    if (any_lane(goes_on)) {
      spread = select_lanes(goes_on, spread * ratio, spread);
      const Which ranked = is_ranked();
      for (std::uint32_t j = 0; j < used; ++j) {
        put(goes_on, columns.fresh[j], get(columns.fresh[j]) * ratio);
        put(goes_on, columns.low[j], select_lanes(ranked, get(columns.low[j]) * ratio, none));
        put(goes_on, columns.high[j], select_lanes(ranked, get(columns.high[j]) * ratio, ratio));
      }
      put(goes_on, *columns.ranked, one);
      has_ranks = true;
    }
    const Which far = mixes_ranks();
    put(rises & (far | !(get(columns.fresh[1]) > none)), columns.begin[1], end);
    this->join(rises, far, 1,
               {one - ratio, end, low_reach, half * (ratio + one), mean_square(ratio, one), none});
  }

  /// Returns the contacts whose entering bristles must not join cohort 1. Mixing bristles of different
  /// position and rank changes the force under a later, lower load: by their distance times the part of that
  /// load whose bristles are mixed, up to the lowest rank of the cohort. Bristles of noticeably different age
  /// are kept apart, too.
  Which mixes_ranks() const {
    const Vector moved = end - get(columns.begin[1]);
    const V distance = root(dot(moved, moved)), low = select_lanes(is_ranked(), get(columns.low[1]), none);
    const Which far = distance * (one - low) > V(T(most_mixing)) * low;
    const Which old = ages ? growth_of(1) - one > V(static_cast<T>(0.125 * law.piece)) : none > none;
    return (distance > V(static_cast<T>(law.piece))) | (far & (distance > none)) | old;
  }

  /// Removes all cohorts of the contacts `which`, which have lost contact.
  void empty(Which which) {
    for (std::uint32_t j = 0; j < law.cohorts; ++j) {
      const Columns numbers[] = {columns.x,    columns.y,   columns.reach, columns.fresh,
                                 columns.left, columns.low, columns.high};
      for (const Columns c : numbers)
        if (c != nullptr) put(which, c[j], none);
    }
    for (int open = 0; open < 2; ++open) {
      put(which, columns.begin[open], zero());
      put(which, columns.residue[open], zero());
    }
    put(which, columns.moment, zero());
    const Columns numbers[] = {columns.owed, columns.owed_path, columns.slack, columns.ranked, columns.pair};
    for (const Columns c : numbers) put(which, *c, none);
  }
};

}  // namespace
}  // namespace bristle::detail
