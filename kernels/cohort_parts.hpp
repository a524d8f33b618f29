// Operations on single cohorts of an infinite brush: births, joins, merges and removals. (A cohort is all
// bristles that were last straight at one place and have been bent alike since; COHORTS.md in core/patches
// has the formulas.) The loops over all cohorts are in cohort_pass.hpp.
#pragma once

#include "core/cohort_table.hpp"
#include "core/common/assert.hpp"
#include "elementary.hpp"
#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

constexpr double unlimited_cost = 1e300;
/// Largest cost of a merge, as a multiple of that of the cheapest pair. Searching the cheapest pair is
/// expensive, so one search also merges other pairs up to this cost.
constexpr double merge_margin = 3.0;
/// Cohorts per merged pair. A search merges at most count / merged_at_once pairs.
constexpr std::uint32_t merged_at_once = 4;

/// Values of a law of snap lengths at a length x: the share S(x) of bristles with a longer snap length, and
/// the moment E[delta; delta < x] of those with a shorter one.
struct Survival {
  double left, moment;
};
inline Survival survival_at(const CohortLaw& law, double x) {
  x = least(x, law.end);
  const SurvivalCell& cell =
      law.cells[(bits_of_number(x + survival_offset) >> survival_shift) - survival_first];
  const double left = cell.survival + cell.slope * (x - cell.start);
  return {left, cell.moment + (cell.survival - left) * ((cell.start + x) * 0.5)};
}

/// Looks up what survival_at(x) gives, but skips the table if x is too short for any bristle to snap, as it
/// is for cohorts just born.
inline Survival young_survival_at(const CohortLaw& law, double x) {
  return x <= law.sure ? Survival{1.0, 0.0} : survival_at(law, x);
}

inline double square_of(double a) { return a * a; }

// Growth factor g of snap lengths by ageing (Material::ageing_factor), for one age or a vector of ages.

/// Growth factor g of a snap length at an age in s. Its slope g', 1/s, is the fraction rise / run, so that a
/// caller may choose not to divide.
template <class V>
struct StrengthOf {
  V factor, rise, run;
};
using Strength = StrengthOf<double>;

template <class V>
inline StrengthOf<V> strength_at(const CohortTimes& t, V age) {
  const V one(1.0);
  const V strength(t.strength);
  const V rate(t.rate);
  const V scaled = age * rate;
  if (t.saturates != 0) {
    // Limits the exponent, because exp(-40) is below the rounding error of 1 and exponential() serves only
    // arguments above -80.
    const V weak = exponential<double>(V(0.0) - least(scaled, V(40.0)));
    return {one + strength * (one - weak), strength * weak * rate, one};
  }
  const V later = one + scaled;
  return {one + strength * natural_log<double>(later), strength * rate, later};
}
template <class V>
inline V ageing_at(const CohortTimes& t, V age) {
  return strength_at(t, age).factor;
}

/// Returns the age, s, at which the growth factor g of snap lengths equals `factor`.
inline double age_at(const CohortTimes& t, double factor) {
  const double grown = most(factor - 1.0, 0.0) / t.strength;
  if (t.saturates != 0) return -natural_log<double>(most(1.0 - grown, 1e-17)) / t.rate;
  return (exponential<double>(least(grown, 75.0)) - 1.0) / t.rate;
}

/// Returns the gap: the path that a bristle of fresh snap length delta still moves in a piece after its snap.
/// The snap is where |z - gap e| = l_r + delta g(age - gap / v), with e the direction of motion, v the speed,
/// l_r the residual length, and z the deflection that the bristle would have at the end of the piece without
/// a snap. `square` is |z|^2, `along` is z . e. Takes g as linear near the end, with an error of second order
/// in the length of the piece.
template <class V>
inline V aged_gap(const CohortLaw& law, const StrengthOf<V>& strength, V delta, double per_length, V square,
                  V along) {
  const V length = V(law.residual) + delta * strength.factor;
  // Multiplies all terms of the equation by `run`, which saves a division. The snap length grows along the
  // path by growth / run.
  const V run = strength.run;
  const V growth = delta * (strength.rise * V(per_length));
  const V half = along * run - growth * length;
  const V over = most(square - length * length, V(0.0));
  const V root_of = root(most(half * half - (run * run - growth * growth) * over, V(0.0)));
  return divide(over * run, most(half + root_of, V(1e-300)));
}

