// A long straight move of the infinite brush on a lattice: the ends of its equal pieces. Renewal theory on
// the lattice gives the births of all pieces, so that a piece costs little more than the look-ups of the
// cohorts that were there before the move (core/patches/COHORTS.md, "Lattice"). One source serves the
// reference and every instruction set; they differ in Engine::Lane, a vector of cohorts.
#pragma once

#include "cohort_parts.hpp"

namespace bristle::detail {
namespace {

/// Fewest pieces: the first piece of a move halves its births, so short moves are more exact piece by piece.
constexpr std::uint32_t fewest_lattice_pieces = 6;
constexpr std::uint32_t most_lattice_pieces = 160;
constexpr std::uint32_t lattice_margin = 2 * cohort_lanes;  ///< readable entries on either side of a column

/// Gregory's weights of order three: the shares of the births of a piece, even along it, that its end, its
/// start, and the end before that take. They conserve mass, mean place and variance of place.
struct BirthShares {
  double end, start, before;
};
constexpr BirthShares even_births = {5.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0};
constexpr BirthShares first_births = {0.5, 0.5, 0.0};  ///< shares of the first piece, which has no end before

/// Sums over the cohorts that are older than the move, at the end of a piece. Masses are relative to bristles
/// that are renewed all along the move.
struct OldSums {
  double full = 0.0;        ///< mass left in rows whose bristles can all be renewed along the whole piece
  double late = 0.0;        ///< mass left in the other rows, before renewal
  double renewable = 0.0;   ///< mass `late`, times the share of the piece along which it can be renewed
  double kept = 0.0;        ///< mass left in all rows, after renewal
  double x = 0.0, y = 0.0;  ///< sums of mass x place over `kept`, for the books
};

/// Rows of cohorts older than the move that still have mass.
struct OldRows {
  std::uint32_t number[most_cohorts / cohort_lanes];
  /// Whether the row may hold bristles that cannot be renewed along all of a piece. Along a straight move
  /// they can from some place on.
  bool late[most_cohorts / cohort_lanes];
  std::uint32_t count = 0;
};

/// Share left of bristles that are renewed with a hazard h is 1 / renewal_growth(h): exp(-h) to fourth order.
template <class V>
inline V renewal_growth(V hazard) {
  const V v = V(0.25) * hazard;
  const V fourth = V(1.0) + v * (V(1.0) + V(0.5) * v);
  const V square = fourth * fourth;
  return square * square;
}

/// Snaps bristles of the old cohorts at the end of a piece. `negligible`: mass below which a cohort snaps as
/// a whole. `missing`: column that receives, for late rows, the share of the piece without renewal. `last`:
/// whether the move ends here, so that reach and moment are due.
template <class Engine, bool rubs, bool last>
inline OldSums snap_old(const CohortLaw& law, double* rows, const OldRows& old, const CohortMove& a,
                        double per_length, const double at[2], double negligible, double* missing) {
  using Lane = typename Engine::Lane;
  using V = typename Lane::V;
  typename Engine::Sum full, late, renewable, sum_x, sum_y;
  const V zero(0.0);
  const V one(1.0);
  bool any_late = false;
  for (std::uint32_t n = 0; n < old.count; ++n) {
    const std::uint32_t number = old.number[n];
    const bool is_late = rubs && old.late[n];
    any_late = any_late || is_late;
    for (std::uint32_t k = 0; k < cohort_lanes / Lane::size; ++k) {
      double* const columns = rows + number * cohort_row + k * Lane::size;
      const auto get = [columns](CohortColumn c) { return Lane::load(columns + c * cohort_lanes); };
      const auto put = [columns](CohortColumn c, V v) { Lane::store(columns + c * cohort_lanes, v); };
      const V zx = V(at[0]) - get(cohort_x);
      const V zy = V(at[1]) - get(cohort_y);
      V bent = root(zx * zx + zy * zy);
      if (rubs) bent = most(bent - V(law.residual), zero);
      const V reach = get(cohort_reach);
      const V before = get(cohort_left);
      const auto beyond = bent > reach;
      const auto now = Lane::survival(law, bent);
      V left = select_lanes(beyond, least(now.left, before), before);
      if (last) {
        put(cohort_reach, select_lanes(beyond, bent + V(reach_margin), reach));
        put(cohort_moment, select_lanes(beyond, now.moment, get(cohort_moment)));
      }
      V mass = get(cohort_fresh) * left;
      const auto stays = mass >= V(negligible);
      left = select_lanes(stays, left, zero);
      mass = select_lanes(stays, mass, zero);
      put(cohort_left, left);
      if (is_late) {
        const V along = zx * V(a.direction[0]) + zy * V(a.direction[1]);
        const V share = least(most((along - V(law.residual)) * V(per_length), zero), one);
        late.add(k, mass);
        renewable.add(k, mass * share);
        Lane::store(missing + number * cohort_lanes + k * Lane::size, one - share);
        continue;
      }
      full.add(k, mass);
      if (!a.books) continue;
      sum_x.add(k, mass * get(cohort_x));
      sum_y.add(k, mass * get(cohort_y));
    }
  }
  OldSums sums;
  sums.full = sums.kept = full.total();
  if (any_late) {
    sums.late = late.total();
    sums.renewable = renewable.total();
  }
  if (a.books) {
    sums.x = sum_x.total();
    sums.y = sum_y.total();
  }
  return sums;
}

/// Adds the late rows to `sums`, once the hazard of the piece is known. Masses count relative to bristles
/// that are renewed along the whole piece, so bristles that are not gain.
template <class Engine>
inline void renew_late(double* rows, OldRows& old, const CohortMove& a, double hazard, const double* missing,
                       OldSums& sums) {
  using Lane = typename Engine::Lane;
  using V = typename Lane::V;
  typename Engine::Sum kept, sum_x, sum_y;
  const V zero(0.0);
  for (std::uint32_t n = 0; n < old.count; ++n) {
    if (!old.late[n]) continue;
    bool late = false;
    for (std::uint32_t k = 0; k < cohort_lanes / Lane::size; ++k) {
      double* const columns = rows + old.number[n] * cohort_row + k * Lane::size;
      const V lacks = Lane::load(missing + old.number[n] * cohort_lanes + k * Lane::size);
      const V fresh = Lane::load(columns + cohort_fresh * cohort_lanes) * renewal_growth(V(hazard) * lacks);
      Lane::store(columns + cohort_fresh * cohort_lanes, fresh);
      const V mass = fresh * Lane::load(columns + cohort_left * cohort_lanes);
      late = late || Lane::any(mass * lacks > zero);
      kept.add(k, mass);
      if (!a.books) continue;
      sum_x.add(k, mass * Lane::load(columns + cohort_x * cohort_lanes));
      sum_y.add(k, mass * Lane::load(columns + cohort_y * cohort_lanes));
    }
    old.late[n] = late;
  }
  sums.kept += kept.total();
  if (!a.books) return;
  sums.x += sum_x.total();
  sums.y += sum_y.total();
}

/// Drops rows that have lost all of their mass.
template <class Lane>
inline void drop_empty(const double* rows, OldRows& old) {
  using V = typename Lane::V;
  std::uint32_t living = 0;
  for (std::uint32_t n = 0; n < old.count; ++n) {
    bool alive = false;
    for (std::uint32_t k = 0; k < cohort_lanes; k += Lane::size)
      alive =
          alive ||
          Lane::any(Lane::load(rows + old.number[n] * cohort_row + cohort_left * cohort_lanes + k) > V(0.0));
    old.number[living] = old.number[n];
    old.late[living] = old.late[n];
    living += alive ? 1u : 0u;
  }
  old.count = living;
}

/// Adds to a column, beyond entry `piece` and up to `last`, the births of a piece times a function `of` their
/// age in pieces.
template <class Lane>
inline void spread_births(double* column, const double* of, std::uint32_t piece, std::uint32_t last,
                          const BirthShares& births) {
  using V = typename Lane::V;
  const V end(births.end);
  const V start(births.start);
  const V before(births.before);
  for (std::uint32_t i = (piece + 1) / Lane::size * Lane::size; i <= last; i += Lane::size) {
    const double* const at = of + (static_cast<std::int32_t>(i) - static_cast<std::int32_t>(piece));
    const V sum = (end * Lane::load_anywhere(at) + start * Lane::load_anywhere(at + 1)) +
                  before * Lane::load_anywhere(at + 2);
    Lane::store(column + i, Lane::load(column + i) + sum);
  }
}

/// Newborn cohorts of a move: fresh masses at the nodes of the lattice, and tables of their survival.
struct Lattice {
  std::uint32_t pieces;
  std::uint32_t oldest;  ///< age in pieces from which no bristle is left
  double length;         ///< length of a piece
  alignas(64) double left_[most_lattice_pieces + 3 * lattice_margin];
  alignas(64) double moment_[most_lattice_pieces + 3 * lattice_margin];
  alignas(64) double bend_[most_lattice_pieces + 3 * lattice_margin];  ///< survival times age, for the books
  alignas(64) double mass_[most_lattice_pieces + 2 * lattice_margin];  ///< mass left at each node
  alignas(
      64) double bent_[most_lattice_pieces + 2 * lattice_margin];  ///< sum of mass x age there, for the books
  double fresh[most_lattice_pieces + 1];

