// Steps an infinite brush: decides which part of a path the kernels follow cohort by cohort, and which part
// needs no cohorts.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {
namespace {

// Distance of the patch from the base of its cohorts' places, scaled, above which the base is moved to the
// patch.
constexpr double farthest_base = 16.0;
constexpr double straight = 0x1p-12;   // sine of the largest angle by which a straight slide may turn
constexpr double longest_step = 1e16;  // time longer than any clock runs for, s
// Largest relative change of speed with which the slide of an ageing patch counts as the same slide.
constexpr double same_speed = 0x1p-8;

/// Returns the middle of a step along an axis. A ball about the middle contains both ends of the step, so a
/// patch that moves to and fro stays within one bound.
std::int64_t middle(const Patch& p, const Advance& a, int axis) noexcept {
  return sum_of(p.position[axis], difference(a.to[axis], p.position[axis]) / 2);
}

/// Returns whether a step continues the present slide at its speed and without a rest. If not, the bristles'
/// ages differ from those in steady sliding.
bool same_pace(const CohortAgeing& ageing, const CohortTimes& times, double duration) noexcept {
  return std::abs(times.per_length - ageing.per_length) <= same_speed * times.per_length &&
         times.now - ageing.until <= same_speed * duration;
}

/// Returns the length of the straight slide that a step of an ageing patch continues; 0: the step begins a
/// new slide.
double find_straight_run(const Patch& p, const Cohorts& r, const Advance& a) noexcept {
  const double across = a.direction[0] * r.direction[1] - a.direction[1] * r.direction[0];
  const double along = a.direction[0] * r.direction[0] + a.direction[1] * r.direction[1];
  const bool goes_on = std::abs(across) <= straight && along > 0.0 && p.position[0] == r.slid_to[0] &&
                       p.position[1] == r.slid_to[1];
  return goes_on ? r.run : 0.0;
}

/// Plan for a step in which bristles may snap: which part of its path is followed piece by piece, and where
/// it ends.
struct Slide {
  CohortMove move;  ///< move of the cohorts in the kernels; its times are filled if the material ages
  std::int64_t to[2];
  double run = 0.0;       ///< length of the slide that this step continues, in scaled lengths
  Course course;          ///< recent path of the patch after this step, if the patch may glide
  double followed = 0.0;  ///< part of the step's path that is computed in pieces, scaled
  /// Least length, scaled, of a followed path after which the state does not depend on the state at its
  /// start.
  double forget = 0.0;
  double carried = 0.0;  ///< part of the path along which cohorts move with the patch unchanged, scaled

