#include "core/patches/patch_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/common/assert.hpp"
#include "core/materials/elementary.hpp"

namespace bristle::detail {
namespace {

double find_damping(const Patch& p, const double (&velocity)[2]) noexcept {
  if (!p.damps || !(p.normal_load > 0.0)) return p.rest_damping;
  return damping_at(p, std::sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1]));
}

/// Returns the largest factor by which ageing can have lengthened a snap length of this patch by the end of a
/// step, from the bound on how long bristles can have been stuck.
double longest_growth(const Patch& p, const PatchStep& step) noexcept {
  return p.material().material.ageing_factor(step.ends - p.record->stuck.oldest);
}

/// Updates the bound on how long bristles of an ageing patch can have been stuck. A bristle snaps at the
/// latest when the patch has moved by twice its snap length, so a slide of that length makes all bristles
/// young again. Ignores bristles longer than the mean plus four standard deviations.
void note_slide(Patch& p, const PatchStep& step, double growth) noexcept {
  PatchRecord::Stuck& stuck = p.record->stuck;
  const double now =
      std::max(step.ends, stuck.since);  // the clock may lie a rounding error before the last step's end
  const CompiledMaterial& m = p.material();
  const SnapLength& law = m.material.snap_length;
  const double long_one = std::min((1.0 + 4.0 * law.cv()) * law.mean() * p.lengths_per_metre, m.longest);
  const double reach = 2.0 * (m.residual + long_one * growth);
  if (step.kernel.snaps_all || square(step.scaled[0]) + square(step.scaled[1]) > square(reach)) {
    stuck = {step.begins, now, {0, 0}};
    return;
  }
  // Adds up the displacements of the steps instead of comparing positions, because a contact model may move
  // the stored position of the patch.
  for (int axis = 0; axis < 2; ++axis) stuck.moved[axis] = sum_of(stuck.moved[axis], step.units[axis]);
  const double x = to_lengths(stuck.moved[0]), y = to_lengths(stuck.moved[1]);
  const double distance2 = x * x + y * y;
  // Share of the distance `reach` within which the patch counts as still where its bristles got stuck. A
  // later slide beyond `reach` sets stuck.oldest to the last time there, which is the end of a rest, not its
  // start.
  constexpr double near = 1.0 / 16;
  if (distance2 < square(near * reach)) {
    stuck.since = now;
  } else if (distance2 > square((1.0 + near) * reach)) {
    stuck = {stuck.since, now, {0, 0}};
  }
}

/// Calculates Response::force_limit, the highest elastic force, for a patch whose bristles age: the older
/// they can be, the higher.
double find_force_limit(const Patch& p, double growth) noexcept {
  const Material& m = p.material().material;
  const double residual = p.normal_load * m.bristles_in_contact(1.0) * m.bristle_stiffness *
                          m.residual_length * p.record->lay.strongest;
  return residual + growth * (p.force_limit - residual);
}

/// Length of a displacement (scaled; 2^20 units of position) below which a displacement counts as creep.
/// Rounding to fixed point may change a shorter one by more than 5e-7 of itself, so its remainder is added to
/// the next short one. Longer displacements drop theirs, so that most steps need no more memory than the
/// patch's slot.
constexpr double creep_length = 0x1p-24;

/// Returns whether a displacement has usual length. Rare cases are displacements so short that their rounding
/// remainder is added to the next one, and those so long that every bristle snaps.
bool is_usual(const Patch& p, const double (&displacement)[2]) noexcept {
  bool usual = true;
  for (const double x : displacement) {
    const double d = std::abs(x * p.lengths_per_metre);
    usual = usual && d <= far_length && (d >= creep_length || d == 0.0);
  }
  return usual;
}

