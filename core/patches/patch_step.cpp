#include "core/patches/patch_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/common/assert.hpp"
#include "core/materials/elementary.hpp"
#include "core/patches/contact_model.hpp"

namespace bristle::detail {
namespace {

/// Damper, lubricant and strengthening with speed of the whole patch, N s/m: what times the velocity is their
/// force.
double damping_at(const Patch& p, double speed) noexcept {
  const Material& m = p.material().material;
  return p.zeta * m.damping_at(speed) + m.viscous_friction + p.normal_load * m.strengthening_damping(speed);
}
double find_damping(const Patch& p, const double (&velocity)[2]) noexcept {
  if (!p.damps || !(p.normal_load > 0.0)) return p.rest_damping;
  return damping_at(p, std::sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1]));
}

/// Largest ratio of aged to fresh snap lengths in a patch at the end of a step.
double longest_growth(const Patch& p, const PatchStep& step) noexcept {
  return p.material().material.ageing_factor(step.ends - p.record->hold.oldest);
}

/// Notes how long bristles of a patch that ages may have held: no bristle follows the patch farther than
/// twice its snap length. Ignores bristles longer than the mean plus four standard deviations. They carry
/// 0.5 % of the force at cv 0.3 (lognormal) and 6 % at cv 1.
void note_slide(Patch& p, const PatchStep& step, double growth) noexcept {
  PatchRecord::Hold& hold = p.record->hold;
  const double now =
      std::max(step.ends, hold.since);  // the clock may be a rounding behind the last step's end
  const CompiledMaterial& m = p.material();
  const SnapLength& law = m.material.snap_length;
  const double long_one = std::min((1.0 + 4.0 * law.cv()) * law.mean() * p.lengths_per_metre, m.longest);
  const double reach = 2.0 * (m.residual + long_one * growth);
  if (step.advance.snaps_all || square(step.scaled[0]) + square(step.scaled[1]) > square(reach)) {
    hold = {step.begins, now, {0, 0}};
    return;
  }
  // Sums displacements of its own, because a contact model may carry the patch's position along.
  for (int axis = 0; axis < 2; ++axis) hold.way[axis] = sum_of(hold.way[axis], step.units[axis]);
  const double x = to_lengths(hold.way[0]), y = to_lengths(hold.way[1]);
  const double way2 = x * x + y * y;
  // A patch within this share of the reach counts as at its anchor, so that after a rest only the slide
  // counts.
  constexpr double near = 1.0 / 16;
  if (way2 < square(near * reach)) {
    hold.since = now;
  } else if (way2 > square((1.0 + near) * reach)) {
    hold = {hold.since, now, {0, 0}};
  }
}

/// Response::force_limit of a patch that ages.
double find_force_limit(const Patch& p, double growth) noexcept {
  const Material& m = p.material().material;
  const double residual =
      p.normal_load * m.bristles_in_contact(1.0) * m.bristle_stiffness * m.residual_length;
  return residual + growth * (p.force_limit - residual);
}

/// Rounding a displacement shorter than this (scaled; 2^20 position units) may err by more than 5e-7 of it,
/// so its remainder is carried to the next one. The remainder of a longer displacement is dropped: most steps
/// then need the patch's slot alone.
constexpr double creep_length = 0x1p-24;

/// Rounds a scaled displacement to position units; a short one includes the carried remainder.
std::int64_t find_units(const Patch& p, double scaled, int axis, PatchStep& step) noexcept {
  const double units = scaled * fixed_per_length;
  if (!(std::abs(scaled) < creep_length) || scaled == 0.0) return std::llrint(units);
  if (!step.creeps) {
    step.creeps = true;
    step.remainder[0] = p.record->remainder[0];
    step.remainder[1] = p.record->remainder[1];
  }
  const double wanted = units + step.remainder[axis];
  const std::int64_t moved = std::llrint(wanted);
  step.remainder[axis] = wanted - static_cast<double>(moved);
  return moved;
}

