// One step of one patch, as far as it is the same for every contact model: what a motion means, what is
// answered without asking the model, and the response.
#pragma once

#include "core/patches/crew.hpp"
#include "core/patches/patch.hpp"

namespace bristle::detail {

/// Largest rounding error of `sums` sums of times up to `end`, and of `end` itself, s.
inline double rounding_of_times(double end, double sums) noexcept { return (sums + 1.0) * 0x1p-52 * end; }

/// s: a clock that has run for this long stands still, and no step of a patch that ages takes longer.
constexpr double longest_time = 1e16;
inline bool stands_still(const Int128& clock) noexcept {
  return !(clock < static_cast<Int128>(longest_time * clock_units_per_second));
}

struct PatchStep {
  Advance advance;     ///< what kernels need; `in_double`, `energy_unit`, `phase_key` and `renews_bounds` are
                       ///< the model's part
  bool moves = false;  ///< false: nothing can snap
  double contact_loss = 0.0;        ///< J
  double begins = 0.0, ends = 0.0;  ///< time_of the patch, s; 0 without ageing. A model may cut `advance`
  double displacement[2];           ///< m
  double velocity[2];               ///< m/s, for dampers
  double scaled[2];                 ///< the displacement in scaled lengths
  std::int64_t units[2] = {0, 0};   ///< by which the position moves, fixed point; 0 where `snaps_all`
  bool creeps = false;              ///< so short that its remainder is carried
  double remainder[2];              ///< PatchRecord::remainder after it
  const Crew* crew = nullptr;       ///< threads for what has to be done before the last ranges; null: none
};

/// Result of a step for the contact.
struct StepSums {
  double end[2] = {0.0, 0.0};         ///< sum of deflections at the end, in units of Patch::newtons_per_unit
  double twice_mean[2] = {0.0, 0.0};  ///< twice its mean over the step (Outputs::mean)
  double dissipated = 0.0;            ///< J, in snaps (Outputs::energy)
  std::uint64_t snaps = 0;
  std::uint64_t visited = 0;  ///< bristles that a kernel looked at
};

/// Checks the motion; false = bad input.
bool is_good_motion(const Patch& patch, const Motion& motion) noexcept;

/// Whether this motion leaves a resting patch at rest.
inline bool stays_at_rest(const Patch& p, const Motion& motion) noexcept {
  return p.rests && motion.displacement[0] == 0.0 && motion.displacement[1] == 0.0 &&
         motion.normal_load == p.normal_load && !motion.has_velocity;
}
/// The response to it: the last force, without its part that depends on velocity.
inline void answer_at_rest(const Patch& p, Response& out) noexcept {
  out.status = p.overloaded ? Status::overload : Status::ok;
  for (int axis = 0; axis < 2; ++axis) {
    out.damper[axis] = 0.0;
    out.elastic[axis] = out.end[axis] = p.elastic[axis];
    if (has(p.outputs, Outputs::mean)) out.mean[axis] = p.elastic[axis];
  }
  out.stiffness = p.stiffness;
  out.damping = p.rest_damping;
  out.force_limit = p.force_limit;
  if (has(p.outputs, Outputs::energy)) {
    out.dissipated = out.contact_loss = out.damper_work = 0.0;
    out.snaps = 0;
  }
}

/// Reads the motion under a load that is applied already.
PatchStep read_motion(const Patch& patch, const Motion& motion, double dt_s, bool commit) noexcept;

/// Length and direction of a step that moves: what a model needs, and a step within the bound does not.
void find_direction(Advance& advance) noexcept;

/// Whether the step ends within the patch's bound: then nothing snaps along its path.
inline bool holds_still(const Patch& p, const PatchStep& step) noexcept {
  if (p.bound.reach < 0.0 || !step.advance.skips_blocks) return false;
  const double x = to_lengths(difference(step.advance.to[0], p.bound.anchor[0]));
  const double y = to_lengths(difference(step.advance.to[1], p.bound.anchor[1]));
  return std::sqrt(x * x + y * y) < p.bound.reach;
}

/// The sums of a step in which nothing snaps; carries the position along when the step is committed.
void hold(Patch& patch, const Advance& advance, StepSums& sums) noexcept;

/// Writes the response and, when the step is committed, what the next step at rest answers.
void write_response(Patch& patch, const PatchStep& step, const StepSums& sums, Response& out) noexcept;

/// A step from its motion to its response, on one thread. Returns the bristles visited.
std::uint64_t step_patch(Patch& patch, const Motion& motion, double dt_s, Response& out) noexcept;
/// Two axes, the end force alone, and nothing that damps or ages.
bool can_step_lightly(const Patch& patch) noexcept;
/// A step of such a patch under the load that it has, where a look at its bristles is enough: it sticks or
/// glides. Writes the elastic force. Returns false if it is not so: nothing has changed.
bool step_lightly(Patch& patch, const double (&displacement)[2], double (&elastic)[2]) noexcept;
/// As step_patch without a change of state, under the present load. `contact_loss` goes into the response.
void find_response(Patch& patch, const Motion& motion, double dt_s, double contact_loss,
                   Response& out) noexcept;

/// Whether this motion under the present load may change more than find_response can leave alone.
bool needs_copy(const Patch& patch, const Motion& motion) noexcept;

/// Numbers of the shared part that follow from load and material. Call after either changed.
void note_contact(Patch& patch) noexcept;

/// Copies holding times to a patch with another material: its bristles keep their age.
void take_hold_over(Patch& to, const Patch& from) noexcept;

/// Zero force and the given status.
void write_refusal(const Patch* patch, Status status, Response& out) noexcept;

}  // namespace bristle::detail