/// Converts a displacement of unusual length for `step`: a very short one, whose rounding remainder is
/// kept, or a long one, in which all bristles snap.
[[gnu::noinline]] void find_odd_path(const Patch& p, PatchStep& step) noexcept {
  KernelStep& a = step.kernel;
  // Largest scaled displacement that is used, far beyond any snap length. Longer ones could make squares and
  // sums infinite.
  constexpr double farthest = 1e290;
  for (double& x : step.scaled) x = std::clamp(x, -farthest, farthest);
  const double largest = std::max(std::abs(step.scaled[0]), std::abs(step.scaled[1]));
  if (largest > far_length) {
    const double rx = step.scaled[0] / largest;
    const double ry = step.scaled[1] / largest;
    const double norm = std::sqrt(rx * rx + ry * ry);
    a.direction[0] = rx / norm;
    a.direction[1] = ry / norm;
    a.length = largest * norm;
    a.snaps_all = 1;
    for (int axis = 0; axis < 2; ++axis) step.units[axis] = 0;
    step.moves = true;
    return;
  }
  for (int axis = 0; axis < 2; ++axis) {
    double wanted = step.scaled[axis] * fixed_per_length;
    const bool creeps = std::abs(step.scaled[axis]) < creep_length && step.scaled[axis] != 0.0;
    if (creeps && !step.creeps) std::copy_n(p.record->remainder, 2, step.remainder);
    step.creeps = step.creeps || creeps;
    if (creeps) wanted += step.remainder[axis];
    step.units[axis] = std::llrint(wanted);
    if (creeps) step.remainder[axis] = wanted - static_cast<double>(step.units[axis]);
  }
}

/// Returns whether a step of the patch needs neither time, velocity nor direction, and can take the shortest
/// path through this file: the patch does not age or damp, has no lay (grain), and skips blocks within their
/// bounds.
bool is_plain(const Patch& p) noexcept {
  return p.skips && !p.ages && !p.damps && !p.laid && p.rest_damping == 0.0;
}

/// Displacement of a step, m, along axes in which friction is the same in all directions (LayMap).
struct Displacement {
  double by[2];
};
template <bool plain>
[[gnu::always_inline]] inline Displacement displacement_of(const Patch& p, const Motion& motion) noexcept {
  Displacement d{{motion.displacement[0], motion.displacement[1]}};
  if (!plain && p.laid) p.record->lay.to_isotropic(motion.displacement, d.by);
  return d;
}

/// Maps the sums of a step from isotropic axes to those of the patch, for a patch with a lay (grain). Where
/// energies differ between the axes, computes the dissipated energy as the step's work less the change of
/// stored energy.
[[gnu::noinline]] void map_sums(const Patch& p, const double (&displacement)[2], const PatchStep& step,
                                bool stuck, StepSums& sums) noexcept {
  const LayMap& lay = p.record->lay;
  lay.to_real_force(sums.end);
  lay.to_real_force(sums.twice_mean);
  if (stuck || !books_work(p)) return;
  double work = 0.0;
  for (int axis = 0; axis < 2; ++axis)
    work += 0.5 * p.newtons_per_unit * sums.twice_mean[axis] * displacement[axis];
  sums.dissipated = std::clamp(work + step.stored - p.model->stored_energy(p), 0.0, highest_energy);
}

/// Converts a motion to the input of a step; its load is applied already. `plain` and `usual` are the answers
/// of is_plain() and is_usual(), as constants, so that the compiler drops the cases that do not occur.
template <bool plain, bool usual>
[[gnu::always_inline]] inline void read_motion(const Patch& p, const double (&displacement)[2], double dt_s,
                                               bool stores, PatchStep& step) noexcept {
  KernelStep& a = step.kernel;
  a.start = a.rounding = step.begins = step.ends = 0.0;
  a.duration = dt_s;
  a.stores = stores ? 1 : 0;
  a.snaps_all = 0;
  step.creeps = false;
  if (!plain && p.ages) {
    // Shortens a step that is longer than the longest time, at which the clock stops. Otherwise bristles
    // would be younger at the start of the next step than at the end of this one.
    a.duration = std::min(dt_s, longest_time);
    if (p.record->clock != nullptr && stands_still(*p.record->clock))
      a.duration = std::numeric_limits<double>::min();
    a.start = step.begins = time_of(p);
    step.ends = step.begins + a.duration;
    a.rounding = rounding_of_times(step.ends, 1.0);
  }
  for (int axis = 0; axis < 2; ++axis) {
    step.scaled[axis] = displacement[axis] * p.lengths_per_metre;
    if (usual) step.units[axis] = std::llrint(step.scaled[axis] * fixed_per_length);
  }
  if (!usual) find_odd_path(p, step);
  for (int axis = 0; axis < 2; ++axis) {
    a.from[axis] = p.position[axis];
    a.to[axis] = sum_of(p.position[axis], step.units[axis]);
  }
  step.moves = a.snaps_all || (step.units[0] | step.units[1]) != 0;
}