/// Returns the reach R of bristles that were bent from straight to `bent` at constant speed: the fresh snap
/// length up to which they have snapped. Returns `bent` itself if that is too short for any snap.
template <bool ages>
inline double fresh_length(const CohortLaw& law, const CohortTimes& t, double bent) {
  return ages && bent > law.sure ? bent / ageing_at(t, bent * t.per_length) : bent;
}

/// Set of cohorts as bits, one for each, by which passes over cohorts note what they find.
struct CohortBits {
  std::uint64_t word[most_cohorts / 64] = {};

  void set(std::uint32_t i) { word[i / 64] |= std::uint64_t{1} << i % 64; }
  bool has(std::uint32_t i) const { return (word[i / 64] >> i % 64 & 1) != 0; }
  /// Clears the bits of lanes behind the last cohort. Their filler places are so far away that they look like
  /// cohorts bent beyond their reach.
  void forget_lanes_from(std::uint32_t count) {
    if (count % 64 != 0) word[count / 64] &= (std::uint64_t{1} << count % 64) - 1;
  }
  /// Takes the highest cohort number below `count` out of the set and returns it; no_cohort if there is none.
  std::uint32_t take_last(std::uint32_t count) {
    for (std::uint32_t w = (count + 63) / 64; w-- > 0;)
      if (word[w] != 0) {
        const auto bit = 63u - static_cast<std::uint32_t>(__builtin_clzll(word[w]));
        word[w] ^= std::uint64_t{1} << bit;
        return w * 64 + bit;
      }
    return no_cohort;
  }
};

/// Removes cohorts that have lost all their mass. Begins with the last of them, so that the cohort that moves
/// into a gap never is an empty one.
template <bool ages>
inline void remove_empty(CohortState& s, double* rows, double* births, CohortBits& empty) {
  for (std::uint32_t i = empty.take_last(s.count); i != no_cohort; i = empty.take_last(i))
    remove_cohort(s, rows, ages ? births : nullptr, i);
}

/// Interval [low, high) of ranks that stands for a mixture of intervals: it has the mean and variance of the
/// mixture and lies inside [0, all). The rank of a bristle is the mass that came into contact before it; a
/// falling load takes the highest ranks out of contact.
struct Ranks {
  double low, high;
};
/// Returns the interval of ranks that has the mean `mean` and the mean square `square`, clipped to [0, all).
inline Ranks ranks_of(double mean, double square, double all) {
  const double half = root(most(3.0 * (square - mean * mean), 0.25));
  return {most(mean - half, 0.0), least(mean + half, all)};
}
inline double rank_mean(double low, double high) { return (low + high) * 0.5; }
inline double rank_square(double low, double high) {
  return (low * low + low * high + high * high) * (1.0 / 3.0);
}

/// A new cohort that is not yet stored in the columns of the patch.
struct Newborn {
  double mass, x, y, reach;
  double rank_mean, rank_square;
  double birth = 0.0;
};

/// Returns the time of birth for a cohort merged from bristles of different age: one for which the growth
/// factor g of snap lengths is the mean of theirs.
inline double mean_birth(const CohortTimes& t, double birth, double other, double share) {
  const double g = ageing_at(t, most(t.now - birth, 0.0));
  const double of_other = ageing_at(t, most(t.now - other, 0.0));
  return t.now - age_at(t, g + share * (of_other - g));
}

