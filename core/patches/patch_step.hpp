// One step of one patch, as far as it is the same for all contact models: reads the motion, answers without
// visiting bristles if none can snap, and writes the response.
#pragma once

#include "core/patches/contact_model.hpp"
#include "core/patches/lanes/lane_block.hpp"

namespace bristle::detail {

/// Returns whether a motion can be stepped: finite, in range, and along axes that the patch has. Other
/// motions are bad input.
bool is_good_motion(int axes, const Motion& motion) noexcept;

/// Returns Bound::rest if a motion leaves a resting patch at rest, so that its last force is still right.
/// Reads only the first of the patch's four cache lines, which makes resting patches cheap.
inline Bound find_bound(const Patch& p, const Motion& motion) noexcept {
  return p.rests && leaves_at_rest(motion, p.normal_load) ? Bound::rest : Bound::none;
}
/// Finds which bound, if any, answers a step without a visit to the bristles.
inline Bound find_bound(const Patch& p, const PatchStep& step) noexcept {
  if (!step.moves) return Bound::rest;
  const Travel& t = step.kernel;
  if (p.known != Bound::ball || !p.skips || t.snaps_all) return Bound::none;
  const double x = to_lengths(difference(t.to[0], p.bound.anchor[0]));
  const double y = to_lengths(difference(t.to[1], p.bound.anchor[1]));
  return std::sqrt(x * x + y * y) < p.bound.reach ? Bound::ball : Bound::none;
}

/// Writes the response of a patch at rest: its last elastic force, and no force of dampers.
inline void answer_at_rest(const Patch& p, Response& out) noexcept {
  out.status = p.overloaded ? Status::overload : Status::ok;
  write_still(p.outputs, p.elastic, out);
  out.stiffness = p.stiffness;
  out.damping = p.rest_damping;
  out.force_limit = p.force_limit;
}

/// Steps a patch on one thread, from motion to response. Returns the number of bristles visited.
std::uint64_t step_patch(Patch& patch, const Motion& motion, double dt_s, Response& out) noexcept;
/// Computes the response that step_patch() would give under the present load, without changing the patch.
/// Motions for which needs_copy() is true must be tried on a copy. `contact_loss`: energy lost when the load
/// was applied, for the response.
void try_step(Patch& patch, const Motion& motion, double dt_s, double contact_loss, Response& out) noexcept;

// The functions below are for contacts in lanes (Patch::in_lane). A step first writes all motions in the
// blocks, then runs the blocks, then writes the responses.

/// Writes a patch's motion into its lane of the block, from which the kernel reads the motions of all lanes.
void assign_motion(const Patch& patch, const Motion& motion, double dt_s) noexcept;
/// Writes the response to a motion from the answers of the patch's block, after the block has been stepped.
void answer_motion(Patch& patch, const Motion& motion, double dt_s, const LaneAnswers& answers,
                   Response& out) noexcept;
/// Steps the contact of one lane alone. `stores`: false for a trial, which changes neither block nor record
/// but only `patch`, which is a copy.
void step_lane(Patch& patch, const Motion& motion, double dt_s, bool stores, Response& out) noexcept;

/// Begins a step that is shared among threads. The caller then runs SharedStep::run for all blocks and calls
/// end_step(). Returns the number of blocks; 0 = no bristle has to be stepped.
std::uint32_t begin_step(Patch& patch, const Motion& motion, double dt_s, PatchStep& step) noexcept;
/// Ends a step that begin_step() began, and writes its response. `totals`: sums over all blocks, or null if
/// no bristle was stepped. Returns the number of bristles visited.
std::uint64_t end_step(Patch& patch, const Motion& motion, double dt_s, const PatchStep& step,
                       const Totals* totals, Response& out) noexcept;

/// Returns whether a trial of this motion under the present load must be made on a copy of the patch, because
/// it would change bristles.
bool needs_copy(const Patch& patch, const Motion& motion) noexcept;

/// Copies to a patch of another material the bounds on how long its bristles have been stuck: bristles keep
/// their ages when the material changes.
void copy_stuck_time(Patch& to, const Patch& from) noexcept;

/// Writes the response to a refused motion: zero force, and the reason as status. `computed`: outputs of the
/// patch, all if there is none.
void write_refusal(Outputs computed, Status status, Response& out) noexcept;

}  // namespace bristle::detail