/// Advance{}, field by field: g++ clears the whole by `rep stos`, which takes longer than these.
void clear(Advance& a) noexcept {
  for (int axis = 0; axis < 2; ++axis) {
    a.from[axis] = a.to[axis] = 0;
    a.direction[axis] = 0.0;
  }
  a.length = a.residual = a.start = a.duration = a.rounding = a.energy_unit = 0.0;
  a.phase_key = 0;
  a.snaps_all = a.in_double = a.skips_blocks = a.renews_bounds = a.commit = 0;
  a.ageing_rate = a.ageing_strength = a.largest_growth = 0.0;
  a.ageing_form = 0;
  static_assert(sizeof(Advance) == 160, "a new field of Advance: clear it above");
}

/// Where the motion leads, in scaled lengths.
void find_way(const Patch& p, const double (&displacement)[2], PatchStep& step) noexcept {
  Advance& a = step.advance;
  for (int axis = 0; axis < 2; ++axis) a.from[axis] = a.to[axis] = p.position[axis];

  // Clamped so that squares and sums stay finite: no snap length is near.
  constexpr double farthest = 1e290;
  double(&d)[2] = step.scaled;
  for (int axis = 0; axis < 2; ++axis)
    d[axis] = std::clamp(displacement[axis] * p.lengths_per_metre, -farthest, farthest);
  const double largest = std::max(std::abs(d[0]), std::abs(d[1]));
  if (!(largest > 0.0)) return;
  if (largest > far_length && !p.literal) {
    const double rx = d[0] / largest;
    const double ry = d[1] / largest;
    const double norm = std::sqrt(rx * rx + ry * ry);
    a.direction[0] = rx / norm;
    a.direction[1] = ry / norm;
    a.length = largest * norm;
    a.snaps_all = 1;
    step.moves = true;
    return;
  }
  // The literal rule forgets how far it went: this far already resets every bristle.
  if (largest > far_length)
    for (double& x : d) x *= far_length / largest;
  double moved[2];
  for (int axis = 0; axis < 2; ++axis) {
    const std::int64_t fixed = step.units[axis] = find_units(p, d[axis], axis, step);
    a.to[axis] = sum_of(p.position[axis], fixed);
    moved[axis] = to_lengths(fixed);
  }
  step.moves = moved[0] != 0.0 || moved[1] != 0.0;
}

}  // namespace

void find_direction(Advance& a) noexcept {
  if (a.snaps_all) return;
  double moved[2];
  for (int axis = 0; axis < 2; ++axis) moved[axis] = to_lengths(difference(a.to[axis], a.from[axis]));
  a.length = std::sqrt(moved[0] * moved[0] + moved[1] * moved[1]);
  a.direction[0] = moved[0] / a.length;
  a.direction[1] = moved[1] / a.length;
}

bool is_good_motion(const Patch& patch, const Motion& motion) noexcept {
  const bool finite = std::isfinite(motion.displacement[0]) && std::isfinite(motion.displacement[1]) &&
                      motion.normal_load >= 0.0 && motion.normal_load <= highest_load;
  if (!finite) return false;
  // A motion along an axis that the patch lacks would be lost without a word.
  const bool planar = patch.axes == 1;
  if (planar && motion.displacement[1] != 0.0) return false;
  if (motion.has_velocity)
    return std::isfinite(motion.velocity[0]) && std::isfinite(motion.velocity[1]) &&
           !(planar && motion.velocity[1] != 0.0);
  return true;
}

PatchStep read_motion(const Patch& p, const Motion& motion, double dt_s, bool commit) noexcept {
  PatchStep step;
  clear(step.advance);
  for (int axis = 0; axis < 2; ++axis) {
    step.remainder[axis] = 0.0;
    step.displacement[axis] = motion.displacement[axis];
    // Clamped so that its square is finite, whatever the step length (a denormal one reads as 0 here).
    const double v =
        motion.has_velocity ? motion.velocity[axis] : motion.displacement[axis] / std::max(dt_s, 1e-300);
    step.velocity[axis] = std::clamp(v, -1e150, 1e150);
  }
  step.advance.commit = commit ? 1 : 0;
  step.advance.energy_unit = 1.0;
  step.advance.duration = dt_s;
  if (p.ages) {
    // As much as the clock will run on: what a bristle aged in a step it must not lose again.
    step.advance.duration = std::min(dt_s, longest_time);
    if (p.record->clock != nullptr && stands_still(*p.record->clock))
      step.advance.duration = std::numeric_limits<double>::min();
    step.advance.start = step.begins = time_of(p);
    step.ends = step.begins + step.advance.duration;
    step.advance.rounding = rounding_of_times(step.ends, 1.0);
  }
  find_way(p, step.displacement, step);
  step.advance.skips_blocks = p.skips && !step.advance.snaps_all ? 1 : 0;
  return step;
}

