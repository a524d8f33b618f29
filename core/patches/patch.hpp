// The part of a patch that all contact models share: a slot in a batch's array of patches, four cache lines.
//
// The lines are ordered by need. A step of a patch at rest reads the first line alone. A step within the
// patch's bound, where no bristle can snap, reads all four lines and, without ageing, dampers, lay and creep,
// nothing else. Only a change of load or a step in which a bristle may snap calls the contact model
// (contact_model.hpp), whose data are in its record.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "bristle/patch.hpp"
#include "core/kernel_table.hpp"
#include "core/materials/kernel_law.hpp"
#include "core/patches/lay.hpp"

namespace bristle::detail {

struct ContactModel;

constexpr double highest_load = 1e15;  ///< largest normal load of a motion, N
/// Highest energy of a response, J: a larger one is cut to this value, so that sums of a few stay finite.
constexpr double highest_energy = 1e300;

/// Base of every contact model's record: properties of a patch, and state that most steps do not need.
struct PatchRecord {
  PatchOptions options;
  /// Material of the patch. Its owner is the head in front of the record (record_memory.hpp), so that the
  /// record can be copied as bytes.
  const CompiledMaterial* material = nullptr;
  /// Seed with which the patch was added, by which saved states are recognised; a reset may have changed
  /// options.seed.
  std::uint32_t first_seed = 0;
  std::uint32_t largest_work = 0;  ///< largest number of bristles that a step visits
  /// Whether the population is infinite, so that read_bristles() can give as many bristles as the caller asks
  /// for.
  bool endless = false;
  /// Physical bristles per representative when all representatives are in contact. A change of material
  /// leaves it as it is.
  double full_weight = 0.0;
  std::size_t bytes = 0;    ///< size of the record with its columns
  std::uint32_t group = 0;  ///< number of the group (PatchGroup) that the patch belongs to; 0 = none

  /// Rounding remainder of displacements so short that fixed point would lose them (creep), in units of the
  /// position. It is added to the next short displacement; longer ones leave it as it is.
  double remainder[2] = {0.0, 0.0};
  /// Clock of the batch, which every step advances; null = time stands still at 0. A patch that ages counts
  /// its time from `epoch`. Both in units of 2^-64 s.
  const Int128* clock = nullptr;
  Int128 epoch = 0;
  /// Bound on how long bristles of an ageing patch can have been stuck: no bristle has been stuck since
  /// before the time `oldest`. Times in s of the patch's own clock (time_of()).
  struct Stuck {
    double oldest = 0.0;
    /// Last time at which the patch was near the position where its bristles got stuck (its anchor). After a
    /// slide away from there it becomes the new `oldest`.
    double since = 0.0;
    std::int64_t moved[2] = {0, 0};  ///< displacement of the patch since then, fixed point
  } stuck;
  LayMap lay;  ///< map to axes in which friction does not depend on direction (lay.hpp)
};

constexpr double clock_units_per_second = 18446744073709551616.0;  ///< 2^64 units of the clock in a second

/// Reasons why a step can be answered without visiting bristles; `none` = there is no reason.
enum class Bound : unsigned char {
  none,  ///< no reason: some bristle may snap, so ContactModel::step_bristles must visit the bristles
  rest,  ///< the patch does not move, so no deflection changes
  /// The motion ends in the ball Patch::bound, in which no bristle snaps, so the sums of deflections follow
  /// from the displacement.
  ball
};

/// The part of a patch that every contact model has. Only the stepping thread and its workers touch it.
///
/// While no bristle snaps, enters or leaves, the sum of deflections (fixed point) at the position x of the
/// patch is sum + whole (x - position) and, for bristles beyond full blocks, part_sum + part (x -
/// part_position), rounded.
struct alignas(64) Patch {
  // Cache line 1 has all that a step reads of a patch that stays at rest.

