// A step of sixteen contacts whose bristles snap and take a new length, in the limit of infinitely many
// bristles (Population::infinite), one contact in each lane (core/patches/COHORTS.md has the formulas). One
// source for vectors and for plain numbers.
//
// All bristles of a contact that were last straight at the same position, and have bent alike since, are a
// cohort. A step moves the patch along straight pieces of path. A piece takes three parts:
//   bend()   takes from every cohort the bristles whose snap length is exceeded;
//   renew()  takes those that shared renewal makes start afresh;
//   bear()   makes one newborn cohort of all these bristles, where they were straight on average.
// lane_brush_list.hpp has the list of the cohorts, lane_brush_load.hpp the changes of load.
//
// Cohorts have shares of the load, so a change of load that all bristles take part in changes no cohort. The
// mean deflection is the position of the patch, in double, less the mean position of the cohorts. A path on
// which certainly no bristle snaps, `slack`, is known from the last step; within it a step visits no cohort.
#pragma once

#include <limits>

#include "lane_brush_load.hpp"

namespace bristle::detail {
namespace {

/// Survival S(R) below which a cohort with a small share ends at once. One of which more is left is newborn
/// rather than spent, and ends a hundred times later.
constexpr double spent = 0.01;
/// Least hazard of renewals that are made, and longest path on which a smaller one waits: single precision
/// would round away the renewals of short steps.
constexpr double least_hazard = 0x1p-10, longest_wait = 0x1p-7;
/// Largest hazard of renewal in a piece. The series for exp(-hazard) is valid up to it.
constexpr double highest_hazard_of_piece = 4.0;
/// Length of a piece over the law's from which on its newborn bristles make two cohorts.
constexpr double wide_piece = 1.3;

/// Length of the last part of a path, scaled, whose snaps stand for those of the path that is not computed.
constexpr double late_path = 2.0;

/// Steps the contacts of one vector from the lane `first` on, one contact in each lane.
template <class E, class T, int axes, bool books>
class BrushStepper : BrushLoads<E, T, axes, books> {
  using Base = BrushLoads<E, T, axes, books>;
  using Base::ages, Base::cohort, Base::columns, Base::end, Base::first, Base::get, Base::growth_at,
      Base::growth_of, Base::half, Base::has_ranks, Base::input, Base::law, Base::lost, Base::low_reach,
      Base::mean_square, Base::motion, Base::none, Base::one, Base::position, Base::put, Base::residual,
      Base::spread, Base::square, Base::time, Base::tiny, Base::used, Base::zero;
  using typename Base::Cohort;
  using typename Base::V;
  using typename Base::Vector;
  using typename Base::Which;

 public:
  BrushStepper(const BrushLaw<T>& law_of, const BrushColumns<T>& columns_of, const LaneInput& input_of,
               const BrushMotion<T, axes>& motion_of, std::uint32_t first_lane)
      : Base(law_of, columns_of, input_of, motion_of, first_lane) {}

  /// Runs the step. Returns a number of cohorts from which on all are empty.
  [[gnu::noinline]] std::uint32_t run(BrushSums<T, axes>& sums) {
    if (motion.any_shift) this->shift_origin();
    end = get(motion.position);
    const bool weighs = books && law.energy != 1.0;
    if (weighs) write(sums.squares[0], this->weighted_squares());
    V of_load = none;
    if (motion.any_load) of_load = this->change_load();
    if (weighs) write(sums.squares[1], this->weighted_squares());
    if (motion.any_moves) slide();
    end = get(motion.end);
    if (weighs) write(sums.squares[2], this->weighted_squares());
    if (ages && motion.any_dragged) this->age_dragged();
    put(*columns.spread, spread);
    if constexpr (!books) return used;
    for (int axis = 0; axis < axes; ++axis) write(sums.integral[axis], integral.of[axis]);
    write(sums.lost, lost);
    write(sums.load_lost, of_load);
    write(sums.snapped, snapped);
    write(sums.late_snaps, snapped - early_snaps);
    write(sums.late_path, get(motion.length) - early_path);
    return used;
  }