  double* left() { return left_ + lattice_margin; }
  double* moment() { return moment_ + lattice_margin; }
  double* bend() { return bend_ + lattice_margin; }
};

template <class Engine>
inline void tabulate(const CohortLaw& law, bool books, Lattice& lattice) {
  using Lane = typename Engine::Lane;
  using V = typename Lane::V;
  const std::uint32_t end = lattice.pieces + lattice_margin;
  for (std::uint32_t n = 0; n < lattice_margin; ++n) lattice.left_[n] = lattice.bend_[n] = 0.0;
  alignas(64) double age[cohort_lanes];
  for (std::uint32_t n = 0; n < end; n += cohort_lanes) {
    for (std::uint32_t j = 0; j < cohort_lanes; ++j)
      age[j] = lattice.length * static_cast<double>(static_cast<std::int32_t>(n + j));
    for (std::uint32_t j = 0; j < cohort_lanes; j += Lane::size) {
      const V x = Lane::load(age + j);
      const auto sure = x <= V(law.sure);
      const auto at = Lane::survival(law, x);
      const V left = select_lanes(sure, V(1.0), most(at.left, V(0.0)));
      Lane::store(lattice.left() + n + j, left);
      Lane::store(lattice.moment() + n + j, select_lanes(sure, V(0.0), at.moment));
      if (books) Lane::store(lattice.bend() + n + j, left * x);
    }
    for (std::uint32_t j = 0; j < cohort_lanes; ++j) lattice.mass_[n + j] = lattice.bent_[n + j] = 0.0;
  }
  lattice.oldest = 1;
  while (lattice.oldest < end && lattice.left()[lattice.oldest] > law.negligible) ++lattice.oldest;
  for (std::uint32_t n = lattice.oldest; n < end; ++n) lattice.left()[n] = lattice.bend()[n] = 0.0;
}

/// Returns the sum of mass x |z|^2 of all cohorts, with the patch at `at`.
inline double squares_of(const CohortState& s, const double* rows, const double at[2]) {
  double sum = s.spread;
  for (std::uint32_t i = 0; i < s.count; ++i)
    sum += mass_of(rows, i) *
           (square_of(at[0] - entry(rows, i, cohort_x)) + square_of(at[1] - entry(rows, i, cohort_y)));
  return sum;
}

/// Writes the cohorts at the end of a move: the old ones with their mass in whole units, then one for each
/// node of the lattice. Nodes of little or negative mass join the next younger one. `share`: share left of
/// bristles that could be renewed along the whole move.
template <class Engine>
inline void write_lattice(const CohortLaw& law, CohortState& s, double* rows, const CohortMove& a,
                          const Lattice& lattice, const double* left, const double* moment, double share,
                          CohortTotals& t) {
  const double least_mass = s.mass * law.negligible;
  CohortBits emptied;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    double& fresh = entry(rows, i, cohort_fresh);
    fresh *= share;
    const double mass = mass_of(rows, i);
    if (mass >= least_mass && mass > 0.0) continue;
    emptied.set(i);
    fresh = 0.0;
  }
  for (std::uint32_t& open : s.open) open = no_cohort;
  s.spread = 0.0;
  double carried = 0.0;
  double carried_age = 0.0;  // sum of mass x age, in pieces
  for (std::uint32_t lag = lattice.pieces < lattice.oldest ? lattice.pieces + 1 : lattice.oldest;
       lag-- > 0;) {
    const bool alone = carried == 0.0;
    const double here = lattice.fresh[lattice.pieces - lag] * share * left[lag];
    carried += here;
    carried_age += here * static_cast<double>(static_cast<std::int32_t>(lag));
    const double mass = whole_part(carried);
    if (!(mass >= least_mass && mass > 0.0)) continue;
    const double age =
        (alone ? static_cast<double>(static_cast<std::int32_t>(lag)) : most(carried_age / carried, 0.0)) *
        lattice.length;
    const Survival at = alone ? Survival{left[lag], moment[lag]} : young_survival_at(law, age);
    carried = carried_age = 0.0;
    if (!(at.left > 0.0)) continue;
    std::uint32_t i = emptied.take_last(s.count);
    if (i == no_cohort && s.count == s.capacity) {
      make_room<Engine, false>(law, s, rows, a.to, a.times);
      ++t.merges;
    }
    if (i == no_cohort) i = s.count++;
    entry(rows, i, cohort_x) = a.to[0] - (age + law.residual) * a.direction[0];
    entry(rows, i, cohort_y) = a.to[1] - (age + law.residual) * a.direction[1];
    entry(rows, i, cohort_reach) = most(age + reach_margin, law.sure);
    entry(rows, i, cohort_left) = at.left;
    entry(rows, i, cohort_moment) = at.moment;
    entry(rows, i, cohort_fresh) = fresh_mass(mass, at.left);
    entry(rows, i, cohort_low) = 0.0;
    entry(rows, i, cohort_high) = s.mass;
  }
  remove_empty<false>(s, rows, nullptr, emptied);
  // Puts the rounding remainder into the heaviest cohort.
  double missing = s.mass;
  double heaviest_mass = 0.0;
  std::uint32_t heaviest = 0;
  s.moment[0] = s.moment[1] = 0.0;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double mass = mass_of(rows, i);
    missing -= mass;
    s.moment[0] += mass * entry(rows, i, cohort_x);
    s.moment[1] += mass * entry(rows, i, cohort_y);
    heaviest = mass > heaviest_mass ? i : heaviest;
    heaviest_mass = most(heaviest_mass, mass);
  }
  BRISTLE_ASSERT(heaviest_mass + missing > 0.0);
  entry(rows, heaviest, cohort_fresh) =
      fresh_mass(heaviest_mass + missing, entry(rows, heaviest, cohort_left));
  s.moment[0] += missing * entry(rows, heaviest, cohort_x);
  s.moment[1] += missing * entry(rows, heaviest, cohort_y);
}

