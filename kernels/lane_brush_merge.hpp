// Merges cohorts of infinite brushes in lanes where all are in use (lane_brush.hpp has the step).
#pragma once

#include "lane_brush_cohorts.hpp"

namespace bristle::detail {
namespace {

/// Largest distance, in order of birth, of two cohorts that merge.
constexpr std::uint32_t farthest_merged = 2;

/// The cohorts of one vector of contacts, and their merges.
template <class E, class T, int axes, bool books>
class BrushMerges : protected BrushCohorts<E, T, axes, books> {
  using Base = BrushCohorts<E, T, axes, books>;

 protected:
  using Base::age, Base::age_of_growth, Base::ages, Base::cohort, Base::columns, Base::end, Base::first,
      Base::get, Base::growth_at, Base::half, Base::has_ranks, Base::is_ranked, Base::law, Base::lost,
      Base::none, Base::one, Base::reach_to_left, Base::square, Base::time;
  using Base::Base;
  using typename Base::Cohort;
  using typename Base::Columns;
  using typename Base::V;
  using typename Base::Vector;
  using typename Base::Which;

  /// Merges the cheapest pair of closed cohorts in the lanes `full`, and returns the index that becomes free.
  /// Searches pairs that are near in the order of birth, and all pairs with the oldest cohort: on a path that
  /// returns, cohorts of different rounds lie at the same positions.
  V make_room(Which full, V gap) {
    V cheapest(T(1e38)), partner = none;
    const auto compare = [&](std::uint32_t i, std::uint32_t j) {
      const V cost = cost_of_merge(i, j);
      const Which better = cost < cheapest;
      cheapest = select_lanes(better, cost, cheapest);
      gap = select_lanes(full & better, V(static_cast<T>(j)), gap);
      partner = select_lanes(better, V(static_cast<T>(i)), partner);
    };
    const std::uint32_t oldest_one = law.cohorts - 1;
    for (std::uint32_t j = 3; j <= oldest_one; ++j)
      for (std::uint32_t i = j - 1; i >= 2 && j - i <= farthest_merged; --i) compare(i, j);
    for (std::uint32_t i = 2; i + farthest_merged < oldest_one; ++i) compare(i, oldest_one);
    alignas(64) T gaps[E::size], partners[E::size], energy[E::size] = {}, at[axes][E::size];
    E::put(gaps, gap);
    E::put(partners, partner);
    for (int axis = 0; axis < axes; ++axis) E::put(at[axis], end.of[axis]);
    for (std::uint32_t left = bits_of_mask<T>(full); left != 0; left &= left - 1) {
      const auto k = static_cast<std::uint32_t>(__builtin_ctz(left));
      energy[k] = merge(k, static_cast<std::uint32_t>(partners[k]), static_cast<std::uint32_t>(gaps[k]), at);
    }
    if constexpr (books) lost = lost + E::get(energy);
    return gap;
  }

  /// Returns the cost of merging cohorts i and j. Cohorts near in position, reach and rank cost little, and
  /// so do those that weigh little. Ranks matter when the load falls: a cohort weighs the share that it would
  /// have if the load fell to its mean rank, and the distance of two mean ranks is relative to the lower one.
  /// The smaller weight stands for w1 w2 / (w1 + w2), which needs a division and is between half of it and
  /// all of it.
  V cost_of_merge(std::uint32_t i, std::uint32_t j) const {
    const Cohort c = cohort(i), other = cohort(j);
    const Vector apart = other.position - c.position;
    V distance = dot(apart, apart) + square(other.reach - c.reach);
    V weight = c.share(), other_weight = other.share();
    if (has_ranks) {
      const V rank = middle_rank(i), other_rank = middle_rank(j);
      const V per_rank = divide(one, rank), other_per_rank = divide(one, other_rank);
      weight = weight * per_rank;
      other_weight = other_weight * other_per_rank;
      distance = distance + square((rank - other_rank) * most(per_rank, other_per_rank));
    }
    return least(distance * least(weight, other_weight),
                 V(T(1e37)));  // so that there always is a cheapest pair
  }

  /// Returns the mean rank of cohort j, not 0.
  V middle_rank(std::uint32_t j) const {
    const V middle = half * (get(columns.low[j]) + get(columns.high[j]));
    return select_lanes(is_ranked(), most(middle, V(T(1e-12))), half);
  }

  /// Merges cohort j into cohort i in the lane first + k. Conserves share, force, mean reach, mean growth,
  /// and mean and variance of rank. `patch`: its position. Returns twice the energy lost.
  T merge(std::uint32_t k, std::uint32_t i, std::uint32_t j, const T (&patch)[axes][E::size]) {
    const std::uint32_t lane = first + k;
    const auto at = [lane](Columns c, std::uint32_t index) -> T& { return c[index].lane[lane]; };
    const T share = at(columns.fresh, i) * at(columns.left, i),
            other = at(columns.fresh, j) * at(columns.left, j);
    const T fraction = other / (share + other);
    T apart2 = T(0), bent2 = T(0);
    for (int axis = 0; axis < axes; ++axis) {
      const Columns x = axis == 0 ? columns.x : columns.y;
      const T apart = at(x, j) - at(x, i);
      at(x, i) += fraction * apart;
      const T z = patch[axis][k] - at(x, i);
      apart2 += apart * apart;
      bent2 += z * z;
    }
    T grown = T(1);
    if (ages) {
      const T growth_i = growth_at(age(i, k)), growth_j = growth_at(age(j, k));
      grown = growth_i + fraction * (growth_j - growth_i);
      columns.birth[i].lane[lane] = time[k] - age_of_growth(static_cast<double>(grown)) / law.ageing_rate;
    }
    T& reach = at(columns.reach, i);
    const T bent = (root(bent2) - static_cast<T>(law.residual)) / grown;
    reach = most(most(reach + fraction * (at(columns.reach, j) - reach), bent), law.survival->low);
    const T left = reach_to_left(reach);
    at(columns.left, i) = left;
    at(columns.fresh, i) = (share + other) / left;
    if (columns.ranked->lane[lane] > T(0))
      merge_ranks(at(columns.low, i), at(columns.high, i), at(columns.low, j), at(columns.high, j), fraction);
    return share * fraction * apart2;
  }
  /// Changes the interval [low, high] of ranks to one that has mean and variance of a mixture, of which the
  /// part `fraction` has ranks in the other interval.
  static void merge_ranks(T& low, T& high, T other_low, T other_high, T fraction) {
    const T middle = T(0.5) * (low + high), width = high - low, other_width = other_high - other_low;
    const T apart = T(0.5) * (other_low + other_high) - middle;
    const T variance = (width * width + fraction * (other_width * other_width - width * width)) / T(12) +
                       fraction * (T(1) - fraction) * apart * apart;
    const T mean = middle + fraction * apart, reaches = root(T(3) * most(variance, T(0)));
    low = most(mean - reaches, T(0));
    high = least(mean + reaches, T(1));
  }
};

}  // namespace
}  // namespace bristle::detail