 private:
  static constexpr T eps = std::numeric_limits<T>::epsilon();
  const Vector e = get(motion.direction);
  const V least_share = V(static_cast<T>(law.least_share));
  const V per_length = get(motion.per_length);
  Vector integral = this->zero();
  V snapped = none, early_snaps = none, early_path = none;

  void write(Lane16<T>& to, V x) const { E::put(to.lane + first, x); }

  // -------------------------------------------------------------------------------------------------- path

  /// Moves the contacts along their paths, in pieces.
  void slide() {
    const V length = get(motion.length), slack = get(*columns.slack);
    const Which within = (length > none) & !(length > slack);
    put(within, *columns.slack, slack - length);
    if constexpr (books) {
      end = get(motion.end);
      integral = select_lanes(within, integral_without_snaps(length), zero());
    }
    // Contacts that stay within their slack take no part in the pieces of others.
    const V path = select_lanes(within, none, length);
    if (!any_lane(path > none)) return;
    V done = none;
    do {
      const V piece = next_piece(done, path - done);
      done = select_lanes(piece == path - done, path, done + piece);
      const V remaining = path - done;
      end = get(motion.end) - remaining * e;
      if (ages) set_time(done);
      step_piece(piece);
      const Which early = remaining > V(T(late_path));
      early_path = select_lanes(early, done, early_path);
      early_snaps = select_lanes(early, snapped, early_snaps);
    } while (any_lane(done < path));
  }
  /// Returns the length of the next piece. Pieces lengthen far from both ends of a path, because what happens
  /// there has little effect on the force at the end. Avoids a short last piece.
  V next_piece(V done, V left) const {
    const V usual(static_cast<T>(law.piece)), slow(static_cast<T>(law.slow));
    const V wide = least(done, left);
    const V longer = usual * least(divide(wide, slow), V(static_cast<T>(law.growth)));
    const V piece = select_lanes(wide > slow, longer, usual);
    return select_lanes(left > piece + piece, piece,
                        select_lanes(left > V(T(1.2)) * piece, half * left, left));
  }
  /// Sets the times of the contacts to those at which they have moved by `done`.
  void set_time(V done) {
    alignas(64) T aged[E::size];
    E::put(aged, done * per_length);
    for (std::uint32_t k = 0; k < E::size; ++k)
      time[k] = input.start[first + k] + static_cast<double>(aged[k]) / law.ageing_rate;
  }
  /// Returns the integral of the mean deflection along a path of this length up to `end`, if nothing snaps.
  Vector integral_without_snaps(V length) const {
    return length * (end - half * length * e - get(columns.moment));
  }

  /// Moves the contacts straight on to `end`, along a piece of this length; 0: the contact stays.
  void step_piece(V piece) {
    const Which moves = piece > none;
    if constexpr (books) integral = integral + select_lanes(moves, integral_without_snaps(piece), zero());
    Sums sums = bend(piece, moves);
    const Which snaps = moves & (sums.share > none);
    put(snaps, *columns.slack, none);
    if (any_lane(moves & !snaps)) put(moves & !snaps, *columns.slack, find_slack());
    if (!any_lane(snaps)) return;
    const V of_snaps = sums.share;
    Renewal renewal;
    if (law.renewal > 0.0) renewal = find_renewal(snaps, piece, sums);
    if (any_lane(renewal.path > none)) renew(renewal, sums);
    bear(snaps, piece, renewal, of_snaps, sums);
  }