/// Sets the constants of a step, all but the displacement. Assigns field by field, because g++ clears a whole
/// struct by `rep stos`, which takes longer.
void begin_kernel_step(const Patch& p, PatchStep& step) noexcept {
  KernelStep& a = step.kernel;
  a.residual = a.ageing_rate = a.ageing_strength = a.largest_growth = 0.0;
  a.energy_unit = 1.0;
  a.phase_key = 0;
  a.in_double = a.finds_bounds = a.ageing_form = 0;
  a.skips_blocks = p.skips && !a.snaps_all ? 1 : 0;
  static_assert(sizeof(KernelStep) == 160, "a new field of KernelStep: set it above");
  if (books_work(p)) step.stored = p.model->stored_energy(p);
}

/// Writes the response of a step. After a step that is stored also stores the numbers that answer a next step
/// at rest.
template <bool plain>
[[gnu::always_inline]] inline void write_response(Patch& p, const Motion& motion, double dt_s,
                                                  const PatchStep& step, bool stuck, StepSums& sums,
                                                  Response& out) noexcept {
  if (!plain && p.laid && !p.in_lane) map_sums(p, motion.displacement, step, stuck, sums);
  double elastic[2];  // copied, because a read of the response just written would wait for its stores

  // Subtracts from 0, so that the force of a straight patch is +0, not -0.
  for (int axis = 0; axis < 2; ++axis) elastic[axis] = 0.0 - p.newtons_per_unit * sums.end[axis];
  const double growth = !plain && p.ages ? longest_growth(p, step) : 1.0;
  const bool mean = has(p.outputs, Outputs::mean);
  const bool energy = has(p.outputs, Outputs::energy);
  double velocity[2] = {0.0, 0.0};
  if (!plain) find_velocity(motion, dt_s, velocity);
  const double damping = plain ? p.rest_damping : find_damping(p, velocity);
  out.status = p.overloaded ? Status::overload : Status::ok;
  double work = 0.0;
  for (int axis = 0; axis < 2; ++axis) {
    out.damper[axis] = 0.0 - damping * velocity[axis];
    out.elastic[axis] = elastic[axis];
    out.end[axis] = elastic[axis] + out.damper[axis];
    if (mean) out.mean[axis] = 0.0 - 0.5 * p.newtons_per_unit * sums.twice_mean[axis] + out.damper[axis];
    if (!plain)
      work -= std::clamp(out.damper[axis] * motion.displacement[axis], -highest_energy, highest_energy);
  }
  out.stiffness = p.stiffness;
  out.damping = damping;
  out.force_limit = !plain && p.ages ? find_force_limit(p, growth) : p.force_limit;
  if (energy) {
    out.dissipated = sums.dissipated + p.pending_dissipated;
    out.contact_loss = step.contact_loss + p.pending_loss;
    out.damper_work = work;
    out.snaps = sums.snaps + p.pending_snaps;
  }
  if (!step.kernel.stores) return;
  if (step.creeps) {
    p.record->remainder[0] = step.remainder[0];
    p.record->remainder[1] = step.remainder[1];
  }
  p.pending_dissipated = p.pending_loss = 0.0;
  p.pending_snaps = 0;
  p.elastic[0] = elastic[0];
  p.elastic[1] = elastic[1];
  p.snap_free = stuck;
  p.rests = plain || !p.ages;  // an ageing patch at rest must be stepped, because its force limit grows
  if (!plain && p.ages) note_slide(p, step, growth);
}

/// Steps a patch whose motion the bound on snapping does not answer: it leaves Patch::bound, has no known
/// bound, or has unusual length. Bristles have to be visited.
template <bool plain>
[[gnu::noinline]] std::uint64_t leave_bound(Patch& p, const Motion& motion, double dt_s, bool stores,
                                            double contact_loss, Response& out) noexcept {
  const Displacement d = displacement_of<plain>(p, motion);
  PatchStep step;
  step.contact_loss = contact_loss;
  if (is_usual(p, d.by))
    read_motion<plain, true>(p, d.by, dt_s, stores, step);
  else
    read_motion<plain, false>(p, d.by, dt_s, stores, step);
  StepSums sums;
  const Bound bound = find_bound(p, step);
  if (bound == Bound::none) {
    find_direction(step.kernel);
    begin_kernel_step(p, step);
    p.model->step_bristles(p, step, sums);
  } else {
    bend_without_snap(p, step.kernel, sums);
  }
  BRISTLE_ASSERT(p.in_contact() <= p.record->largest_work);
  const bool stuck = bound != Bound::none;
  write_response<plain>(p, motion, dt_s, step, stuck, sums, out);
  return sums.visited;
}