/// Advances a patch whose cohorts do not age and have all ranks along a straight move of `pieces` pieces.
template <class Engine, bool rubs>
[[gnu::noinline]] void move_on_lattice(const CohortLaw& law, CohortState& s, double* rows,
                                       const CohortMove& a, std::uint32_t pieces, CohortTotals& t) {
  Lattice lattice;
  lattice.pieces = pieces;
  lattice.length = a.length / static_cast<double>(static_cast<std::int32_t>(pieces));
  tabulate<Engine>(law, a.books, lattice);
  const double* const left = lattice.left();
  const bool renews = rubs && law.renewal > 0.0;
  const double per_length = 1.0 / lattice.length;
  const double per_mass = law.renewal / s.mass;
  const double least_mass = s.mass * law.negligible;
  alignas(64) double missing[most_cohorts];
  OldRows old;
  old.count = (s.count + cohort_lanes - 1) / cohort_lanes;
  for (std::uint32_t n = 0; n < old.count; ++n) {
    old.number[n] = n;
    old.late[n] = renews;
  }

  // Share left, by renewal, of bristles that could be renewed all along the move so far, and one over it. At
  // the ends of the last three pieces: masses count relative to the first.
  double share = 1.0;
  double growth[3] = {1.0, 1.0, 1.0};
  double newborn = 0.0;      // mass of the newborn cohorts, relative to `share`
  double old_mass = s.mass;  // mass of the older ones, likewise
  double force[2], first_rise[2] = {0.0, 0.0}, rise[2] = {0.0, 0.0}, area[2] = {0.0, 0.0};
  for (int axis = 0; axis < 2; ++axis) force[axis] = s.mass * a.from[axis] - s.moment[axis];
  const double squares = a.books ? squares_of(s, rows, a.from) : 0.0;
  for (std::uint32_t k = 0; k <= pieces; ++k) lattice.fresh[k] = 0.0;
  double all_snapped = 0.0;
  const double per_even_birth =
      1.0 / (even_births.end + even_births.start * left[1] + even_births.before * left[2]);

  for (std::uint32_t k = 1; k <= pieces; ++k) {
    const double done = lattice.length * static_cast<double>(static_cast<std::int32_t>(k));
    double at[2] = {a.to[0], a.to[1]};
    if (k != pieces)
      for (int axis = 0; axis < 2; ++axis) at[axis] = a.from[axis] + a.direction[axis] * done;
    const double negligible = most(least_mass * growth[0], 1.0);
    OldSums sums;
    if (k == pieces)
      sums = snap_old<Engine, rubs, true>(law, rows, old, a, per_length, at, negligible, missing);
    else if (old.count > 0)
      sums = snap_old<Engine, rubs, false>(law, rows, old, a, per_length, at, negligible, missing);
    const std::uint32_t last = k + lattice.oldest < pieces ? k + lattice.oldest : pieces;
    const BirthShares& shares = k == 1 ? first_births : even_births;
    // Share of births that snap again within the piece.
    const double again = shares.start * (1.0 - left[1]) + shares.before * (1.0 - left[2]);
    const double snapped = share * ((newborn - lattice.mass_[k]) + (old_mass - (sums.full + sums.late)));
    double hazard = 0.0;
    if (renews) {
      const double first = snapped * (1.0 + again);
      const double renewable = share * (lattice.mass_[k] + (sums.full + sums.renewable));
      const double damped = 1.0 + per_mass * (0.5 * first - again * renewable);
      hazard = most(least(per_mass * first / most(damped, 0.25), highest_hazard), 0.0);
      const double grown = renewal_growth(hazard);
      share = share / grown;
      growth[2] = growth[1];
      growth[1] = growth[0];
      growth[0] = growth[0] * grown;
      if (sums.late > 0.0) renew_late<Engine>(rows, old, a, hazard, missing, sums);
    }
    old_mass = sums.kept;
    drop_empty<typename Engine::Lane>(rows, old);
    // Births are as many as the bristles that are lacking, less those that are lost again by the end.
    const double lacking = s.mass - share * (lattice.mass_[k] + sums.kept);
    const double born = renews || k == 1
                            ? lacking / (shares.end + shares.start * (left[1] * share * growth[1]) +
                                         shares.before * (left[2] * share * growth[2]))
                            : lacking * per_even_birth;
    const BirthShares births = {shares.end * born * growth[0], shares.start * born * growth[1],
                                shares.before * born * growth[2]};
    newborn = lattice.mass_[k] + (births.end + births.start * left[1] + births.before * left[2]);
    lattice.fresh[k] = births.end;
    lattice.fresh[k - 1] += births.start;
    if (k > 1) lattice.fresh[k - 2] += births.before;
    spread_births<typename Engine::Lane>(lattice.mass_, left, k, last, births);
    all_snapped += renews ? hazard / per_mass : born;
    if (!a.books) continue;
    const double* const bend = lattice.bend();
    const double bent = lattice.bent_[k] + (births.start * bend[1] + births.before * bend[2]);
    spread_births<typename Engine::Lane>(lattice.bent_, bend, k, last, births);
    const double along = share * (bent + law.residual * newborn);
    const double old_moment[2] = {sums.x, sums.y};
    for (int axis = 0; axis < 2; ++axis) {
      const double now = share * (sums.kept * at[axis] - old_moment[axis]) + along * a.direction[axis];
      rise[axis] = now - force[axis];
      if (k == 1) first_rise[axis] = rise[axis];
      area[axis] += 0.5 * (now + force[axis]);
      force[axis] = now;
    }
  }
  write_lattice<Engine>(law, s, rows, a, lattice, left, lattice.moment(), share, t);
  t.pieces += pieces;
  t.snapped += all_snapped;
  s.slack = -1.0;
  if (!a.books) return;
  double integral[2];
  for (int axis = 0; axis < 2; ++axis)
    // Corrects the trapezoids by the difference of the slopes at the ends.
    integral[axis] = lattice.length * (area[axis] - (rise[axis] - first_rise[axis]) * (1.0 / 12.0));
  const double stored = squares_of(s, rows, a.to) - squares;
  const double lost = 2.0 * (integral[0] * a.direction[0] + integral[1] * a.direction[1]) - stored;
  // Raises the work where its error exceeds a loss near zero, so that no loss is negative.
  const double lacking = 0.5 * most(-lost, 0.0);
  for (int axis = 0; axis < 2; ++axis) t.integral[axis] += integral[axis] + lacking * a.direction[axis];
  t.lost += most(lost, 0.0);
}

/// Returns the number of pieces if the lattice serves for a move, else 0. It does not serve where the
/// bristles that came into contact last leave first, since a node knows no ranks.
inline std::uint32_t lattice_pieces(const CohortLaw& law, const CohortState& s, const CohortMove& a) {
  const double pieces = -whole_part(-(a.length / law.piece * (1.0 - 1e-12)));
  if (s.layered != 0 || pieces < fewest_lattice_pieces || pieces > most_lattice_pieces) return 0;
  return static_cast<std::uint32_t>(pieces);
}

}  // namespace
}  // namespace bristle::detail