  /// Sums over the bristles that snapped or were renewed in a piece, and over those that were not. The gap of
  /// a bristle is the path from its snap to the end of the piece; z is the deflection that it would have at
  /// the end without the snap.
  struct Sums {
    V share = V(T(0)), gap = V(T(0)), gap_square = V(T(0));
    V z_square = V(T(0)), rank = V(T(0)), rank_square = V(T(0));
    Vector gap_z;
    V kept = V(T(0));       ///< share that did not snap
    Vector moment;          ///< share x position of the bristles that did not snap
    V renewable = V(T(0));  ///< share x path on which it can be renewed
  };
  /// Adds bristles of cohort j to the sums, which snapped along the last `path` of the piece: their share,
  /// and share x gap, from which the mean square of the gap follows if the density of snaps is linear along
  /// the path.
  [[gnu::always_inline]] void lose(Sums& sums, std::uint32_t j, V share, V of_gap, V path, const Vector& z,
                                   V z_square) const {
    sums.share = sums.share + share;
    sums.gap = sums.gap + of_gap;
    sums.gap_square = sums.gap_square + path * (of_gap - V(T(1.0 / 6)) * share * path);
    if constexpr (books) {
      sums.gap_z = sums.gap_z + of_gap * z;
      sums.z_square = sums.z_square + share * z_square;
    }
    if (!has_ranks) return;
    const V low = get(columns.low[j]), high = get(columns.high[j]);
    sums.rank = sums.rank + share * (half * (low + high));
    sums.rank_square = sums.rank_square + share * mean_square(low, high);
  }
  /// Returns the contacts whose cohort j is negligible once its share is `share` and its survival is `left`.
  /// What counts is the share that it would have if the load fell to its highest rank.
  Which is_negligible(std::uint32_t j, V share, V left) const {
    V most_share = select_lanes(left < V(T(spent)), least_share, least_share * V(T(0.01)));
    if (has_ranks) most_share = most_share * select_lanes(this->is_ranked(), get(columns.high[j]), one);
    return share < most_share;
  }

  /// Snaps the bristles whose snap length the deflection exceeds at the end of a piece. Along the piece the
  /// deflection of a cohort is convex, so it is largest at an end.
  [[gnu::always_inline]] Sums bend(V piece, Which moves) {
    Sums sums;
    sums.gap_z = sums.moment = zero();
    for (std::uint32_t j = 0; j < used; ++j) {
      const Cohort c = cohort(j);
      const Vector z = end - c.position;
      const V z_square = dot(z, z), along = dot(z, e), share = c.share();
      V limit = c.reach + residual, growth = one;
      Which beyond = moves & (z_square > limit * limit) & (share > none);
      if (ages && any_lane(beyond)) {  // Ageing only lengthens snap lengths.
        const V age = this->age_of(j);
        growth = growth_at(age);
        limit = c.reach * growth + residual;
        beyond = beyond & (z_square > limit * limit);
        limit = c.reach * growth_at(most(age - piece * per_length, none)) + residual;  // at the start
      }
      V kept = share;
      if (any_lane(beyond)) {
        V reach = root(z_square) - residual;
        if (ages) reach = divide(reach, growth);
        const V left = least(survival(*law.survival, reach), c.left);
        kept = c.fresh * left;
        const Which gone = beyond & (is_negligible(j, kept, left) | (reach >= V(law.survival->high)));
        kept = select_lanes(beyond, select_lanes(gone, none, kept), share);
        put(columns.reach[j], select_lanes(beyond, reach, c.reach));
        put(columns.left[j], select_lanes(beyond, left, c.left));
        put(gone, columns.fresh[j], none);
        const V path = path_beyond(beyond, limit, piece, along, z_square);
        const V snapped_share = share - kept, of_gap = path * share_by_part(c, snapped_share, reach, left);
        lose(sums, j, snapped_share, select_lanes(beyond, of_gap, none), path, z, z_square);
      }
      sums.renewable = sums.renewable + kept * renewable_path(along, piece);
      sums.kept = sums.kept + kept;
      sums.moment = sums.moment + kept * c.position;
    }
    return sums;
  }
  /// Returns the share that snaps while the reach grows to `reach`, where the survival is `left`, times the
  /// mean part of the path that is after the snap. That is half if snap lengths are evenly distributed
  /// between the two reaches; the survival halfway tells how their density changes.
  [[gnu::always_inline]] V share_by_part(const Cohort& c, V share, V reach, V left) const {
    const V middle = least(most(survival(*law.survival, half * (c.reach + reach)), left), c.left);
    const V early = V(T(1.0 / 3)) * c.fresh * ((c.left - middle) - (middle - left));
    const V quarter = V(T(0.25)) * share;  // beyond that the variance of a linear density would be negative
    return half * share + least(most(early, none - quarter), quarter);
  }
  /// Returns the last part of a piece on which a deflection exceeds `limit`. Mostly that is the whole piece.
  [[gnu::always_inline]] V path_beyond(Which beyond, V limit, V piece, V along, V z_square) const {
    const Which starts_within = beyond & ((along + along - piece) * piece > z_square - limit * limit);
    if (!any_lane(starts_within)) return piece;
    const V across_square = most(z_square - along * along, none);
    const V path = along - root(most(limit * limit - across_square, none));
    return select_lanes(starts_within, least(most(path, none), piece), piece);
  }
  /// Returns the part of a path on which a bristle is bent along the motion by more than the residual length,
  /// and so can be renewed.
  [[gnu::always_inline]] V renewable_path(V along, V path) const {
    return least(most(along - residual, none), path);
  }