  std::uint32_t generation = 0;  ///< generation of the patch in this slot; 0 = the slot is empty
  bool rests : 1 = false;        ///< whether the numbers of this cache line answer a step without motion
  bool overloaded : 1 = false;
  bool snap_free : 1 = false;  ///< whether no bristle could snap in the last step; a hint for prefetching
  std::uint8_t axes = 2;
  Outputs outputs = Outputs::end;
  std::uint64_t last_step = 0;     ///< number of the last step that named the patch; finds repeated ids
  double normal_load = 0.0;        ///< normal load of the last step, N
  double elastic[2] = {0.0, 0.0};  ///< elastic force on the body at the end of the last step, N
  double stiffness = 0.0;          ///< stiffness of the patch, N/m (Response::stiffness)
  double rest_damping = 0.0;       ///< damping of the patch at rest, N s/m
  double force_limit = 0.0;        ///< highest elastic force, N (Response::force_limit)

  // Cache line 2 begins here. The four lines together have all that a step reads in which no bristle snaps.

  std::int64_t position[2] = {0, 0};  ///< position of the patch, in fixed-point units of 2^-44 scaled lengths
  /// Ball about a position of the patch. If `known` is Bound::ball, no bristle snaps while the patch stays in
  /// it.
  Reach bound{{0, 0}, 0.0};
  std::uint32_t whole = 0;  ///< number of bristles in full blocks, which all count fully
  bool skips : 1 = true;    ///< whether steps skip blocks whose bound shows that no bristle snaps
  /// Whether bounds on snapping are recomputed after a step. That pays only while a step rewrites few blocks
  /// (fewer than an eighth).
  bool tracks : 1 = true;
  bool damps : 1 = false;  ///< whether the damping depends on the velocity
  bool ages : 1 = false;   ///< whether limits change by sticking or sliding (ageing, drop)
  /// Whether even a trial step (find_force) would change the patch, so that it must be made on a copy.
  bool renews : 1 = false;
  /// Whether friction depends on direction (a lay), so that motions and forces are mapped.
  bool laid : 1 = false;
  /// Whether the patch's state is in a lane of a block (lanes/lane_block.hpp), and bound, position and sums
  /// of this struct are not used.
  bool in_lane : 1 = false;
  /// Number of the record's cache lines that are worth prefetching before a step.
  std::uint8_t fetched_lines = 0;
  /// Reason by which a next step that moves may be answered: none, or the ball `bound`.
  Bound known = Bound::none;
  /// Weight of the bristles in contact that are not in full blocks (`whole`); with representatives a number
  /// of bristles, not always whole.
  double part = 0.0;
  double newtons_per_unit = 0.0;  ///< elastic force, N, of one unit of the sum of deflections

  // Cache line 3 has the sums of deflections, in fixed point, from which the force follows.

  Int128 sum[2] = {0, 0};
  std::int64_t part_sum[2] = {0, 0};
  std::int64_t part_position[2] = {0, 0};

  // Cache line 4 has scale, load, results that the next response reports, contact model and record.

  double lengths_per_metre = 1.0;
  double zeta = 0.0;  ///< number of physical bristles in contact, in proportion to the load
  /// Number of physical bristles that the load asks for, divided by the largest number of the patch; at least
  /// 1, and above 1 in overload.
  double overload = 1.0;
  /// Energy dissipated by a change of material, J, which the next step reports.
  double pending_dissipated = 0.0;
  /// Elastic energy lost by a change of material or of the number of representatives, J, which the next step
  /// reports.
  double pending_loss = 0.0;
  std::uint64_t pending_snaps = 0;
  const ContactModel* model = nullptr;
  PatchRecord* record = nullptr;  ///< record of the contact model, owned by the batch

