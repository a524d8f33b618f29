// The loops over all cohorts of an infinite brush, eight logical lanes at a time. core/patches/COHORTS.md has
// the formulas; births and merges are in cohort_parts.hpp.
#pragma once

#include "cohort_parts.hpp"
#include "lanes.hpp"

namespace bristle::detail {
namespace {

using Vector = Lanes<double>;
constexpr std::uint32_t vector_size = static_cast<std::uint32_t>(Vector::size);
constexpr std::uint32_t row_parts = cohort_lanes / vector_size;

/// Sum over cohorts, kept as one partial sum for each of the eight logical lanes of a row. Vectors of every
/// width then add in the same order and give the same bits.
struct LaneSum {
  Vector part[row_parts];

  LaneSum() {
    for (Vector& x : part) x = Vector(0.0);
  }
  double total() const {
    Vector sum[row_parts];
    for (std::uint32_t k = 0; k < row_parts; ++k) sum[k] = part[k];
    for (std::uint32_t half = row_parts / 2; half > 0; half /= 2)
      for (std::uint32_t k = 0; k < half; ++k) sum[k] = sum[k] + sum[k + half];
    return fold_lanes<vector_size, double>(sum[0]);
  }
};

/// Coefficients of the survival table for a vector of lengths, each of which lies in another cell.
struct Cells {
  Vector survival, slope, moment, start;
};

using Two [[gnu::vector_size(16)]] = double;
using Four [[gnu::vector_size(32)]] = double;

#if defined(BRISTLE_ISA_AVX512) || defined(BRISTLE_ISA_AVX2)
using CellAsFour [[gnu::vector_size(32), gnu::may_alias]] = double;
static_assert(sizeof(SurvivalCell) == sizeof(CellAsFour) && alignof(SurvivalCell) == alignof(CellAsFour));
struct FourCells {
  Four survival, slope, moment, start;
};
/// Loads four cells of the survival table and transposes them into vectors of columns.
inline FourCells transposed(const SurvivalCell* cells, const std::uint64_t* number) {
  Four cell[4];
  // Casts the pointer to load a cell. A memcpy would go through the stack and take 40 more instructions.
  for (int k = 0; k < 4; ++k) cell[k] = *reinterpret_cast<const CellAsFour*>(cells + number[k]);
  const Four a = __builtin_shufflevector(cell[0], cell[1], 0, 4, 2, 6);
  const Four b = __builtin_shufflevector(cell[0], cell[1], 1, 5, 3, 7);
  const Four c = __builtin_shufflevector(cell[2], cell[3], 0, 4, 2, 6);
  const Four d = __builtin_shufflevector(cell[2], cell[3], 1, 5, 3, 7);
  return {__builtin_shufflevector(a, c, 0, 1, 4, 5), __builtin_shufflevector(b, d, 0, 1, 4, 5),
          __builtin_shufflevector(a, c, 2, 3, 6, 7), __builtin_shufflevector(b, d, 2, 3, 6, 7)};
}
#endif

inline Cells look_up_cells(const SurvivalCell* cells, const std::uint64_t* number) {
#if defined(BRISTLE_ISA_AVX512)
  const FourCells low = transposed(cells, number);
  const FourCells high = transposed(cells, number + 4);
  const auto both = [](Four a, Four b) {
    return Vector(__builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7));
  };
  return {both(low.survival, high.survival), both(low.slope, high.slope), both(low.moment, high.moment),
          both(low.start, high.start)};
#elif defined(BRISTLE_ISA_AVX2)
  const FourCells turned = transposed(cells, number);
  return {Vector(turned.survival), Vector(turned.slope), Vector(turned.moment), Vector(turned.start)};
#elif !defined(BRISTLE_KERNEL_ISA)
  const SurvivalCell& cell = cells[*number];
  return {Vector(cell.survival), Vector(cell.slope), Vector(cell.moment), Vector(cell.start)};
#else
  Two front[2], back[2];
  for (int k = 0; k < 2; ++k) {
    std::memcpy(&front[k], &cells[number[k]].survival, sizeof(Two));
    std::memcpy(&back[k], &cells[number[k]].moment, sizeof(Two));
  }
  return {Vector(__builtin_shufflevector(front[0], front[1], 0, 2)),
          Vector(__builtin_shufflevector(front[0], front[1], 1, 3)),
          Vector(__builtin_shufflevector(back[0], back[1], 0, 2)),
          Vector(__builtin_shufflevector(back[0], back[1], 1, 3))};
#endif
}

struct SurvivalLanes {
  Vector left, moment;
};
inline SurvivalLanes survival_at(const CohortLaw& law, Vector x) {
  x = least<double>(x, Vector(law.end));
  alignas(64) std::uint64_t number[vector_size];
  const Bits<double> bits = bits_of<double>(x + Vector(survival_offset));
  ((bits >> survival_shift) - Bits<double>(survival_first)).store_aligned(number);
  const Cells cell = look_up_cells(law.cells, number);
  const Vector left = cell.survival + cell.slope * (x - cell.start);
  return {left, cell.moment + (cell.survival - left) * ((cell.start + x) * Vector(0.5))};
}

/// Columns of a vector of cohorts, as a part of a row of eight.
struct VectorPlace {
  double* columns;
  Vector get(CohortColumn column) const { return load<double>(columns + column * cohort_lanes); }
  void put(CohortColumn column, Vector value) const { value.store_aligned(columns + column * cohort_lanes); }
};

inline Vector masses_of(Vector fresh, Vector left) { return whole_part<double>(fresh * left); }

/// Returns the mask of a vector as an integer with a bit for each lane.
inline std::uint64_t lane_bits(Mask<double> which) {
#if defined(BRISTLE_ISA_AVX512)
  return static_cast<std::uint64_t>(which.data);
#elif defined(BRISTLE_ISA_AVX2)
  return static_cast<std::uint64_t>(_mm256_movemask_pd(which.data));
#elif defined(BRISTLE_ISA_SSE2)
  return static_cast<std::uint64_t>(_mm_movemask_pd(which.data));
#elif !defined(BRISTLE_KERNEL_ISA)
  return which.is ? 1u : 0u;
#else
  bool lane[vector_size];
  which.store_unaligned(lane);
  std::uint64_t bits = 0;
  for (std::uint32_t k = 0; k < vector_size; ++k) bits |= std::uint64_t{lane[k]} << k;
  return bits;
#endif
}

struct CohortSums {
  LaneSum lost, gap, gap_gap, gap_x, gap_y, squares, ranks, rank_squares, x, y, renewable;
  /// Whether the caller wants the sums for energy (`books`) and for ranks (`ranked`). Unwanted sums stay 0.
  bool books, ranked;