  /// Returns the path on which certainly no bristle snaps. Takes off more than the rounding of a deflection.
  V find_slack() const {
    V slack(T(1e30));
    for (std::uint32_t j = 0; j < used; ++j) {
      const Cohort c = cohort(j);
      const Vector z = end - c.position;
      const V reach = ages ? c.reach * growth_of(j) : c.reach;
      slack = least(slack, select_lanes(c.fresh > none, reach + residual - root(dot(z, z)), slack));
    }
    return most(slack - V(8 * eps), none);
  }

  // ----------------------------------------------------------------------------------------------- renewal

  /// Shared renewal of a piece: the hazard of a bristle that can be renewed along all of `path`; 0: none is.
  struct Renewal {
    V hazard = V(T(0)), path = V(T(0));
    V of_piece = V(T(0));  ///< hazard of the piece alone
  };
  /// Computes the hazard of renewal: the shared renewal times the share of the bristles that snapped, second
  /// snaps of newborn ones included. Half of it applies before the snaps, and who is renewed first does not
  /// snap (competing risks).
  Renewal find_renewal(Which snaps, V piece, const Sums& sums) {
    const V per_share(static_cast<T>(law.renewal));
    const V again = one - survival(*law.survival, fresh_reach(divide(sums.gap, most(sums.share, tiny))));
    const V damped =
        one - per_share * (again * divide(sums.renewable, most(piece, tiny)) - half * sums.share);
    Renewal renewal;
    renewal.of_piece = least(divide(per_share * (sums.share * (one + again)), most(damped, V(T(0.25)))),
                             V(T(highest_hazard_of_piece)));
    renewal.of_piece = select_lanes(snaps, renewal.of_piece, none);
    const V hazard = renewal.of_piece + get(*columns.owed);
    const V path = select_lanes(snaps, piece, none) + get(*columns.owed_path);
    const Which due = snaps & ((hazard > V(T(least_hazard))) | (path > V(T(longest_wait))));
    put(*columns.owed, select_lanes(due, none, hazard));
    put(*columns.owed_path, select_lanes(due, none, path));
    renewal.hazard = select_lanes(due, hazard, none);
    renewal.path = select_lanes(due, path, none);
    return renewal;
  }
  /// Renews bristles: of each cohort the share 1 - exp(-hazard x share of the path on which they can be
  /// renewed). Adds them to `sums`.
  void renew(const Renewal& renewal, Sums& sums) {
    const V per_path = divide(one, most(renewal.path, tiny)), quarter = V(T(0.25)) * renewal.hazard;
    sums.kept = none;
    sums.moment = zero();
    for (std::uint32_t j = 0; j < used; ++j) {
      const Cohort c = cohort(j);
      const Vector z = end - c.position;
      const V path = renewable_path(dot(z, e), renewal.path);
      const V q = quarter * (path * per_path), series = one - q * (one - half * q);
      V fresh = c.fresh * square(square(series));
      fresh = select_lanes(is_negligible(j, fresh * c.left, c.left), none, fresh);
      fresh = select_lanes((renewal.hazard > none) & (path > none), fresh, c.fresh);
      put(columns.fresh[j], fresh);
      const V kept = fresh * c.left;
      const V share = c.share() - kept;
      lose(sums, j, share, half * share * path, path, z, dot(z, z));
      sums.kept = sums.kept + kept;
      sums.moment = sums.moment + kept * c.position;
    }
  }

  // ------------------------------------------------------------------------------------------------- births

  /// Returns the reach of bristles that were bent from straight by `bent` at the speed of the step.
  V fresh_reach(V bent) const { return ages ? divide(bent, growth_at(bent * per_length)) : bent; }