  // Values that only ageing patches have:
  double oldest = 0.0;  ///< time when the oldest cohort was last straight, at the slide's start
  /// Factor by which ageing lengthens the path that is needed to forget: the growth of the oldest cohort's
  /// snap lengths up to the end of the slide.
  double growth = 1.0;
};

/// Fills in, for a patch that ages, the times of the move, the oldest birth and the growth of snap lengths.
[[gnu::noinline]] void age(const Patch& p, const Cohorts& r, const Advance& a, Slide& slide) noexcept {
  CohortTimes& times = slide.move.times;
  times = times_of(p);
  const double duration = std::min(a.duration, longest_step);
  times.per_length = duration / a.length;
  if (!same_pace(*r.ageing, times, duration)) slide.run = 0.0;
  slide.oldest = slide.run > 0.0 ? r.ageing->oldest : find_oldest(r);
  if (slide.run < r.follow)
    slide.growth = r.material->material.ageing_factor(times.now + duration - slide.oldest);
}

/// Finds the length of the slide that a step continues, on a path that may turn. For patches that may glide
/// (slide steadily along a bent path, glide.hpp).
void find_run(const Patch& p, const Cohorts& r, const Advance& a, Slide& slide) noexcept {
  slide.course = r.glide;
  const bool goes_on = p.position[0] == r.slid_to[0] && p.position[1] == r.slid_to[1] && r.run > 0.0 &&
                       go_on(r, a.direction, a.length, slide.course);
  slide.run = goes_on ? r.run : 0.0;
  if (!goes_on) begin_course(a.direction, a.length, slide.course);
}

/// Returns whether this step turns off the line of the last one. It is false for a patch that may not glide
/// on bent paths.
bool turns(const Cohorts& r, const Advance& a) noexcept {
  const double(&before)[2] = r.glide.direction;
  return r.glides && std::abs(before[0] * a.direction[1] - before[1] * a.direction[0]) > 0x1p-20;
}

/// Returns the path after which a step has forgotten its start, under shared renewal and without ageing.
/// Bristles bent against `direction` must unbend first, which takes 1.5 times their mean deflection. Bristles
/// bent aside snap sooner than straight ones, and need no extra path.
double find_forgetting_path(const Patch& p, const Cohorts& r, const CohortState& s, const double* rows,
                            const double (&direction)[2]) noexcept {
  const double at = place(p, s, 0) * direction[0] + place(p, s, 1) * direction[1];
  double back = 0.0;
  for (std::uint32_t i = 0; i < s.count; ++i)
    back +=
        mass_of(rows, i) *
        std::max(entry(rows, i, cohort_x) * direction[0] + entry(rows, i, cohort_y) * direction[1] - at, 0.0);
  return std::min(r.forget + 1.5 * back / s.mass, r.follow);
}

Slide find_slide(const Patch& p, const Cohorts& r, const Advance& a, const CohortState& s,
                 const double* rows) noexcept {
  Slide slide;
  if (r.glides) find_run(p, r, a, slide);
  if (r.ageing != nullptr) {
    slide.run = find_straight_run(p, r, a);
    age(p, r, a, slide);
  }
  double followed = std::max(r.follow - slide.run, 0.0) * slide.growth;
  // Follows in pieces the whole path that bristles remember if the path turns in this step. A glide that
  // begins after the step then depends on this step alone.
  if (slide.run > 0.0 && turns(r, a)) followed = std::max(followed, r.long_step);
  slide.forget = r.follow * slide.growth;
  // Looks for a shorter forgetting path, unless the step is at least `follow` long and nothing is renewed:
  // such a step forgets its start by its length alone.
  const bool may_forget =
      r.forget > 0.0 && a.length >= r.forget && (r.law.renewal > 0.0 || a.length < r.follow);
  if (followed > 0.0 && may_forget) {
    slide.forget = find_forgetting_path(p, r, s, rows, a.direction);
    if (a.length >= slide.forget) followed = slide.forget;
  }
  followed = std::min(a.length, followed);
  slide.carried = a.length - followed;
  slide.move.length = slide.followed = followed;
  for (int axis = 0; axis < 2; ++axis) {
    slide.move.direction[axis] = a.direction[axis];
    slide.move.from[axis] = place(p, r, axis);
    slide.to[axis] = a.to[axis];
    // Computes the position from length and direction, because a far step has no displacement in fixed point.
    if (slide.carried > 0.0 || a.snaps_all != 0)
      slide.to[axis] = sum_of(p.position[axis], std::llrint(a.direction[axis] * followed * fixed_per_length));
    slide.move.to[axis] = to_lengths(difference(slide.to[axis], r.base[axis]));
  }
  return slide;
}

/// Moves the base of the cohorts' places close to the patch, so that places stay small. `to`: position of the
/// patch relative to the base.
void follow(CohortState& s, double* rows, double (&to)[2]) noexcept {
  for (int axis = 0; axis < 2; ++axis) {
    if (std::abs(to[axis]) <= farthest_base) continue;
    const double shift = std::floor(to[axis]);
    to[axis] -= shift;
    s.base[axis] = sum_of(s.base[axis], std::llrint(shift * fixed_per_length));
    s.moment[axis] -= shift * s.mass;
    for (auto& begin : s.begin) begin[axis] -= shift;
    for (std::uint32_t i = 0; i < s.count; ++i) entry(rows, i, axis == 0 ? cohort_x : cohort_y) -= shift;
  }
}

/// Returns the sum of deflections rounded to double; deflections_at() gives the exact sum in 128 bits.
double whole_deflections(const CohortState& s, double at, int axis) noexcept {
  const double sum = (s.mass * at - s.moment[axis]) * sum_per_mass_length;
  return std::abs(sum) < 9e18 ? static_cast<double>(std::llrint(sum)) : sum;
}

/// Returns the number of snaps of a bristle per scaled length in this slide; from the cache if the speed is
/// that of the last slide.
double snap_rate_of(const Cohorts& r, const Slide& slide) noexcept {
  if (r.ageing == nullptr) return r.law.snap_rate;
  CohortAgeing& ageing = *r.ageing;
  CohortTimes times = slide.move.times;
  if (slide.run > 0.0) times.per_length = ageing.per_length;
  if (ageing.rate_per_length != times.per_length) {
    ageing.rate_per_length = times.per_length;
    ageing.snap_rate = find_snap_rate(r, times);
  }
  return ageing.snap_rate;
}

/// Returns the place, in the table of kernels, of those for this law: plain (0), with residual or shared
/// renewal (2), or with ageing (4).
int kind_of(const Cohorts& r) noexcept {
  if (r.ageing != nullptr) return 4;
  return r.rubs() ? 2 : 0;
}

/// Steps a part of the path in short moves until the force is steady, or for some three mean snap lengths,
/// after which the cohorts may be moved along unchanged. Between snaps of cohorts the force rises, so a move
/// ends where the force would reach its steady value. The length of a move is limited, so that moves and
/// snaps of cohorts do not fall into a common rhythm.
void settle(const Patch& p, const Cohorts& r, CohortState& s, double* rows, Slide& slide,
            CohortTotals& t) noexcept {
  // Length of a move over that of a piece of path. Cohorts lie a piece apart, so this odd share keeps moves
  // out of step with their snaps.
  constexpr double share = 0.38;
  constexpr int most = 64;
  CohortMove& move = slide.move;
  move.books = p.outputs != Outputs::end;
  for (int i = 0; i < most && slide.carried > 0.0; ++i) {
    const double z[2] = {move.to[0] - s.moment[0] / s.mass, move.to[1] - s.moment[1] / s.mass};
    const double lack = find_lack(r, z[0], z[1], slide.course.curve);
    if (lack == 0.0) return;
    move.length = std::min(share * r.law.piece, slide.carried);
    if (lack > 0.0) move.length = std::min(move.length, lack);
    slide.followed += move.length;
    slide.carried -= move.length;
    for (int axis = 0; axis < 2; ++axis) {
      move.from[axis] = move.to[axis];
      slide.to[axis] =
          sum_of(slide.to[axis], std::llrint(move.direction[axis] * move.length * fixed_per_length));
      move.to[axis] = to_lengths(difference(slide.to[axis], r.base[axis]));
    }
    r.kernels->move[p.axes - 1 + kind_of(r)](r.law, s, rows, move, t);
  }
}

/// Adds deflection integral, dissipated energy and snaps of that part of the path along which cohorts move
/// with the patch and all deflections stay as they are.
void carry(const Cohorts& r, const CohortState& s, const Slide& slide, CohortTotals& t) noexcept {
  const double far = std::min(slide.carried, 1e140);  // limits the path so that products stay finite
  for (int axis = 0; axis < 2; ++axis) {
    const double work = far * (s.mass * slide.move.to[axis] - s.moment[axis]);
    t.integral[axis] += work;
    t.lost += 2.0 * work * slide.move.direction[axis];
  }
  t.snapped += s.mass * (far * snap_rate_of(r, slide));
}

/// Stores speed and time of a committed step of an ageing patch. The next step finds by them whether it
/// continues the slide.
void note_pace(const Patch& p, Cohorts& r, const Slide& slide) noexcept {
  CohortAgeing& ageing = *r.ageing;
  // Moves all births later by the time of that part of the path on which cohorts keep their ages. It is
  // enough to move their base.
  const double carried = slide.carried * slide.move.times.per_length;
  ageing.base += static_cast<Int128>(carried * clock_units_per_second);
  if (slide.run == 0.0) {
    ageing.per_length = slide.move.times.per_length;
    ageing.oldest = slide.oldest;
  }
  ageing.until = slide.move.times.now + slide.move.length * slide.move.times.per_length;
  follow_time(p);
}

void write_sums(const Patch& p, const CohortState& s, const Slide& slide, const CohortTotals& t,
                StepSums& sums) noexcept {
  const bool mean = has(p.outputs, Outputs::mean);
  const double length = slide.followed + std::min(slide.carried, 1e140);
  for (int axis = 0; axis < p.axes; ++axis) {
    sums.end[axis] = whole_deflections(s, slide.move.to[axis], axis);
    if (mean) sums.twice_mean[axis] = 2.0 * (t.integral[axis] / length) * (fixed_per_length / mass_per_count);
  }
}

/// Returns the whole number of snaps to report, and keeps the fraction in `rest` for the next step.
std::uint64_t count_snaps(double snapped, double& rest) noexcept {
  const double all = std::min(snapped + rest, 9e18);
  const double whole = std::floor(all);
  rest = all - whole;
  return static_cast<std::uint64_t>(whole);
}

/// Steps an infinite brush. `state`, `rows`, `births`: its own cohorts, or a copy of them for a trial.
void advance(Patch& p, PatchStep& step, CohortState& state, double* rows, double* births,
             StepSums& sums) noexcept {
  Cohorts& r = cohorts(p);
  const Advance& a = step.advance;
  const bool commit = a.commit != 0;
  Slide slide = find_slide(p, r, a, state, rows);
  if (a.snaps_all != 0 && slide.carried == 0.0)
    for (int axis = 0; axis < 2; ++axis) step.advance.to[axis] = slide.to[axis];
  CohortTotals totals{};
  bool forgets = false;

  slide.move.times.births = births;
  if (slide.move.length > 0.0) {
    slide.move.books = p.outputs != Outputs::end;
    forgets = is_forgetful(slide.move, slide.forget);
    if (!forgets || needs_pieces(r, slide.move))
      r.kernels->move[p.axes - 1 + kind_of(r)](r.law, state, rows, slide.move, totals);
    if (forgets) slide_far(r, state, rows, slide.move, totals);
    // Handles a step in which no bristle snapped, although the bound did not exclude it: the step only renews
    // the bound.
    if (totals.pieces == 0 && slide.carried == 0.0) {
      if (commit) note_bound(p, {{middle(p, a, 0), middle(p, a, 1)}, state.slack - bound_margin});
      bend_without_snap(p, a, sums);
      sums.visited = r.count;
      return;
    }
  }
  if (slide.carried > 0.0 && r.glides && !r.material->survival().smooth)
    settle(p, r, state, rows, slide, totals);
  if (slide.carried > 0.0) carry(r, state, slide, totals);
  follow(state, rows, slide.move.to);
  write_sums(p, state, slide, totals, sums);
  sums.visited = r.count;
  double rest = r.snap_fraction;
  if (has(p.outputs, Outputs::energy)) {
    sums.dissipated = std::min(joules_per_unit(p) * totals.lost, highest_energy);
    sums.snaps = count_snaps(totals.snapped / r.units_per_bristle(), rest);
  }
  if (!commit) return;
  r.snap_fraction = rest;
  if (r.ageing != nullptr) note_pace(p, r, slide);
  if (r.glides) static_cast<Course&>(r.glide) = slide.course;
  r.run = std::min(slide.run + (r.ageing != nullptr ? a.length / slide.growth : a.length), r.follow);
  if (forgets) r.run = r.follow;
  for (int axis = 0; axis < 2; ++axis) {
    if (slide.run == 0.0) r.direction[axis] = a.direction[axis];
    p.position[axis] = r.slid_to[axis] = p.part_position[axis] = slide.to[axis];
    p.part_sum[axis] = 0;
    // Computes the place from the fixed-point position, as a restored patch does. slide.move.to is rounded if
    // it is far from the base.
    p.sum[axis] = axis < p.axes ? deflections_at(r, place(p, r, axis), axis) : 0;
  }
  p.known = Bound::none;
  p.fetched_lines = r.fetched_lines();
}

/// Steps a copy of the cohorts in a trial step, so that the patch stays as it is. Copies only the rows in use
/// and one more, in which a new cohort fits.
void advance_copy(Patch& p, PatchStep& step, StepSums& sums) noexcept {
  const Cohorts& r = cohorts(p);
  CohortState state = r;
  Patch held = p;
  alignas(64) double rows[most_cohorts * cohort_columns];
  const std::uint32_t numbers = std::min(r.used_numbers() + cohort_row, r.capacity * cohort_columns);
  std::memcpy(rows, r.rows, numbers * sizeof(double));
  // Empties the rows that are not copied, because a trial step may make more cohorts than fit into the copied
  // rows.
  for (std::uint32_t i = numbers / cohort_columns; i < r.capacity; ++i) clear_lane(rows, i);
  alignas(64) double births[most_cohorts];
  if (r.ageing != nullptr) std::memcpy(births, r.births(), r.capacity * sizeof(double));
  if (r.glide.on != 0) {
    write_glide(p, state, rows);
    for (int axis = 0; axis < p.axes; ++axis)
      held.sum[axis] = deflections_at(state, place(p, state, axis), axis);
  }
  advance(held, step, state, rows, r.ageing != nullptr ? births : nullptr, sums);
}

}  // namespace

void advance_cohorts(Patch& p, PatchStep& step, StepSums& sums) noexcept {
  Cohorts& r = cohorts(p);
  if (r.count == 0)  // out of contact no bristle can snap, so any motion is answered at once
    bend_without_snap(p, step.advance, sums);
  else if (try_glide(p, step.advance, sums))
    return;
  else if (step.advance.commit != 0) {
    end_glide(p);
    advance(p, step, r, r.rows, r.ageing != nullptr ? r.births() : nullptr, sums);
  } else {
    advance_copy(p, step, sums);
  }
}

}  // namespace bristle::detail