/// Merges a newborn cohort into cohort i. Conserves mass, first moment and mean reach R (the length up to
/// which bristles have snapped); R becomes at least the deflection with the patch at `to`. Returns twice the
/// energy lost. `even`: both cohorts were born along a path at constant speed, so that the mean time of birth
/// belongs to the mean place.
template <bool ages>
inline double join(const CohortLaw& law, const CohortState& s, double* rows, std::uint32_t i,
                   const Newborn& n, const double to[2], const CohortTimes& times, bool even) {
  const double m = mass_of(rows, i);
  const double all = m + n.mass;
  const double share = n.mass / all;
  double& x = entry(rows, i, cohort_x);
  double& y = entry(rows, i, cohort_y);
  double& reach = entry(rows, i, cohort_reach);
  const double dx = n.x - x;
  const double dy = n.y - y;
  x += share * dx;
  y += share * dy;
  const double zx = to[0] - x;
  const double zy = to[1] - y;
  const double mean = reach + share * (n.reach - reach);
  double bent = root(zx * zx + zy * zy) - law.residual;
  if (ages) {
    double& birth = times.births[i];
    birth = even ? birth + share * (n.birth - birth) : mean_birth(times, birth, n.birth, share);
    if (bent + reach_margin > mean) bent = bent / ageing_at(times, most(times.now - birth, 0.0));
  }
  reach = most(mean, bent + reach_margin);
  const Survival at = young_survival_at(law, reach);
  entry(rows, i, cohort_fresh) = fresh_mass(all, at.left);
  entry(rows, i, cohort_left) = at.left;
  entry(rows, i, cohort_moment) = at.moment;
  // Leaves out the ranks while every cohort has bristles of all ranks, which ends when the load rises on a
  // contact that has cohorts already.
  if (s.layered == 0) return m * share * (dx * dx + dy * dy);
  double& low = entry(rows, i, cohort_low);
  double& high = entry(rows, i, cohort_high);
  const double of_ranks = rank_mean(low, high);
  const double of_squares = rank_square(low, high);
  const Ranks ranks = ranks_of(of_ranks + share * (n.rank_mean - of_ranks),
                               of_squares + share * (n.rank_square - of_squares), s.mass);
  low = ranks.low;
  high = ranks.high;
  return m * share * (dx * dx + dy * dy);
}

/// Stores a new cohort as cohort i, in a lane that became free or in the one behind the last cohort.
template <bool ages>
inline void append(const CohortLaw& law, const CohortState& s, double* rows, std::uint32_t i,
                   const Newborn& n, const CohortTimes& times) {
  if (ages) times.births[i] = n.birth;
  const Survival at = young_survival_at(law, n.reach);
  BRISTLE_ASSERT(at.left > 0.0);
  entry(rows, i, cohort_x) = n.x;
  entry(rows, i, cohort_y) = n.y;
  entry(rows, i, cohort_reach) = n.reach;
  entry(rows, i, cohort_fresh) = fresh_mass(n.mass, at.left);
  entry(rows, i, cohort_left) = at.left;
  entry(rows, i, cohort_moment) = at.moment;
  const Ranks ranks = s.layered == 0 ? Ranks{0.0, s.mass} : ranks_of(n.rank_mean, n.rank_square, s.mass);
  entry(rows, i, cohort_low) = ranks.low;
  entry(rows, i, cohort_high) = ranks.high;
}