namespace {

/// Carries all bristles along an axis and returns their new whole sum. `end`: the sum of deflections there;
/// with `mean`, `twice_mean` is twice the mean over the path.
[[gnu::always_inline]] inline Int128 carry_along(const Patch& p, int axis, std::int64_t from, std::int64_t to,
                                                 bool mean, double& end, double& twice_mean) noexcept {
  const Int128 whole = p.sum[axis] + Int128{p.whole} * difference(to, from);
  Int128 sum = whole;
  Int128 twice = p.sum[axis] + whole;
  if (p.part > 0.0) {
    const Int128 after = weighted(p.part, difference(to, p.part_position[axis]));
    sum += p.part_sum[axis] + after;
    if (mean)
      twice += 2 * static_cast<Int128>(p.part_sum[axis]) +
               weighted(p.part, difference(from, p.part_position[axis])) + after;
  }
  end = to_double(sum);
  if (mean) twice_mean = to_double(twice);
  return whole;
}

}  // namespace

void hold(Patch& p, const Advance& a, StepSums& sums) noexcept {
  const bool mean = has(p.outputs, Outputs::mean);
  for (int axis = 0; axis < p.axes; ++axis) {
    const Int128 whole =
        carry_along(p, axis, a.from[axis], a.to[axis], mean, sums.end[axis], sums.twice_mean[axis]);
    if (!a.commit) continue;
    p.sum[axis] = whole;
    p.position[axis] = a.to[axis];
  }
}

void write_response(Patch& p, const PatchStep& step, const StepSums& sums, Response& out) noexcept {
  const bool mean = has(p.outputs, Outputs::mean);
  const bool energy = has(p.outputs, Outputs::energy);
  const double damping = find_damping(p, step.velocity);
  out.status = p.overloaded ? Status::overload : Status::ok;
  double work = 0.0;
  double elastic[2];  // read back from the response as a pair, they would have to wait for it
  for (int axis = 0; axis < 2; ++axis) {
    // 0 - x: no negative zero for a patch at rest.
    out.damper[axis] = 0.0 - damping * step.velocity[axis];
    elastic[axis] = out.elastic[axis] = 0.0 - p.newtons_per_unit * sums.end[axis];
    out.end[axis] = elastic[axis] + out.damper[axis];
    if (mean)
      out.mean[axis] = p.literal ? out.end[axis]
                                 : 0.0 - 0.5 * p.newtons_per_unit * sums.twice_mean[axis] + out.damper[axis];
    work -= std::clamp(out.damper[axis] * step.displacement[axis], -highest_energy, highest_energy);
  }
  out.stiffness = p.stiffness;
  out.damping = damping;
  const double growth = p.ages ? longest_growth(p, step) : 1.0;
  out.force_limit = p.ages ? find_force_limit(p, growth) : p.force_limit;
  if (energy) {
    out.dissipated = sums.dissipated + p.pending_dissipated;
    out.contact_loss = step.contact_loss + p.pending_loss;
    out.damper_work = work;
    out.snaps = sums.snaps + p.pending_snaps;
  }
  if (!step.advance.commit) return;
  if (step.creeps) {
    p.record->remainder[0] = step.remainder[0];
    p.record->remainder[1] = step.remainder[1];
  }
  p.pending_dissipated = p.pending_loss = 0.0;
  p.pending_snaps = 0;
  p.elastic[0] = elastic[0];
  p.elastic[1] = elastic[1];
  p.rests = !p.ages;  // the force limit of one that ages grows
  if (p.ages) note_slide(p, step, growth);
}

