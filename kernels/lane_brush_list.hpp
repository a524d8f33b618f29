// The cohorts of infinite brushes in lanes as a list (lane_brush.hpp has the step): how bristles join an open
// cohort, how a cohort is closed, and which two cohorts merge to make room.
//
// Cohort 0 is open for bristles that snap, cohort 1 for those that come into contact. Both take bristles as
// long as these become straight within a piece of path from the first of them. A cohort that closes goes to
// index 2, and newer ones move up by one, so the list from 2 on is in the order of birth.
#pragma once

#include "lane_brush_motion.hpp"

namespace bristle::detail {
namespace {

/// How many cohorts apart, in order of birth, two cohorts may be that merge.
constexpr std::uint32_t farthest_merged = 2;
/// Weight of the difference of reaches in the cost of a merge, relative to that of places. Merging cohorts of
/// different reach changes how soon bristles snap; merging places changes the force at once.
constexpr double reach_weight = 1.0;
/// Largest factor by which the squared distance of two cohorts grows when they are moved apart.
constexpr double most_apart = 1.6;
constexpr double least_left =
    1e-7;  ///< smallest S(R) of a cohort that takes bristles, so that u = m / S exists

/// Access to the cohorts of one vector of contacts, from the lane `first` on.
template <class E, class T, int axes, bool books>
class BrushCohorts {
 protected:
  using V = typename E::V;
  using Which = decltype(V() < V());
  using Vector = Plane<V, axes>;
  using Columns = LaneColumn<T>*;

  /// A cohort: see BrushColumns.
  struct Cohort {
    Vector place;
    V reach, fresh, left;

    V mass() const { return fresh * left; }
  };
  /// Bristles that join an open cohort: their share of the load, mean place, reach, mean and mean square of
  /// their ranks, and the path since they were straight, from which their age follows.
  struct Newborn {
    V mass;
    Vector place;
    V reach, rank, rank_square, ago;
  };

  BrushCohorts(const BrushLaw<T>& the_law, const BrushColumns<T>& the_columns, const LaneInput& the_input,
               const BrushMotion<T, axes>& the_motion, std::uint32_t the_first)
      : law(the_law), columns(the_columns), input(the_input), motion(the_motion), first(the_first) {
    for (double& t : time) t = 0.0;
    if (!ages) return;
    for (std::uint32_t k = 0; k < E::size; ++k) time[k] = input.start[first + k];
  }

  const BrushLaw<T>& law;
  const BrushColumns<T>& columns;
  const LaneInput& input;
  const BrushMotion<T, axes>& motion;
  const std::uint32_t first;
  std::uint32_t used = *columns.used < 2 ? 2 : *columns.used;  ///< cohorts from there on are empty
  const bool ages = law.ageing_strength != 0.0;
  const V none = V(T(0)), one = V(T(1)), half = V(T(0.5)), tiny = V(T(1e-30));
  const V residual = V(static_cast<T>(law.residual)), low_reach = V(law.survival->low);
  double time[E::size];  ///< time of each contact at the end of the present piece, s
  bool has_ranks = any_lane(get(*columns.ranked) > none);  ///< whether any of the contacts has them
  Vector end;     ///< place of the patch at the end of the present piece
  V lost = none;  ///< twice the energy that is lost, by the square of the deflection
  V spread = get(*columns.spread);