/// Cohort whose place of birth is moved while the patch stays and the mass is unchanged: the new place, the
/// reach R from there to the patch, the survival S(R) and the moment M(R) at that reach, and the time of
/// birth.
struct Moved {
  double x, y, reach;
  Survival at;
  double birth;
};
template <bool ages>
inline Moved move_place(const CohortLaw& law, const double* rows, std::uint32_t i, double dx, double dy,
                        const double to[2], const CohortTimes& times, double dt) {
  const double x = entry(rows, i, cohort_x) + dx;
  const double y = entry(rows, i, cohort_y) + dy;
  const double before =
      root(square_of(to[0] - entry(rows, i, cohort_x)) + square_of(to[1] - entry(rows, i, cohort_y)));
  const double after = root(square_of(to[0] - x) + square_of(to[1] - y));
  double moved = entry(rows, i, cohort_reach) + (after - before);
  double bent = after - law.residual;
  double birth = 0.0;
  if (ages) {
    birth = least(times.births[i] + dt, times.now);
    const double was = ageing_at(times, most(times.now - times.births[i], 0.0));
    const double is = ageing_at(times, times.now - birth);
    moved = (entry(rows, i, cohort_reach) * was + (after - before)) / is;
    bent = bent / is;
  }
  const double reach = most(most(moved, law.sure), bent + reach_margin);
  return {x, y, reach, young_survival_at(law, reach), birth};
}
template <bool ages>
inline void put_moved(double* rows, std::uint32_t i, const Moved& moved, const CohortTimes& times) {
  if (ages) times.births[i] = moved.birth;
  entry(rows, i, cohort_fresh) = fresh_mass(mass_of(rows, i), moved.at.left);
  entry(rows, i, cohort_x) = moved.x;
  entry(rows, i, cohort_y) = moved.y;
  entry(rows, i, cohort_reach) = moved.reach;
  entry(rows, i, cohort_left) = moved.at.left;
  entry(rows, i, cohort_moment) = moved.at.moment;
}

/// Closes the open cohort, the one that newborns join, once it covers a full piece of path. A single place
/// would then stand for the bristles of a whole piece and lose the spread of their places. At every second
/// call the function therefore moves this cohort and the one before it apart, until their two places have
/// that variance: Gauss points, for a straight path. Conserves mass, first and second moment. Returns twice
/// the energy that the pair cannot store.
template <bool ages>
inline double close_open(const CohortLaw& law, CohortState& s, double* rows, const double to[2],
                         const CohortTimes& times) {
  const std::uint32_t i = s.open[2];
  const std::uint32_t j = s.open[0];
  s.open[0] = no_cohort;
  s.open[2] = no_cohort;
  if (law.most_apart <= 1.0) {  // no pair is moved apart if the survival function has corners
    const double spread = s.spread;
    s.spread = 0.0;
    return spread;
  }
  if (i == no_cohort && j != no_cohort) {
    s.open[2] = j;
    return 0.0;
  }
  const double spread = s.spread;
  s.spread = 0.0;
  if (j == no_cohort) return spread;
  const double m = mass_of(rows, i);
  const double n = mass_of(rows, j);
  const double dx = entry(rows, j, cohort_x) - entry(rows, i, cohort_x);
  const double dy = entry(rows, j, cohort_y) - entry(rows, i, cohort_y);
  const double apart = dx * dx + dy * dy;
  if (!(apart > 0.0) || !(m > 0.0) || !(n > 0.0)) return spread;
  const double reduced = m * (n / (m + n));
  const double wanted = least(apart + spread / reduced, law.most_apart * apart);
  const double farther = root(wanted / apart) - 1.0;
  const double back = -farther * (n / (m + n));
  const double forth = farther * (m / (m + n));
  const double dt = ages ? times.births[j] - times.births[i] : 0.0;
  const Moved first = move_place<ages>(law, rows, i, back * dx, back * dy, to, times, back * dt);
  const Moved second = move_place<ages>(law, rows, j, forth * dx, forth * dy, to, times, forth * dt);
  if (!(first.at.left > 0.0) || !(second.at.left > 0.0)) return spread;
  put_moved<ages>(rows, i, first, times);
  put_moved<ages>(rows, j, second, times);
  return most(spread - reduced * (wanted - apart), 0.0);
}