namespace {

/// Where a displacement of usual size leads: in position units, and the position there.
bool find_end(const Patch& p, const double (&displacement)[2], std::int64_t (&fixed)[2],
              std::int64_t (&to)[2]) noexcept {
  for (int axis = 0; axis < 2; ++axis) {
    const double d = displacement[axis] * p.lengths_per_metre;
    if (!(std::abs(d) <= far_length) || (d != 0.0 && std::abs(d) < creep_length)) return false;
    fixed[axis] = std::llrint(d * fixed_per_length);
    to[axis] = sum_of(p.position[axis], fixed[axis]);
  }
  return true;
}

/// Whether the bound holds, so that nothing can snap on the path to `to`.
bool holds_at(const Patch& p, const std::int64_t (&fixed)[2], const std::int64_t (&to)[2]) noexcept {
  if ((fixed[0] | fixed[1]) == 0) return true;
  if (p.bound.reach < 0.0) return false;
  const double x = to_lengths(difference(to[0], p.bound.anchor[0]));
  const double y = to_lengths(difference(to[1], p.bound.anchor[1]));
  return std::sqrt(x * x + y * y) < p.bound.reach;
}

/// Takes a patch that holds there: `hold` of a step that is committed.
template <bool mean>
void carry_to(Patch& p, const std::int64_t (&to)[2], double (&end)[2], double (&twice_mean)[2]) noexcept {
  for (int axis = 0; axis < 2; ++axis) {
    p.sum[axis] = carry_along(p, axis, p.position[axis], to[axis], mean, end[axis], twice_mean[axis]);
    p.position[axis] = to[axis];
  }
}

/// As the notes of write_response, for a step in which nothing damps or ages.
void note_light_step(Patch& p, bool held, const double (&end)[2]) noexcept {
  p.held = held;
  p.rests = true;
  p.pending_dissipated = p.pending_loss = 0.0;
  p.pending_snaps = 0;
  for (int axis = 0; axis < 2; ++axis) p.elastic[axis] = 0.0 - p.newtons_per_unit * end[axis];
}

/// Takes a step beyond the bound, where the contact model may need no look at its bristles. Returns false,
/// with nothing changed, if it does. Otherwise either the bristles hold (`holds`), or `end` becomes the sums.
bool pass_lightly(Patch& p, const std::int64_t (&fixed)[2], const std::int64_t (&to)[2], double (&end)[2],
                  bool& holds) noexcept {
  if (p.model->step_lightly == nullptr) return false;
  const double moved[2] = {to_lengths(fixed[0]), to_lengths(fixed[1])};
  const LightStep light = p.model->step_lightly(p, to, moved, end);
  holds = light == LightStep::holds;
  return light != LightStep::none;
}

/// Nothing of the patch damps or ages, so that the velocity does not matter.
bool is_plain(const Patch& p) noexcept {
  return p.skips && !p.ages && !p.damps && !p.literal && p.rest_damping == 0.0;
}

/// The usual step of a plain patch that held in the last one: it holds on. Returns false if it does not:
/// nothing has changed. Numbers as find_way, holds_still, hold and write_response find them; most of a step
/// costs less than asking all that they ask.
bool stick_on(Patch& p, const double (&displacement)[2], Response& out) noexcept {
  std::int64_t fixed[2], to[2];
  if (!find_end(p, displacement, fixed, to) || !holds_at(p, fixed, to)) return false;
  double end[2], twice_mean[2];
  const bool mean = has(p.outputs, Outputs::mean);
  if (mean)
    carry_to<true>(p, to, end, twice_mean);
  else
    carry_to<false>(p, to, end, twice_mean);
  const double dissipated = p.pending_dissipated;
  const double loss = p.pending_loss;
  const std::uint64_t snaps = p.pending_snaps;
  note_light_step(p, true, end);
  answer_at_rest(p, out);
  if (mean)
    for (int axis = 0; axis < 2; ++axis)
      out.mean[axis] = 0.0 - 0.5 * p.newtons_per_unit * twice_mean[axis] + 0.0;
  if (has(p.outputs, Outputs::energy)) {
    out.dissipated = dissipated;
    out.contact_loss = loss;
    out.snaps = snaps;
  }
  return true;
}

/// Steps a plain patch that goes on sticking under an unchanged load, or gliding if the end force alone is
/// asked for. Returns false, with nothing changed, for any other step.
bool step_quickly(Patch& p, const Motion& motion, Response& out) noexcept {
  if (motion.normal_load != p.normal_load) return false;
  if (p.bound.reach != light_reach || !can_step_lightly(p))
    return p.held && is_plain(p) && stick_on(p, motion.displacement, out);
  double elastic[2];
  if (!step_lightly(p, motion.displacement, elastic)) return false;
  answer_at_rest(p, out);
  return true;
}

}  // namespace