  /// Bits of cohorts that have lost all their mass. They are set directly in the caller's memory: a copy at
  /// the end would read bytes that were only just written, for which the processor would have to wait.
  CohortBits& emptied;
  std::uint32_t first = 0;  ///< number of the first cohort of the row that is being visited

  CohortSums(bool books_, bool ranked_, CohortBits& emptied_)
      : books(books_), ranked(ranked_), emptied(emptied_) {}

  void note_empty(Mask<double> which, std::uint32_t k) {
    emptied.word[first / 64] |= lane_bits(which) << (first % 64 + k * vector_size);
  }

  /// Adds what the cohorts at `place` have lost to the sums of a piece, at whose end they would be bent by z.
  /// Of their mass, `kept` is left; `left_behind` was lost at a path `g` before the end.
  template <int axes>
  void add(const VectorPlace& place, std::uint32_t k, Vector zx, Vector zy, Vector square, Vector kept,
           Vector left_behind, Vector g) {
    const auto sum = [k](LaneSum& total, Vector value) { total.part[k] = total.part[k] + value; };
    const Vector lost_gap = left_behind * g;
    sum(lost, left_behind);
    sum(gap, lost_gap);
    sum(gap_gap, lost_gap * g);
    if (books) {
      sum(gap_x, lost_gap * zx);
      if (axes == 2) sum(gap_y, lost_gap * zy);
      sum(squares, left_behind * square);
    }
    if (ranked) {
      const Vector low = place.get(cohort_low);
      const Vector high = place.get(cohort_high);
      sum(ranks, left_behind * ((low + high) * Vector(0.5)));
      sum(rank_squares, left_behind * ((low * low + low * high + high * high) * Vector(1.0 / 3.0)));
    }
    sum(x, kept * place.get(cohort_x));
    if (axes == 2) sum(y, kept * place.get(cohort_y));
  }
  template <int axes, bool rubs>
  void write(PieceSums& p) const {
    p.lost = lost.total();
    p.gap = gap.total();
    p.gap_gap = gap_gap.total();
    p.x = x.total();
    if (axes == 2) p.y = y.total();
    if (rubs) p.renewable = renewable.total();
    if (books) {
      p.gap_x = gap_x.total();
      if (axes == 2) p.gap_y = gap_y.total();
      p.squares = squares.total();
    }
    if (ranked) {
      p.ranks = ranks.total();
      p.rank_squares = rank_squares.total();
    }
  }
};

/// Returns the length of the deflection z. With one axis that is the absolute value, to the last bit the same
/// as the root.
template <int axes>
inline Vector length_of(Vector zx, Vector square) {
  return axes == 2 ? root<double>(square) : magnitude<double>(zx);
}

/// Returns the share of a piece along which bristles are bent by more than the residual length l_r; only
/// there can they be renewed. `along` is their deflection along the motion at the end of the piece.
inline Vector renewable_path(const CohortLaw& law, Vector along, double length) {
  const Vector path = least<double>(most<double>(along - Vector(law.residual), Vector(0.0)), Vector(length));
  return divide<double>(path, Vector(length));
}

/// Snaps, in a vector of cohorts, the bristles whose snap length is below the deflection at the end of a
/// piece. Returns whether a cohort is bent further than ever before; otherwise nothing has snapped.
template <int axes, bool rubs, bool ages>
inline bool bend(const CohortLaw& law, double least_mass, const VectorPlace& place, std::uint32_t k,
                 const CohortMove& a, double length, const double at[2], const CohortTimes& times,
                 const double* births, CohortSums& sums) {
  const Vector zero(0.0);
  const Vector x = place.get(cohort_x);
  const Vector y = axes == 2 ? place.get(cohort_y) : zero;
  const Vector zx = Vector(at[0]) - x;
  const Vector zy = axes == 2 ? Vector(at[1]) - y : zero;
  const Vector square = axes == 2 ? zx * zx + zy * zy : zx * zx;
  Vector bent = length_of<axes>(zx, square);
  if (rubs) bent = most<double>(bent - Vector(law.residual), zero);
  const Vector reach = place.get(cohort_reach);
  const Vector fresh = place.get(cohort_fresh);
  const Vector left = place.get(cohort_left);
  const Vector mass = masses_of(fresh, left);
  const Vector along =
      axes == 2 ? zx * Vector(a.direction[0]) + zy * Vector(a.direction[1]) : zx * Vector(a.direction[0]);
  const Vector renewable = rubs ? renewable_path(law, along, length) : zero;
  Mask<double> beyond = bent > reach;
  StrengthOf<Vector> strength{};
  // Leaves out ageing if no deflection exceeds its fresh reach, because ageing only lengthens snap lengths.
  if (ages && any_lane<double>(beyond)) {
    strength = strength_at(times, most<double>(Vector(times.now) - load<double>(births), zero));
    bent = divide<double>(bent, strength.factor);
    beyond = bent > reach;
  }
  if (!any_lane<double>(beyond)) {
    sums.x.part[k] = sums.x.part[k] + mass * x;
    if (axes == 2) sums.y.part[k] = sums.y.part[k] + mass * y;
    if (rubs) sums.renewable.part[k] = sums.renewable.part[k] + mass * renewable;
    return false;
  }
  const Vector moment = place.get(cohort_moment);
  const SurvivalLanes now = survival_at(law, bent);
  Vector kept = least<double>(whole_part<double>(fresh * now.left), mass);
  kept = select_lanes<double>(kept < Vector(least_mass), zero, kept);
  kept = select_lanes<double>(beyond, kept, mass);
  const Vector lost = mass - kept;

  // Mean snap length of the bristles that snapped; from it follows the path that was left after their snaps.
  const Vector share = left - now.left;
  const Mask<double> some = share > zero;
  Vector snapped_at = divide<double>(now.moment - moment, select_lanes<double>(some, share, Vector(1.0)));
  snapped_at = select_lanes<double>(some, snapped_at, bent);
  snapped_at = least<double>(most<double>(snapped_at, reach), bent);
  Vector gap;
  if (ages) {
    gap = aged_gap(law, strength, snapped_at, times.per_length, square, along);
  } else {
    if (rubs) snapped_at = snapped_at + Vector(law.residual);
    Vector before = snapped_at;  // deflection along the motion at the snap; snapped_at with one axis
    if (axes == 2) {
      const Vector across = most<double>(square - along * along, zero);
      before = root<double>(most<double>(snapped_at * snapped_at - across, zero));
    }
    gap = along - before;
  }
  gap = least<double>(most<double>(gap, zero), Vector(length));

  sums.add<axes>(place, k, zx, zy, square, kept, lost, gap);
  if (rubs) sums.renewable.part[k] = sums.renewable.part[k] + kept * renewable;

  place.put(cohort_reach, select_lanes<double>(beyond, bent + Vector(reach_margin), reach));
  const Mask<double> empty = beyond & (kept == zero);
  sums.note_empty(empty, k);
  place.put(cohort_fresh, select_lanes<double>(empty, zero, fresh));
  place.put(cohort_left, select_lanes<double>(beyond, now.left, left));
  place.put(cohort_moment, select_lanes<double>(beyond, now.moment, moment));
  return true;
}

/// Renews a vector of cohorts at the end of a piece in which bristles snapped. The share 1 - exp(-hazard) of
/// their renewable bristles slips to the residual length l_r and gets new snap lengths, halfway along the
/// path on which it can be renewed.
template <int axes>
inline void renew_share(const CohortLaw& law, double least_mass, const VectorPlace& place, std::uint32_t k,
                        const CohortMove& a, double length, const double at[2], double hazard,
                        CohortSums& sums) {
  const Vector zero(0.0);
  const Vector one(1.0);
  const Vector half(0.5);
  const Vector zx = Vector(at[0]) - place.get(cohort_x);
  const Vector zy = axes == 2 ? Vector(at[1]) - place.get(cohort_y) : zero;
  const Vector square = axes == 2 ? zx * zx + zy * zy : zx * zx;
  const Vector along =
      axes == 2 ? zx * Vector(a.direction[0]) + zy * Vector(a.direction[1]) : zx * Vector(a.direction[0]);
  const Vector path = renewable_path(law, along, length);
  const Vector left = place.get(cohort_left);
  const Vector mass = masses_of(place.get(cohort_fresh), left);

  const Vector quarter = Vector(0.25 * hazard) * path;
  // Computes the share of bristles that a quarter of the hazard leaves, exp(-quarter), to second order. Its
  // fourth power is the share that the whole hazard leaves.
  const Vector root_left = one - quarter * (one - half * quarter);
  const Vector twice = root_left * root_left;
  Vector fresh = place.get(cohort_fresh) * (twice * twice);
  Vector kept = least<double>(whole_part<double>(fresh * left), mass);
  kept = select_lanes<double>((path > zero) & (kept < Vector(least_mass)), zero, kept);
  fresh = select_lanes<double>(kept > zero, fresh, zero);
  sums.note_empty((kept == zero) & (mass > zero), k);
  const Vector gap = half * path * Vector(length);
  sums.add<axes>(place, k, zx, zy, square, kept, mass - kept, gap);
  place.put(cohort_fresh, fresh);
}

/// Advances all cohorts by one piece of the patch's path, which ends with the patch at `at`. Returns whether
/// a cohort is bent further than ever before; if none is, nothing snaps and the sums `p` are not written.
template <int axes, bool rubs, bool ages>
bool bend_cohorts(const CohortLaw& law, const CohortState& s, double* rows, const CohortMove& a,
                  double length, const double at[2], const CohortTimes& times, PieceSums& p) {
  BRISTLE_ASSERT(axes == 2 || a.direction[0] * a.direction[0] == 1.0);
  CohortSums sums(a.books, s.layered != 0, p.emptied);
  bool bent = false;
  const double least_mass = s.mass * law.negligible;
  for (std::uint32_t i = 0; i < s.count; i += cohort_lanes, rows += cohort_row, sums.first += cohort_lanes)
    for (std::uint32_t k = 0; k < row_parts; ++k)
      if (bend<axes, rubs, ages>(law, least_mass, {rows + k * vector_size}, k, a, length, at, times,
                                 ages ? times.births + (i + k * vector_size) : nullptr, sums))
        bent = true;
  if (bent) sums.write<axes, rubs>(p);
  return bent;
}

template <int axes>
PieceSums renew_cohorts(const CohortLaw& law, const CohortState& s, double* rows, const CohortMove& a,
                        double length, const double at[2], double hazard) {
  PieceSums p{};
  CohortSums sums(a.books, s.layered != 0, p.emptied);
  const double least_mass = s.mass * law.negligible;
  for (std::uint32_t i = 0; i < s.count; i += cohort_lanes, rows += cohort_row, sums.first += cohort_lanes)
    for (std::uint32_t k = 0; k < row_parts; ++k)
      renew_share<axes>(law, least_mass, {rows + k * vector_size}, k, a, length, at, hazard, sums);
  sums.write<axes, true>(p);
  return p;
}

/// Returns the path from `at` along which no cohort is bent further than ever before, so that no bristle
/// snaps.
template <int axes, bool ages>
double find_slack(const CohortLaw& law, const CohortState& s, const double* rows, const double at[2],
                  const CohortTimes& times) {
  Vector slack(unused_reach);
  for (std::uint32_t i = 0; i < s.count; i += cohort_lanes, rows += cohort_row)
    for (std::uint32_t k = 0; k < row_parts; ++k) {
      const double* const columns = rows + k * vector_size;
      const Vector zx = Vector(at[0]) - load<double>(columns + cohort_x * cohort_lanes);
      Vector square = zx * zx;
      if (axes == 2) {
        const Vector zy = Vector(at[1]) - load<double>(columns + cohort_y * cohort_lanes);
        square = square + zy * zy;
      }
      Vector reach = load<double>(columns + cohort_reach * cohort_lanes);
      if (ages) {
        const Vector births = load<double>(times.births + (i + k * vector_size));
        reach = reach * ageing_at(times, most<double>(Vector(times.now) - births, Vector(0.0)));
      }
      reach = reach + Vector(law.residual);
      slack = least<double>(slack, reach - length_of<axes>(zx, square));
    }
  alignas(64) double lane[vector_size];
  slack.store_aligned(lane);
  double nearest = lane[0];
  for (double x : lane) nearest = least(nearest, x);
  return nearest;
}

/// Finds the cohort after i that is cheapest to merge with i. A partner that costs more than `limit` may be
/// missed.
template <bool ages>
Partner find_partner(const double* rows, const double* masses, const double* grown, std::uint32_t count,
                     std::uint32_t i, double limit) {
  const Vector x(entry(rows, i, cohort_x));
  const Vector y(entry(rows, i, cohort_y));
  const Vector reach(entry(rows, i, cohort_reach));
  const Vector mass(masses[i]);
  const Vector last(static_cast<double>(count));
  const Vector self(static_cast<double>(i));
  const Vector twice_limit(2.0001 * limit);  // twice the limit of cost, with a margin above rounding
  bool found = false;
  Vector cheapest(unlimited_cost);
  Vector partner = self;
  alignas(64) double first_numbers[cohort_lanes] = {0, 1, 2, 3, 4, 5, 6, 7};
  for (std::uint32_t j = i / vector_size * vector_size; j < count; j += vector_size) {
    const double* const columns = rows + j / cohort_lanes * cohort_row + j % cohort_lanes;
    const Vector dx = load<double>(columns + cohort_x * cohort_lanes) - x;
    const Vector dy = load<double>(columns + cohort_y * cohort_lanes) - y;
    const Vector dr = load<double>(columns + cohort_reach * cohort_lanes) - reach;
    const Vector other = load<double>(masses + j);
    Vector apart = (dx * dx + dy * dy) + dr * dr;
    if (ages) {
      const Vector dg = load<double>(grown + j) - Vector(grown[i]);
      apart = apart + dg * dg;
    }
    const Vector number = load<double>(first_numbers) + Vector(static_cast<double>(j));
    const Mask<double> after = (number > self) & (number < last);
    // Skips a vector of cohorts if a lower bound on its costs exceeds the limit. The reduced mass m1 m2 / (m1
    // + m2) is at least half of the smaller mass.
    if (!any_lane<double>(after & (least<double>(mass, other) * apart <= twice_limit))) continue;
    found = true;
    const Vector reduced = divide<double>(mass * other, mass + other);
    const Vector cost = reduced * apart;
    const Mask<double> better = after & (cost < cheapest);
    cheapest = select_lanes<double>(better, cost, cheapest);
    partner = select_lanes<double>(better, number, partner);
  }
  if (!found) return {unlimited_cost, i, i};
  alignas(64) double cost[vector_size], number[vector_size];
  cheapest.store_aligned(cost);
  partner.store_aligned(number);
  Partner best{unlimited_cost, i, i};
  for (std::uint32_t k = 0; k < vector_size; ++k) {
    const auto j = static_cast<std::uint32_t>(number[k]);
    if (cost[k] < best.cost || (cost[k] == best.cost && j < best.j)) best = {cost[k], i, j};
  }
  return best;
}

/// Returns the mass whose rank (the mass that came into contact before a bristle) is above `cut`, and the
/// mass per rank there. A falling load takes this mass out of contact.
inline void mass_above(const CohortState& s, const double* rows, double cut, double* mass, double* density) {
  LaneSum masses, densities;
  const Vector zero(0.0);
  const Vector rank(cut);
  for (std::uint32_t i = 0; i < s.count; i += cohort_lanes, rows += cohort_row)
    for (std::uint32_t k = 0; k < row_parts; ++k) {
      const double* const columns = rows + k * vector_size;
      const Vector low = load<double>(columns + cohort_low * cohort_lanes);
      const Vector high = load<double>(columns + cohort_high * cohort_lanes);
      const Vector m = masses_of(load<double>(columns + cohort_fresh * cohort_lanes),
                                 load<double>(columns + cohort_left * cohort_lanes));
      const Vector width = high - low;
      const Vector per_rank = divide<double>(m, select_lanes<double>(width > zero, width, Vector(1.0)));
      const Vector above = least<double>(most<double>(high - rank, zero), width);
      masses.part[k] = masses.part[k] + above * per_rank;
      densities.part[k] =
          densities.part[k] + select_lanes<double>((low < rank) & (rank <= high), per_rank, zero);
    }
  *mass = masses.total();
  *density = densities.total();
}

}  // namespace
}  // namespace bristle::detail
