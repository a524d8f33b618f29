// The list of the cohorts of infinite brushes in lanes (lane_brush.hpp has the step): how bristles join an
// open cohort, how a cohort is closed, and how two merge where all are in use.
//
// Cohort 0 is open for bristles that snap, cohort 1 for those that come into contact. Both take bristles as
// long as these become straight within a piece of path from the first of them. A cohort that closes goes to
// index 2, and newer ones move up by one, so the list from 2 on is in the order of birth.
#pragma once

#include "lane_brush_cohorts.hpp"

namespace bristle::detail {
namespace {

/// Largest distance, in order of birth, of two cohorts that merge.
constexpr std::uint32_t farthest_merged = 2;

/// The list of the cohorts of one vector of contacts.
template <class E, class T, int axes, bool books>
class BrushList : protected BrushCohorts<E, T, axes, books> {
  using Base = BrushCohorts<E, T, axes, books>;

 protected:
  using Base::age, Base::age_of_growth, Base::ages, Base::cohort, Base::columns, Base::end, Base::first,
      Base::get, Base::growth_at, Base::growth_of, Base::half, Base::has_ranks, Base::is_ranked, Base::law,
      Base::lost, Base::low_reach, Base::mean_square, Base::motion, Base::none, Base::one, Base::put,
      Base::reach_to_left, Base::residual, Base::spread, Base::square, Base::time, Base::tiny, Base::used,
      Base::zero;
  using Base::Base;
  using typename Base::Cohort;
  using typename Base::Columns;
  using typename Base::V;
  using typename Base::Vector;
  using typename Base::Which;

  /// Bristles that join an open cohort: their share of the load, mean position, reach, mean and mean square
  /// of their ranks, and the path since they were straight, from which their age follows.
  struct Newborn {
    V share;
    Vector position;
    V reach, rank, rank_square, ago;
  };

  /// Adds newborn bristles to the open cohort `open`. First closes the cohort in the lanes `closes`.
  void join(Which which, Which closes, std::uint32_t open, const Newborn& n) {
    closes = which & closes & (get(columns.fresh[open]) > none);
    if (any_lane(closes)) close(closes, open);
    const Cohort c = cohort(open);
    const V before = c.share(), all = before + n.share;
    which = which & (all > none);
    const Which filled = before > none;
    const V fraction = divide(n.share, most(all, tiny));
    // Moves the mean position. What rounding takes from a move is kept for the next one: in slow sliding
    // moves are so small that the position would never change.
    const Vector apart = n.position - c.position;
    const Vector moves = fraction * apart + get(columns.residue[open]);
    Cohort sum;
    sum.position = select_lanes(filled, c.position + moves, n.position);
    put(which, columns.residue[open], select_lanes(filled, moves - (sum.position - c.position), zero()));
    V& lacks = open == 0 ? spread : lost;
    lacks = lacks + select_lanes(filled & which, before * fraction * dot(apart, apart), none);
    if (ages) join_births(which, open, fraction, before, n.ago);
    // Takes the mean reach, but at least the present deflection: no bristle is left that has a shorter
    // length.
    const Vector z = end - sum.position;
    V bent = root(dot(z, z)) - residual;
    if (ages) bent = divide(bent, growth_of(open));
    sum.reach = select_lanes(filled, c.reach + fraction * (n.reach - c.reach), n.reach);
    sum.reach = most(most(sum.reach, bent), low_reach);
    sum.left = reach_to_left(sum.reach);
    sum.fresh = divide(all, sum.left);
    put(which, open, sum);
    if (has_ranks) join_ranks(which, filled, open, fraction, n);
  }
  void join_births(Which which, std::uint32_t open, V fraction, V before, V ago) {
    alignas(64) T fractions[E::size], path[E::size], shares[E::size], slowness[E::size];
    E::put(fractions, fraction);
    E::put(path, ago);
    E::put(shares, before);
    E::put(slowness, get(motion.per_length));
    for (std::uint32_t left = bits_of_mask<T>(which); left != 0; left &= left - 1) {
      const auto k = static_cast<std::uint32_t>(__builtin_ctz(left));
      const double born =
          time[k] - static_cast<double>(path[k]) * static_cast<double>(slowness[k]) / law.ageing_rate;
      double& birth = columns.birth[open].lane[first + k];
      birth = shares[k] > T(0) ? birth + static_cast<double>(fractions[k]) * (born - birth) : born;
    }
  }
  /// Gives the open cohort the interval of ranks that has the mean and the variance of all its bristles.
  void join_ranks(Which which, Which filled, std::uint32_t open, V fraction, const Newborn& n) {
    const V low = get(columns.low[open]), high = get(columns.high[open]);
    const V middle = half * (low + high), squares = mean_square(low, high);
    const V mean = select_lanes(filled, middle + fraction * (n.rank - middle), n.rank);
    const V mean_squares =
        select_lanes(filled, squares + fraction * (n.rank_square - squares), n.rank_square);
    const V reaches = root(most(V(T(3)) * (mean_squares - mean * mean), none));
    which = which & is_ranked();
    put(which, columns.low[open], most(mean - reaches, none));
    put(which, columns.high[open], least(mean + reaches, one));
  }