/// Sums from one pass over all cohorts in a piece of path, most of them over the mass that snapped. The
/// letters: gap is the path from a bristle's snap to the end of the piece, z the deflection that the bristle
/// would have there without the snap.
struct PieceSums {
  double lost;          ///< mass of the bristles that snapped
  double gap;           ///< sum over the mass that snapped of the gap
  double gap_gap;       ///< sum over the mass that snapped of the squared gap
  double gap_x, gap_y;  ///< sum over the mass that snapped of gap x z, along x and y
  double squares;       ///< sum over the mass that snapped of the squared deflection |z|^2
  double ranks, rank_squares;
  double x, y;  ///< sum of mass x place over the mass that did not snap

  /// Mass that did not snap, times the share of the piece along which it can be renewed. Used with shared
  /// renewal only.
  double renewable;
  CohortBits emptied;  ///< cohorts that lost all of their mass
};

/// Hazard of shared renewal in a piece: the rate with which snaps renew an eligible bristle, summed over the
/// piece. It is kappa times the snaps of the piece, second snaps of newborn bristles included, over all
/// bristles. Half of it applies before the snaps, because a bristle may be renewed before it snaps (competing
/// risks).
struct Draws {
  double hazard;
  double snapped;  ///< mass that snapped, without second snaps of newborn bristles
};
// Largest hazard 4 v that is used, at v = 1. The kernels replace exp(-4 v) by (1 - v + v^2 / 2)^4, which
// falls only up to v = 1, where it leaves 1/16 of the bristles.
constexpr double highest_hazard = 4.0;

template <bool ages>
inline Draws find_draws(const CohortLaw& law, const CohortState& s, const PieceSums& p,
                        const CohortTimes& times) {
  const double again = 1.0 - young_survival_at(law, fresh_length<ages>(law, times, p.gap / p.lost)).left;
  const double per_mass = law.renewal / s.mass;
  const double damped = 1.0 - per_mass * (again * p.renewable - 0.5 * p.lost);
  const double hazard = least(per_mass * (p.lost * (1.0 + again)) / most(damped, 0.25), highest_hazard);
  return {hazard, p.lost * most(1.0 - 0.5 * hazard, 0.0)};
}

/// Adds the sums over renewed bristles to `p`: renewed and snapped bristles restart together as one newborn
/// cohort. Replaces x and y (sums of mass x place) by those over the bristles that neither snapped nor were
/// renewed.
inline void add_renewed(PieceSums& p, const PieceSums& renewed) {
  p.lost += renewed.lost;
  p.gap += renewed.gap;
  p.gap_gap += renewed.gap_gap;
  p.gap_x += renewed.gap_x;
  p.gap_y += renewed.gap_y;
  p.squares += renewed.squares;
  p.ranks += renewed.ranks;
  p.rank_squares += renewed.rank_squares;
  p.x = renewed.x;
  p.y = renewed.y;
  for (std::uint32_t w = 0; w < most_cohorts / 64; ++w) p.emptied.word[w] |= renewed.emptied.word[w];
}