  /// Makes a newborn cohort of the bristles that snapped or were renewed in a piece. `of_snaps`: share of
  /// those that snapped.
  void bear(Which snaps, V piece, const Renewal& renewal, V of_snaps, Sums& sums) {
    const V per_snapped = divide(one, most(sums.share, tiny)), gap = sums.gap * per_snapped;
    // Bristles whose new snap length is below the gap snap again. They count as one group.
    const V again = sums.share * (one - survival(*law.survival, fresh_reach(gap)));
    const V length = least(gap, half * (gap + low_reach)), after = gap - length;
    V mean_gap = gap - again * per_snapped * length;
    V gap_square = sums.gap_square - again * (gap * gap - (length * length + after * after));
    V last_square = sums.gap_square - again * (gap * gap - after * after);  // of the path since the last snap
    V of_second = again * (length * (length + residual + residual));        // twice the energy that they lose
    // Renewal reaches newborn bristles too: in proportion to their path, on average halfway along it.
    if (law.renewal > 0.0) {
      const V rate = divide(renewal.hazard, most(renewal.path, tiny));
      const V renewed = least(rate * sums.gap, half * sums.share);
      const V midway =
          least(half * least(divide(sums.gap_square, most(sums.gap, tiny)), piece), half * mean_gap);
      mean_gap = mean_gap - renewed * per_snapped * midway;
      gap_square = gap_square - renewed * (V(T(2)) * midway * midway);
      last_square = last_square - renewed * (V(T(3)) * midway * midway);
      of_second = of_second + renewed * (midway * (midway + residual + residual));
    }
    // The share is what the other cohorts do not keep, so that nothing is lost to rounding.
    const V share = most(one - sums.kept, none);
    const V variance = last_square - sums.share * mean_gap * mean_gap;  // share x variance of position
    if constexpr (books) {
      snapped =
          snapped + select_lanes(snaps, of_snaps * most(one - half * renewal.of_piece, none) + again, none);
      const V of_newborn = half * (sums.gap_square + gap_square) + residual * sums.gap;
      integral = integral + select_lanes(snaps, of_newborn * e - sums.gap_z, zero());
      const V along = dot(e, sums.gap_z);
      const V released =
          sums.z_square - (along + along) + sums.gap_square + of_second - sums.share * residual * residual;
      lost = lost + select_lanes(snaps, released, none);
    }
    const Vector straight = end - (mean_gap + residual) * e;
    put(snaps, columns.moment, sums.moment + share * straight);
    add_newborn(snaps, piece, mean_gap, share, variance, sums, per_snapped);
  }
  /// Adds the newborn bristles to the list. In a long piece they become straight at many positions; two
  /// cohorts that lie apart have the variance of these positions.
  void add_newborn(Which snaps, V piece, V gap, V share, V variance, const Sums& sums, V per_snapped) {
    const V usual(static_cast<T>(law.piece));
    const V rank = sums.rank * per_snapped, rank_square = sums.rank_square * per_snapped;
    const Which wide = snaps & (piece > V(T(wide_piece)) * usual);
    const auto newborn = [&](V its_share, V its_gap) {
      return typename Base::Newborn{
          its_share, end - (its_gap + residual) * e, most(fresh_reach(its_gap), low_reach), rank, rank_square,
          its_gap};
    };
    V apart = none;
    if (any_lane(wide)) {
      apart = select_lanes(wide, least(root(most(variance, none) * per_snapped), gap), none);
      share = select_lanes(wide, half * share, share);
      this->join(wide, wide, 0, newborn(share, gap + apart));
    }
    const Vector now = end - residual * e, moved = now - get(columns.begin[0]);
    const Which far = wide | (dot(moved, moved) > V(T(1.0001)) * usual * usual);
    const V since = select_lanes(wide, half * piece, piece);
    put(snaps & (far | !(get(columns.fresh[0]) > none)), columns.begin[0], now - since * e);
    this->join(snaps, far, 0, newborn(share, gap - apart));
    spread =
        spread +
        select_lanes(snaps, variance - select_lanes(wide, (share + share) * (apart * apart), none), none);
  }
};

}  // namespace
}  // namespace bristle::detail