  /// Closes an open cohort: moves it to index 2, and the newer cohorts up by one, to the first empty
  /// position. If there is none, the two cohorts merge whose merge costs least.
  void close(Which which, std::uint32_t open) {
    const Which pairs = which & (get(*columns.pair) > none);
    if (open == 0 && any_lane(pairs)) move_apart(pairs);
    if (open != 0) {  // Another cohort comes between the two of a pair.
      lost = lost + select_lanes(which, spread, none);
      spread = select_lanes(which, none, spread);
    }
    put(which, *columns.pair, select_lanes(pairs, none, open == 0 ? one : none));
    V gap = V(static_cast<T>(used < law.cohorts ? used : 0));
    for (std::uint32_t j = used; j-- > 2;)
      gap = select_lanes(get(columns.fresh[j]) == none, V(static_cast<T>(j)), gap);
    const Which full = which & (gap == none);
    if (any_lane(full)) gap = make_room(full, gap);
    alignas(64) T gaps[E::size];
    E::put(gaps, select_lanes(which, gap, none));
    std::uint32_t last = 2;
    for (const T x : gaps) last = static_cast<std::uint32_t>(x) > last ? static_cast<std::uint32_t>(x) : last;
    if (used < last + 1) used = last + 1;
    move_up(which, gap, last);
    put(which, 2, cohort(open));
    if (has_ranks || ages) move_others(which, open, 2);
    put(which, columns.fresh[open], none);
  }
  /// Moves the cohorts from 2 on up by one, each contact's to its index `gap`, at most `last`.
  void move_up(Which which, V gap, std::uint32_t last) {
    Cohort above = cohort(last);
    for (std::uint32_t j = last; j > 2; --j) {
      const Which moves = which & (V(static_cast<T>(j)) <= gap);
      const Cohort below = cohort(j - 1);
      put(columns.x[j], select_lanes(moves, below.position.of[0], above.position.of[0]));
      if constexpr (axes == 2)
        put(columns.y[j], select_lanes(moves, below.position.of[1], above.position.of[1]));
      put(columns.reach[j], select_lanes(moves, below.reach, above.reach));
      put(columns.fresh[j], select_lanes(moves, below.fresh, above.fresh));
      put(columns.left[j], select_lanes(moves, below.left, above.left));
      if (has_ranks || ages) move_others(moves, j - 1, j);
      above = below;
    }
  }
  /// Moves cohort 2 and cohort 0, which closes, apart until their two positions have the variance of their
  /// bristles' positions: on a straight path, to Gauss points. One position for all bristles of a piece would
  /// raise the force. Conserves share and force.
  void move_apart(Which which) {
    const Cohort older = cohort(2), newer = cohort(0);
    const V share = older.share(), other = newer.share(), fraction = divide(other, most(share + other, tiny));
    const Vector apart = newer.position - older.position;
    const V square_apart = dot(apart, apart), reduced = share * fraction;
    const V wanted = one + divide(most(spread, none), most(reduced * square_apart, tiny));
    const V factor = least(wanted, V(static_cast<T>(law.most_apart)));
    const Which moves = which & (square_apart > none) & (reduced > none);
    const V farther = select_lanes(moves, root(factor) - one, none);
    move_position(moves, 2, older, (none - farther * fraction) * apart);
    move_position(moves, 0, newer, (farther * (one - fraction)) * apart);
    const V stored = select_lanes(moves, reduced * square_apart * (factor - one), none);
    lost = lost + select_lanes(which, spread - stored, none);
    spread = select_lanes(which, none, spread);
  }
  /// Moves the position of cohort j. Its bristles then are bent more or less, and so is its reach.
  void move_position(Which which, std::uint32_t j, Cohort c, const Vector& by) {
    const V share = c.share(), growth = ages ? growth_of(j) : one;
    const Vector before = end - c.position;
    c.position = c.position + by;
    const Vector after = end - c.position;
    const V bent = root(dot(after, after));
    const V reach = c.reach + divide(bent - root(dot(before, before)), growth);
    c.reach = most(most(reach, divide(bent - residual, growth)), low_reach);
    c.left = reach_to_left(c.reach);
    c.fresh = divide(share, c.left);
    put(which, j, c);
  }
  /// Moves ranks and birth of a cohort.
  void move_others(Which which, std::uint32_t from, std::uint32_t to) {
    if (has_ranks) {
      put(which, columns.low[to], get(columns.low[from]));
      put(which, columns.high[to], get(columns.high[from]));
    }
    if (!ages) return;
    for (std::uint32_t left = bits_of_mask<T>(which); left != 0; left &= left - 1) {
      const auto lane = first + static_cast<std::uint32_t>(__builtin_ctz(left));
      columns.birth[to].lane[lane] = columns.birth[from].lane[lane];
    }
  }

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