/// Makes one newborn cohort of the mass that snapped or was renewed along a piece: at its mean place, bent by
/// the residual length l_r. Bristles whose new snap length is below the mean gap snap a second time in the
/// piece; they count as one group. Adds energy and path integral to the sums.
///
/// `at` is the end of the piece, `snapped` the mass that snapped, `renewed_rate` the renewals of a bristle
/// per length of path. Sets `spread` to mass x variance of the places where the bristles were straight, which
/// the caller stores. Always inlined: a result in memory would be written as numbers and read as pairs, which
/// stalls the processor.
template <bool rubs, bool ages>
[[gnu::always_inline]] inline Newborn bear(const CohortLaw& law, PieceSums& p, const CohortMove& a,
                                           double piece, const double at[2], double snapped,
                                           double renewed_rate, const CohortTimes& times, CohortTotals& t,
                                           double& spread) {
  const double gap = p.gap / p.lost;
  // Adds the variance of the gap within each cohort, which the sums lack because they count all bristles that
  // a cohort lost with one mean gap.
  p.gap_gap += p.lost * (square_of(least(gap, piece - gap)) * (1.0 / 3.0));
  const Survival s = young_survival_at(law, fresh_length<ages>(law, times, gap));
  const double again = p.lost * (1.0 - s.left);
  double mean_gap = gap;
  double gap_gap = p.gap_gap;
  double gap_gap_left = p.gap_gap;  // sum of mass x squared path since the last snap
  double of_second = 0.0;           // energy lost by bristles that snap a second time
  if (again > 0.0) {
    double length = s.moment / (1.0 - s.left);
    if (ages) {  // ages the bristle until its snap; two iterations suffice, as growth is slow
      const double delta = length;
      for (int i = 0; i < 2; ++i) length = delta * ageing_at(times, least(length, gap) * times.per_length);
    }
    length = least(length, gap);
    const double left = gap - length;
    mean_gap = gap - (1.0 - s.left) * length;
    gap_gap -= again * (gap * gap - (length * length + left * left));
    of_second = again * (length * length);
    if (rubs) of_second += 2.0 * law.residual * (again * length);
    gap_gap_left -= again * (gap * gap - left * left);
  }
  if (rubs && renewed_rate > 0.0) {
    // Renews newborn bristles as well: in proportion to the path since their birth, and on average halfway
    // along it.
    const double drawn = least(renewed_rate * p.gap, 0.5 * p.lost);
    double half = 0.5 * least(p.gap_gap / most(p.gap, 1e-300), piece);
    // Takes half of the mean path if `half` would make the mean path since the last slip, or its variance,
    // negative. That happens in pieces as long as a snap length, in which many newborn bristles are renewed.
    const double drawn_share = drawn / p.lost;
    const double halved = mean_gap - drawn_share * half;
    if (halved < 0.0 || gap_gap_left - drawn * (3.0 * half * half) < p.lost * (halved * halved))
      half = 0.5 * mean_gap;
    mean_gap = mean_gap - drawn_share * half;
    gap_gap -= drawn * (2.0 * half * half);
    gap_gap_left -= drawn * (3.0 * half * half);
    of_second += drawn * (half * half + 2.0 * law.residual * half);
  }
  spread = most(gap_gap_left - p.lost * (mean_gap * mean_gap), 0.0);
  if (a.books) {
    // Corrects the path integral of the deflection, which the caller computes as if no bristle snapped.
    // Subtracts the part of the lost bristles after their snap and adds that of the newborn cohort.
    double of_newborn = 0.5 * (p.gap_gap + gap_gap);
    if (rubs) of_newborn += law.residual * p.gap;
    t.integral[0] += a.direction[0] * of_newborn - p.gap_x;
    t.integral[1] += a.direction[1] * of_newborn - p.gap_y;
    const double along = a.direction[0] * p.gap_x + a.direction[1] * p.gap_y;
    t.lost += p.squares - 2.0 * along + p.gap_gap;
    t.lost += of_second;
    if (rubs) t.lost -= p.lost * (law.residual * law.residual);
  }
  t.snapped += snapped + again;
  // Distance from the end of the piece to the place where the newborn cohort would be straight.
  const double root = rubs ? mean_gap + law.residual : mean_gap;
  return {p.lost,
          at[0] - root * a.direction[0],
          at[1] - root * a.direction[1],
          most(fresh_length<ages>(law, times, mean_gap) + reach_margin, law.sure),
          p.ranks / p.lost,
          p.rank_squares / p.lost,
          ages ? times.now - mean_gap * times.per_length : 0.0};
}

/// Returns the length of the next piece of a move: the law's piece, or a longer one in the middle of a long
/// move.
inline double next_piece(const CohortLaw& law, double done, double length) {
  const double left = length - done;
  const double wide = least(done, left);
  // Lengthens a piece at most so far that bristles which snap early in it can survive to its end: within the
  // longest snap length.
  const double piece = wide > law.slow ? least(law.piece * least(wide / law.slow, law.longest_growth),
                                               longest_piece_share * law.end)
                                       : law.piece;
  // Avoids a short last piece: cuts the path left into two equal pieces, or takes it whole if it is at most a
  // fifth longer than `piece`.
  if (left > 2.0 * piece) return piece;
  return left > 1.2 * piece ? 0.5 * left : left;
}