std::uint64_t step_patch(Patch& p, const Motion& motion, double dt_s, Response& out) noexcept {
  if (step_quickly(p, motion, out)) return 0;
  double contact_loss = 0.0;
  if (motion.normal_load != p.normal_load) contact_loss = p.model->apply_load(p, motion.normal_load);
  PatchStep step = read_motion(p, motion, dt_s, true);
  step.contact_loss = contact_loss;
  StepSums sums;
  p.held = !step.moves || holds_still(p, step);
  if (p.held) {
    hold(p, step.advance, sums);
  } else {
    find_direction(step.advance);
    p.model->advance(p, step, sums);
  }
  BRISTLE_ASSERT(p.in_contact() <= p.record->largest_work);
  write_response(p, step, sums, out);
  return sums.visited;
}

bool can_step_lightly(const Patch& p) noexcept {
  return is_plain(p) && p.axes == 2 && p.outputs == Outputs::end;
}

bool step_lightly(Patch& p, const double (&displacement)[2], double (&elastic)[2]) noexcept {
  std::int64_t fixed[2], to[2];
  if (!find_end(p, displacement, fixed, to)) return false;
  bool holds = holds_at(p, fixed, to);
  double end[2] = {0.0, 0.0}, unused[2];
  if (!holds && !pass_lightly(p, fixed, to, end, holds)) return false;
  if (holds) carry_to<false>(p, to, end, unused);
  note_light_step(p, holds, end);
  for (int axis = 0; axis < 2; ++axis) elastic[axis] = p.elastic[axis];
  return true;
}

void find_response(Patch& p, const Motion& motion, double dt_s, double contact_loss, Response& out) noexcept {
  PatchStep step = read_motion(p, motion, dt_s, false);
  step.contact_loss = contact_loss;
  StepSums sums;
  if (!step.moves || holds_still(p, step)) {
    hold(p, step.advance, sums);
  } else {
    find_direction(step.advance);
    p.model->advance(p, step, sums);
  }
  write_response(p, step, sums, out);
}

bool needs_copy(const Patch& p, const Motion& motion) noexcept {
  if (!p.renews) return false;
  const PatchStep step = read_motion(p, motion, 1.0, false);
  return step.moves && !holds_still(p, step);
}

void note_contact(Patch& p) noexcept {
  const CompiledMaterial& m = p.material();
  p.rests = false;
  p.overloaded = p.overload > 1.0;
  p.damps = m.material.bristle_damping != 0.0 || m.material.speed_strengthening != 0.0;
  p.stiffness = p.zeta * m.material.bristle_stiffness;
  p.force_limit = m.peak_coefficient * p.normal_load;
  p.rest_damping = 0.0;
  if (p.normal_load > 0.0) p.rest_damping = p.damps ? damping_at(p, 0.0) : m.material.viscous_friction;
}

void take_hold_over(Patch& to, const Patch& from) noexcept {
  to.record->hold = {from.record->hold.oldest, std::max(time_of(to), from.record->hold.since), {0, 0}};
}

void write_refusal(const Patch* patch, Status status, Response& out) noexcept {
  out.status = status;
  for (int axis = 0; axis < 2; ++axis) {
    out.end[axis] = out.elastic[axis] = out.damper[axis] = 0.0;
    if (patch == nullptr || has(patch->outputs, Outputs::mean)) out.mean[axis] = 0.0;
  }
  out.stiffness = out.damping = out.force_limit = 0.0;
  if (patch == nullptr || has(patch->outputs, Outputs::energy)) {
    out.dissipated = out.contact_loss = out.damper_work = 0.0;
    out.snaps = 0;
  }
}

}  // namespace bristle::detail