/// Steps a patch under the present load. Usually its motion stays in the ball within which no bristle snaps,
/// and the answer follows without a call of the contact model.
template <bool plain>
[[gnu::always_inline]] inline std::uint64_t take_step(Patch& p, const Motion& motion, double dt_s,
                                                      bool stores, double contact_loss,
                                                      Response& out) noexcept {
  const Displacement d = displacement_of<plain>(p, motion);
  if (p.known != Bound::ball || !is_usual(p, d.by))
    return leave_bound<plain>(p, motion, dt_s, stores, contact_loss, out);
  PatchStep step;
  step.contact_loss = contact_loss;
  read_motion<plain, true>(p, d.by, dt_s, stores, step);
  if (find_bound(p, step) == Bound::none)
    return leave_bound<plain>(p, motion, dt_s, stores, contact_loss, out);
  StepSums sums;
  bend_without_snap(p, step.kernel, sums);
  write_response<plain>(p, motion, dt_s, step, true, sums, out);
  return 0;
}

/// Whether the lane counts times from a time of its own (LaneRecord::times_from).
bool has_own_time(const Patch& p) noexcept { return p.ages && lane_of(p).block->follow_time != nullptr; }

/// Lets the lane of a patch without load count times from the step that begins, so that its next contact has
/// the bits of any other one.
void begin_time(const Patch& p) noexcept {
  LaneRecord& r = lane_of(p);
  if (has_own_time(p) && !(p.normal_load > 0.0)) r.times_from = r.clock == nullptr ? 0 : *r.clock - r.epoch;
}

/// Writes a motion to the input columns `to`, in the patch's lane.
[[gnu::always_inline]] inline void write_motion(const Patch& p, const Motion& motion, double load,
                                                double dt_s, std::uint32_t lane, LaneMotions& to) noexcept {
  to.set(lane, motion.displacement, load, dt_s);
  if (p.ages) {
    PatchStep step;
    read_motion<false, false>(p, displacement_of<false>(p, motion).by, dt_s, true, step);
    const bool begins = has_own_time(p) && !(p.normal_load > 0.0);
    to.start.lane[lane] = begins ? 0.0 : lane_time(p);
    to.duration = step.kernel.duration;
  }
}

/// Writes the response to a motion of a patch in a lane, under the load that was written with the motion.
template <bool plain>
[[gnu::always_inline]] inline void answer(Patch& p, const Motion& motion, double dt_s, bool stores,
                                          const LaneAnswers& answers, Response& out) noexcept {
  const std::uint32_t lane = lane_of(p).lane;
  PatchStep step;
  if constexpr (plain) {
    step.kernel.stores = stores ? 1 : 0;
  } else {
    read_motion<false, false>(p, displacement_of<false>(p, motion).by, dt_s, stores, step);
  }
  step.creeps = false;  // a contact in a lane has no position that could lose a remainder
  StepSums sums;
  for (int axis = 0; axis < p.axes; ++axis) sums.end[axis] = 0.0 - answers.end[axis].lane[lane];
  if (p.outputs != Outputs::end) {
    for (int axis = 0; axis < p.axes; ++axis) sums.twice_mean[axis] = -2.0 * answers.mean[axis].lane[lane];
    step.contact_loss = answers.contact_loss.lane[lane];
    sums.dissipated = answers.dissipated.lane[lane];
    sums.snaps = static_cast<std::uint64_t>(answers.slid.lane[lane]);
  }
  p.stiffness = answers.stiffness.lane[lane];
  if (p.laid) p.stiffness *= p.record->lay.stiffest;
  write_response<plain>(p, motion, dt_s, step, false, sums, out);
  if (!plain && stores && has_own_time(p)) lane_of(p).block->follow_time(p);
}