  const CompiledMaterial& material() const noexcept { return *record->material; }
  /// Returns the number of representatives in contact, counting one that is in contact only in part. It is
  /// the work of a step: a contact in a lane counts 0.
  std::uint32_t in_contact() const noexcept { return whole + static_cast<std::uint32_t>(std::ceil(part)); }
};
static_assert(sizeof(Patch) == 256 && offsetof(Patch, position) == 64 && offsetof(Patch, sum) == 128 &&
              offsetof(Patch, lengths_per_metre) == 192);

/// Returns whether a motion asks nothing new of a contact at rest under `load`, so that its last response can
/// be repeated.
inline bool leaves_at_rest(const Motion& motion, double load) noexcept {
  return motion.displacement[0] == 0.0 && motion.displacement[1] == 0.0 && motion.normal_load == load &&
         !motion.has_velocity;
}

/// Writes the forces of a contact that does not move: its elastic force, none of dampers, no energies.
inline void write_still(Outputs computed, const double (&elastic)[2], Response& out) noexcept {
  for (int axis = 0; axis < 2; ++axis) {
    out.damper[axis] = 0.0;
    out.elastic[axis] = out.end[axis] = elastic[axis];
    if (has(computed, Outputs::mean)) out.mean[axis] = elastic[axis];
  }
  if (!has(computed, Outputs::energy)) return;
  out.dissipated = out.contact_loss = out.damper_work = 0.0;
  out.snaps = 0;
}

/// Notes that no bristle snaps while the patch stays in the ball `bound`. A ball of negative reach is none.
inline void note_bound(Patch& p, const Reach& bound) noexcept {
  p.bound = bound;
  p.known = bound.reach >= 0.0 ? Bound::ball : Bound::none;
}

/// Returns the patch's own time, s, at the start of the step in progress: the time since it was made or reset
/// or, if it was restored, its saved time plus the time since.
inline double time_of(const Patch& p) noexcept {
  const PatchRecord& r = *p.record;
  return r.clock == nullptr ? 0.0 : static_cast<double>(*r.clock - r.epoch) / clock_units_per_second;
}

/// Makes the part of a patch that all contact models share, from the options and the material in its record.
/// The patch is out of contact.
Patch make_shared_part(PatchRecord& record, const ContactModel& model) noexcept;
/// Returns whether the dissipated energy of a step is computed as its work less the change of stored energy.
/// A patch with a grain (lay) may need this (LayMap::books_work).
inline bool books_work(const Patch& p) noexcept {
  return p.laid && has(p.outputs, Outputs::energy) && p.record->lay.books_work();
}
/// Updates stiffness, force limit and damping of a patch, which must be called after a change of load or
/// material.
void note_contact(Patch& patch) noexcept;
/// Returns the damping of the whole patch at a speed, N s/m: damper, lubricant and strengthening with speed
/// together. Times the velocity it is their force.
double damping_at(const Patch& patch, double speed) noexcept;
/// Returns the damping of `zeta` bristles in contact under a load, N s/m. Without `damps` (Patch::damps) only
/// the lubricant damps.
double damping_of(const Material& material, bool damps, double zeta, double load, double speed) noexcept;
/// Finds the slip velocity of a motion, m/s, limited so that its square stays finite however short the step
/// is.
void find_velocity(const Motion& motion, double dt_s, double (&velocity)[2]) noexcept;
/// Returns whether the damping of a material depends on load or speed.
inline bool damps(const Material& m) noexcept {
  return m.bristle_damping != 0.0 || m.speed_strengthening != 0.0;
}

/// Returns the difference of two fixed-point positions. It is right even where a position has wrapped around,
/// because integers wrap alike.
inline std::int64_t difference(std::int64_t to, std::int64_t from) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from));
}
/// Adds a fixed-point displacement to a position. A patch that slides very far makes the position wrap around
/// instead of overflowing.
inline std::int64_t sum_of(std::int64_t from, std::int64_t by) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(from) + static_cast<std::uint64_t>(by));
}
inline double to_lengths(std::int64_t fixed) noexcept {
  return static_cast<double>(fixed) * length_per_fixed;
}
/// Converts a 128-bit integer to double as static_cast does, but without the slow 128-bit conversion for
/// magnitudes below 2^63.
inline double to_double(Int128 x) noexcept {
  const auto low = static_cast<std::int64_t>(x);
  return low == x ? static_cast<double>(low) : static_cast<double>(x);
}
/// Returns a number of bristles times a fixed-point displacement, rounded. It is recomputed from the state
/// each time, so rounding errors do not accumulate.
inline Int128 weighted(double count, std::int64_t fixed) noexcept {
  const double x = count * static_cast<double>(fixed);
  if (std::abs(x) < 9e18) return std::llrint(x);
  return static_cast<Int128>(x);  // a double of this size is a whole number
}

/// Returns the sum of the bristles' deflections at the patch's position along one axis, in scaled lengths.
inline double deflection_sum(const Patch& p, int axis) noexcept {
  Int128 sum = p.sum[axis];
  if (p.part > 0.0)
    sum += p.part_sum[axis] + weighted(p.part, difference(p.position[axis], p.part_position[axis]));
  return to_double(sum) * length_per_fixed;
}

}  // namespace bristle::detail