/// Pair of cohorts to merge, with the cost of the merge in energy, m1 m2 / (m1 + m2) (dX^2 + dR^2): m1 and m2
/// are the masses, dX and dR the differences of their places and of their reaches. Ageing adds (2 mean dg)^2
/// to the bracket, with dg the difference of their growth factors.
struct Partner {
  double cost;
  std::uint32_t i, j;
};

/// Merges two cohorts into the first, and returns twice the energy lost, m1 m2 / (m1 + m2) |dX|^2. Conserves
/// mass, first moment, mean reach R, and mean and variance of rank.
template <bool ages>
inline double merge(const CohortLaw& law, const CohortState& s, double* rows, std::uint32_t i,
                    std::uint32_t j, const double at[2], const CohortTimes& times) {
  const double low = entry(rows, j, cohort_low);
  const double high = entry(rows, j, cohort_high);
  return join<ages>(
      law, s, rows, i,
      {mass_of(rows, j), entry(rows, j, cohort_x), entry(rows, j, cohort_y), entry(rows, j, cohort_reach),
       rank_mean(low, high), rank_square(low, high), ages ? times.births[j] : 0.0},
      at, times, false);
}

/// Moves the pairs of cohorts that cost at most merge_margin times the cheapest to the front, the cheapest
/// first. Returns how many there are.
inline std::uint32_t sort_cheapest(Partner* pairs, std::uint32_t count) {
  double cheapest = unlimited_cost;
  for (std::uint32_t i = 0; i < count; ++i) cheapest = least(cheapest, pairs[i].cost);
  std::uint32_t near = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Partner pair = pairs[i];
    if (pair.cost > cheapest * merge_margin) continue;
    std::uint32_t k = near++;
    for (; k > 0 && pairs[k - 1].cost > pair.cost; --k) pairs[k] = pairs[k - 1];
    pairs[k] = pair;
  }
  return near;
}

/// Brings straight bristles with the ranks [low, high) into contact when the load rises, with the patch at
/// `at`. They join the cohort that came into contact last, or form a new cohort, for which the caller has
/// made room. Returns twice the energy lost.
template <bool ages>
double enter(const CohortLaw& law, CohortState& s, double* rows, const double at[2], double mass, double low,
             double high, bool joins, const CohortTimes& times) {
  const Newborn n{
      mass,     at[0], at[1], most(law.sure, reach_margin), rank_mean(low, high), rank_square(low, high),
      times.now};
  s.slack = -1.0;
  if (joins) return join<ages>(law, s, rows, s.open[1], n, at, times, false);
  s.open[1] = s.count;
  for (int axis = 0; axis < 2; ++axis) s.begin[1][axis] = at[axis];
  append<ages>(law, s, rows, s.count++, n, times);
  return 0.0;
}

/// Gives cohort i new snap lengths, and keeps the bristles whose length exceeds `bent`. Returns the mass
/// left.
inline double renew(const CohortLaw& law, double* rows, std::uint32_t i, double bent) {
  const double reach = most(bent, law.sure);
  const Survival at = survival_at(law, reach);
  const double mass = whole_part(entry(rows, i, cohort_fresh));
  // Clamps the mass at 0, because at the longest snap length the survival S may be negative by a rounding
  // error.
  const double kept = most(least(whole_part((mass + 0.5) * at.left), mass), 0.0);
  entry(rows, i, cohort_reach) = reach;
  entry(rows, i, cohort_left) = at.left;
  entry(rows, i, cohort_moment) = at.moment;
  entry(rows, i, cohort_fresh) = kept > 0.0 ? fresh_mass(kept, at.left) : 0.0;
  return kept;
}

}  // namespace
}  // namespace bristle::detail