double apply_load(Patch& p, const Motion& motion) noexcept {
  return motion.normal_load != p.normal_load ? p.model->apply_load(p, motion.normal_load) : 0.0;
}

}  // namespace

bool is_good_motion(int axes, const Motion& motion) noexcept {
  const bool finite = std::isfinite(motion.displacement[0]) && std::isfinite(motion.displacement[1]) &&
                      motion.normal_load >= 0.0 && motion.normal_load <= highest_load;
  if (!finite) return false;
  // Refuses motion along the second axis of a patch that has only one axis, as bad input.
  const bool planar = axes == 1;
  if (planar && motion.displacement[1] != 0.0) return false;
  if (motion.has_velocity)
    return std::isfinite(motion.velocity[0]) && std::isfinite(motion.velocity[1]) &&
           !(planar && motion.velocity[1] != 0.0);
  return true;
}

std::uint64_t step_patch(Patch& p, const Motion& motion, double dt_s, Response& out) noexcept {
  const double contact_loss = apply_load(p, motion);
  if (is_plain(p)) return take_step<true>(p, motion, dt_s, true, contact_loss, out);
  return take_step<false>(p, motion, dt_s, true, contact_loss, out);
}

void try_step(Patch& p, const Motion& motion, double dt_s, double contact_loss, Response& out) noexcept {
  take_step<false>(p, motion, dt_s, false, contact_loss, out);
}

void assign_motion(const Patch& p, const Motion& motion, double dt_s) noexcept {
  begin_time(p);
  write_motion(p, motion, motion.normal_load, dt_s, lane_of(p).lane, lane_of(p).block->motions);
}
void answer_motion(Patch& p, const Motion& motion, double dt_s, const LaneAnswers& answers,
                   Response& out) noexcept {
  if (motion.normal_load != p.normal_load) set_load(p, motion.normal_load);
  if (is_plain(p)) return answer<true>(p, motion, dt_s, true, answers, out);
  answer<false>(p, motion, dt_s, true, answers, out);
}

void step_lane(Patch& p, const Motion& motion, double dt_s, bool stores, Response& out) noexcept {
  const LaneRecord& r = lane_of(p);
  if (stores) begin_time(p);
  LaneMotions alone;
  write_motion(p, motion, motion.normal_load, dt_s, r.lane, alone);
  LaneAnswers answers;
  r.block->run(*r.block, alone.input(stores), answers.columns());
  if (motion.normal_load != p.normal_load) set_load(p, motion.normal_load);
  answer<false>(p, motion, dt_s, stores, answers, out);
}

std::uint32_t begin_step(Patch& p, const Motion& motion, double dt_s, PatchStep& step) noexcept {
  step.contact_loss = apply_load(p, motion);
  read_motion<false, false>(p, displacement_of<false>(p, motion).by, dt_s, true, step);
  if (find_bound(p, step) != Bound::none) return 0;
  find_direction(step.kernel);
  begin_kernel_step(p, step);
  return p.model->shared->prepare(p, step);
}

std::uint64_t end_step(Patch& p, const Motion& motion, double dt_s, const PatchStep& step,
                       const Totals* totals, Response& out) noexcept {
  StepSums sums;
  if (totals == nullptr)
    bend_without_snap(p, step.kernel, sums);
  else
    p.model->shared->finish(p, step, *totals, sums);
  write_response<false>(p, motion, dt_s, step, totals == nullptr, sums, out);
  return sums.visited;
}

bool needs_copy(const Patch& p, const Motion& motion) noexcept {
  if (!p.renews && !books_work(p)) return false;
  PatchStep step;
  read_motion<false, false>(p, displacement_of<false>(p, motion).by, 1.0, false, step);
  return find_bound(p, step) == Bound::none;
}

void copy_stuck_time(Patch& to, const Patch& from) noexcept {
  to.record->stuck = {};
  if (from.ages)
    to.record->stuck = {from.record->stuck.oldest, std::max(time_of(to), from.record->stuck.since), {0, 0}};
}

void write_refusal(Outputs computed, Status status, Response& out) noexcept {
  out.status = status;
  write_still(computed, {0.0, 0.0}, out);
  out.stiffness = out.damping = out.force_limit = 0.0;
}

}  // namespace bristle::detail