  [[gnu::always_inline]] V get(const Lane16<T>& from) const { return E::get(from.lane + first); }
  [[gnu::always_inline]] V get(const LaneColumn<T>& from) const { return E::get(from.lane + first); }
  [[gnu::always_inline]] void put(LaneColumn<T>& to, V x) const { E::put(to.lane + first, x); }
  [[gnu::always_inline]] void put(Which which, LaneColumn<T>& to, V x) const {
    put(to, select_lanes(which, x, get(to)));
  }
  [[gnu::always_inline]] Vector get(const Lane16<T> (&from)[axes]) const {
    Vector out;
    for (int axis = 0; axis < axes; ++axis) out.of[axis] = get(from[axis]);
    return out;
  }
  [[gnu::always_inline]] Vector get(LaneColumn<T>* const (&from)[2]) const {
    Vector out;
    for (int axis = 0; axis < axes; ++axis) out.of[axis] = get(*from[axis]);
    return out;
  }
  [[gnu::always_inline]] void put(Which which, LaneColumn<T>* const (&to)[2], const Vector& x) const {
    for (int axis = 0; axis < axes; ++axis) put(which, *to[axis], x.of[axis]);
  }
  [[gnu::always_inline]] Vector place(std::uint32_t j) const {
    Vector out;
    out.of[0] = get(columns.x[j]);
    if constexpr (axes == 2) out.of[1] = get(columns.y[j]);
    return out;
  }
  [[gnu::always_inline]] Cohort cohort(std::uint32_t j) const {
    return {place(j), get(columns.reach[j]), get(columns.fresh[j]), get(columns.left[j])};
  }
  [[gnu::always_inline]] void put(Which which, std::uint32_t j, const Cohort& c) const {
    put(which, columns.x[j], c.place.of[0]);
    if constexpr (axes == 2) put(which, columns.y[j], c.place.of[1]);
    put(which, columns.reach[j], c.reach);
    put(which, columns.fresh[j], c.fresh);
    put(which, columns.left[j], c.left);
  }
  static V square(V a) { return a * a; }
  /// Returns the contacts whose bristles have ranks, because their load has risen.
  Which is_ranked() const { return get(*columns.ranked) > none; }
  Vector zero() const {
    Vector out;
    for (V& x : out.of) x = none;
    return out;
  }
  V reach_to_left(V reach) const { return most(survival(*law.survival, reach), V(T(least_left))); }
  static V mean_square(V low, V high) { return (low * low + low * high + high * high) * V(T(1.0 / 3)); }

  // ------------------------------------------------------------------------------------------------ ageing

  template <class N>
  N growth_at(N age) const {
    return growth<T>(AgeingLaw<T>{static_cast<T>(law.ageing_strength), T(0), law.ageing_form == 1}, age);
  }
  T age(std::uint32_t j, std::uint32_t k) const {
    const double since = (time[k] - columns.birth[j].lane[first + k]) * law.ageing_rate;
    return static_cast<T>(least(most(since, 0.0), oldest));
  }
  /// Returns the ages of cohort j's bristles, in ageing times.
  V age_of(std::uint32_t j) const {
    alignas(64) T ages_of[E::size];
    for (std::uint32_t k = 0; k < E::size; ++k) ages_of[k] = age(j, k);
    return E::get(ages_of);
  }
  /// Returns the factor by which ageing has lengthened the snap lengths of cohort j.
  V growth_of(std::uint32_t j) const { return growth_at(age_of(j)); }
  /// Returns the age, in ageing times, at which the growth factor is `factor`.
  double age_of_growth(double factor) const {
    const double grown = most(factor - 1.0, 0.0) / law.ageing_strength;
    if (law.ageing_form == 1) return -natural_log<double>(most(1.0 - grown, 1e-17));
    return exponential<double>(least(grown, 75.0)) - 1.0;
  }

  // ----------------------------------------------------------------------------------------- join and close

  /// Adds newborn bristles to the open cohort `open`. First closes the cohort in the lanes `closes`.
  void join(Which which, Which closes, std::uint32_t open, const Newborn& n) {
    closes = which & closes & (get(columns.fresh[open]) > none);
    if (any_lane(closes)) close(closes, open);
    const Cohort c = cohort(open);
    const V before = c.mass(), all = before + n.mass;
    which = which & (all > none);
    const Which holds = before > none;
    const V share = divide(n.mass, most(all, tiny));
    // Moves the mean place. What rounding takes from a move is kept for the next one: in slow sliding moves
    // are so small that the place would never change.
    const Vector apart = n.place - c.place;
    const Vector moves = share * apart + get(columns.residue[open]);
    Cohort sum;
    sum.place = select_lanes(holds, c.place + moves, n.place);
    put(which, columns.residue[open], select_lanes(holds, moves - (sum.place - c.place), zero()));
    V& lacks = open == 0 ? spread : lost;
    lacks = lacks + select_lanes(holds & which, before * share * dot(apart, apart), none);
    if (ages) join_births(which, open, share, before, n.ago);
    // Takes the mean reach, but at least the present deflection: no bristle is left that has a shorter
    // length.
    const Vector z = end - sum.place;
    V bent = root(dot(z, z)) - residual;
    if (ages) bent = divide(bent, growth_of(open));
    sum.reach = select_lanes(holds, c.reach + share * (n.reach - c.reach), n.reach);
    sum.reach = most(most(sum.reach, bent), low_reach);
    sum.left = reach_to_left(sum.reach);
    sum.fresh = divide(all, sum.left);
    put(which, open, sum);
    if (has_ranks) join_ranks(which, holds, open, share, n);
  }
  /// Returns the mean rank of cohort j, not 0.
  V middle_rank(std::uint32_t j) const {
    const V middle = half * (get(columns.low[j]) + get(columns.high[j]));
    return select_lanes(is_ranked(), most(middle, V(T(1e-12))), half);
  }
  void join_births(Which which, std::uint32_t open, V share, V before, V ago) {
    alignas(64) T shares[E::size], path[E::size], masses[E::size], slowness[E::size];
    E::put(shares, share);
    E::put(path, ago);
    E::put(masses, before);
    E::put(slowness, get(motion.per_length));
    for (std::uint32_t left = bits_of_mask<T>(which); left != 0; left &= left - 1) {
      const auto k = static_cast<std::uint32_t>(__builtin_ctz(left));
      const double born =
          time[k] - static_cast<double>(path[k]) * static_cast<double>(slowness[k]) / law.ageing_rate;
      double& birth = columns.birth[open].lane[first + k];
      birth = masses[k] > T(0) ? birth + static_cast<double>(shares[k]) * (born - birth) : born;
    }
  }
  /// Gives the open cohort the interval of ranks that has the mean and the variance of all its bristles.
  void join_ranks(Which which, Which holds, std::uint32_t open, V share, const Newborn& n) {
    const V low = get(columns.low[open]), high = get(columns.high[open]);
    const V middle = half * (low + high), squares = mean_square(low, high);
    const V mean = select_lanes(holds, middle + share * (n.rank - middle), n.rank);
    const V mean_squares = select_lanes(holds, squares + share * (n.rank_square - squares), n.rank_square);
    const V reaches = root(most(V(T(3)) * (mean_squares - mean * mean), none));
    which = which & is_ranked();
    put(which, columns.low[open], most(mean - reaches, none));
    put(which, columns.high[open], least(mean + reaches, one));
  }

  /// Closes an open cohort: moves it to index 2, and the newer cohorts up by one, to the first empty place.
  /// If there is none, the two cohorts merge whose merge costs least.
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
    for (std::uint32_t j = last; j > 2; --j) move(which & (V(static_cast<T>(j)) <= gap), j - 1, j);
    move(which, open, 2);
    put(which, columns.fresh[open], none);
  }
  /// Moves cohort 2 and cohort 0, which closes, apart until their two places have the variance of their
  /// bristles' places: on a straight path, to Gauss points. One place for all bristles of a piece would raise
  /// the force. Conserves mass and force.
  void move_apart(Which which) {
    const Cohort older = cohort(2), newer = cohort(0);
    const V mass = older.mass(), other = newer.mass(), share = divide(other, most(mass + other, tiny));
    const Vector apart = newer.place - older.place;
    const V square_apart = dot(apart, apart), reduced = mass * share;
    const V factor = least(one + divide(spread, most(reduced * square_apart, tiny)), V(T(most_apart)));
    const Which moves = which & (square_apart > none) & (reduced > none);
    const V farther = select_lanes(moves, root(factor) - one, none);
    move_place(moves, 2, older, (none - farther * share) * apart);
    move_place(moves, 0, newer, (farther * (one - share)) * apart);
    const V stored = select_lanes(moves, reduced * square_apart * (factor - one), none);
    lost = lost + select_lanes(which, spread - stored, none);
    spread = select_lanes(which, none, spread);
  }
  /// Moves the place of cohort j. Its bristles then are bent more or less, and so is its reach.
  void move_place(Which which, std::uint32_t j, Cohort c, const Vector& by) {
    const V mass = c.mass(), growth = ages ? growth_of(j) : one;
    const Vector before = end - c.place;
    c.place = c.place + by;
    const Vector after = end - c.place;
    const V bent = root(dot(after, after));
    const V reach = c.reach + divide(bent - root(dot(before, before)), growth);
    c.reach = most(most(reach, divide(bent - residual, growth)), low_reach);
    c.left = reach_to_left(c.reach);
    c.fresh = divide(mass, c.left);
    put(which, j, c);
  }
  void move(Which which, std::uint32_t from, std::uint32_t to) {
    put(which, to, cohort(from));
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
  /// returns, cohorts of different rounds lie at the same places.
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

  /// Returns the cost of merging cohorts i and j. Cohorts near in place, reach and rank cost little, and so
  /// do those that weigh little. Ranks matter when the load falls: a cohort weighs the share that it would
  /// hold if the load fell to its mean rank, and the distance of two mean ranks is relative to the lower one.
  /// The smaller weight stands for w1 w2 / (w1 + w2), which needs a division and is between half of it and
  /// all of it.
  V cost_of_merge(std::uint32_t i, std::uint32_t j) const {
    const Cohort c = cohort(i), other = cohort(j);
    const Vector apart = other.place - c.place;
    V distance = dot(apart, apart) + V(T(reach_weight)) * square(other.reach - c.reach);
    V weight = c.mass(), other_weight = other.mass();
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

  /// Merges cohort j into cohort i in the lane first + k. Conserves mass, force, mean reach, mean growth, and
  /// mean and variance of rank. `patch`: its place. Returns twice the energy lost.
  T merge(std::uint32_t k, std::uint32_t i, std::uint32_t j, const T (&patch)[axes][E::size]) {
    const std::uint32_t lane = first + k;
    const auto at = [lane](Columns c, std::uint32_t index) -> T& { return c[index].lane[lane]; };
    const T mass = at(columns.fresh, i) * at(columns.left, i),
            other = at(columns.fresh, j) * at(columns.left, j);
    const T share = other / (mass + other);
    T apart2 = T(0), bent2 = T(0);
    for (int axis = 0; axis < axes; ++axis) {
      const Columns x = axis == 0 ? columns.x : columns.y;
      const T apart = at(x, j) - at(x, i);
      at(x, i) += share * apart;
      const T z = patch[axis][k] - at(x, i);
      apart2 += apart * apart;
      bent2 += z * z;
    }
    T grown = T(1);
    if (ages) {
      const T growth_i = growth_at(age(i, k)), growth_j = growth_at(age(j, k));
      grown = growth_i + share * (growth_j - growth_i);
      columns.birth[i].lane[lane] = time[k] - age_of_growth(static_cast<double>(grown)) / law.ageing_rate;
    }
    T& reach = at(columns.reach, i);
    const T bent = (root(bent2) - static_cast<T>(law.residual)) / grown;
    reach = most(most(reach + share * (at(columns.reach, j) - reach), bent), law.survival->low);
    const T left = most(survival(*law.survival, reach), T(least_left));
    at(columns.left, i) = left;
    at(columns.fresh, i) = (mass + other) / left;
    if (columns.ranked->lane[lane] > T(0))
      merge_ranks(at(columns.low, i), at(columns.high, i), at(columns.low, j), at(columns.high, j), share);
    return mass * share * apart2;
  }
  /// Changes the interval [low, high] of ranks to one that has mean and variance of a mixture, of which the
  /// part `share` has ranks in the other interval.
  static void merge_ranks(T& low, T& high, T other_low, T other_high, T share) {
    const T middle = T(0.5) * (low + high), width = high - low, other_width = other_high - other_low;
    const T apart = T(0.5) * (other_low + other_high) - middle;
    const T variance = (width * width + share * (other_width * other_width - width * width)) / T(12) +
                       share * (T(1) - share) * apart * apart;
    const T mean = middle + share * apart, reaches = root(T(3) * most(variance, T(0)));
    low = most(mean - reaches, T(0));
    high = least(mean + reaches, T(1));
  }

  // ------------------------------------------------------------------------------------------- ------
  // contacts

  /// Moves the origins of the contacts' places.
  void shift_origin() {
    const Vector shift = get(motion.shift);
    for (std::uint32_t j = 0; j < law.cohorts; ++j) {
      put(columns.x[j], get(columns.x[j]) - shift.of[0]);
      if constexpr (axes == 2) put(columns.y[j], get(columns.y[j]) - shift.of[1]);
    }
    for (int axis = 0; axis < axes; ++axis) {
      LaneColumn<T>* const places[] = {columns.begin[0][axis], columns.begin[1][axis], columns.moment[axis]};
      for (LaneColumn<T>* const c : places) put(*c, get(*c) - shift.of[axis]);
    }
  }
  /// Makes births later by the time of the path along which the cohorts are carried.
  void age_carried() {
    for (std::uint32_t k = 0; k < E::size; ++k) {
      const double path = motion.carried.lane[first + k];
      if (!(path > 0.0)) continue;
      const double later = input.duration * (path / motion.moved.lane[first + k]);
      for (std::uint32_t j = 0; j < used; ++j) columns.birth[j].lane[first + k] += later;
    }
  }
  /// Returns the sum of share x |z|^2, weighted by LayMap::energy.
  V weighted_squares() const {
    V sum = spread;
    for (std::uint32_t j = 0; j < used; ++j) {
      const Cohort c = cohort(j);
      Vector z = end - c.place, weighted = z;
      if constexpr (axes == 2) weighted.of[1] = V(static_cast<T>(law.energy)) * z.of[1];
      sum = sum + c.mass() * dot(z, weighted);
    }
    return sum;
  }
};

}  // namespace
}  // namespace bristle::detail
