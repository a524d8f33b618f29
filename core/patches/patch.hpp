// The part of a patch that all contact models share: one slot of the pool, four cache lines.
//
// A step of a patch at rest reads and writes the first line. A step within the patch's bound (sticking) needs
// all four lines and nothing else. Only a step in which something may snap asks the contact model
// (contact_model.hpp), which keeps its data in a record of its own.
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

constexpr double highest_load = 1e15;     ///< N, largest load of a motion
constexpr double highest_energy = 1e300;  ///< J, highest energy of a response: an energy that overflows is
                                          ///< cut to it, so that sums of a few stay finite

/// Properties of a patch, fixed when it is made except seed and key. The base of every model's record.
struct PatchRecord {
  PatchOptions options;
  const CompiledMaterial* material = nullptr;  ///< material of the patch, owned by the record's memory
                                               ///< (record_memory.hpp)
  std::uint32_t first_seed = 0;                ///< seed with which the patch was added; a reset may change
                                               ///< options.seed
  std::uint32_t largest_work = 0;              ///< largest number of bristles that a step visits
  bool endless = false;      ///< whether the population is infinite, so that read_bristles shows as many
                             ///< bristles as the caller asks for
  double full_weight = 0.0;  ///< physical bristles per representative when all representatives are in use; a
                             ///< change of material does not alter it
  std::size_t bytes = 0;     ///< bytes of the record and its columns

  /// Rounding remainder of short displacements (find_odd_way()), in units of the position; longer
  /// displacements leave none.
  double remainder[2] = {0.0, 0.0};
  /// The batch's clock, which advances in every step; null = time stands still at 0. A patch that ages counts
  /// its time from `epoch`. Both in clock units.
  const Int128* clock = nullptr;
  Int128 epoch = 0;
  /// Longest time for which bristles of an ageing patch can have held: no bristle has held since before the
  /// time `oldest`. Times as time_of(), s.
  struct Hold {
    double oldest = 0.0;
    double since = 0.0;            ///< last time at which the patch was near its anchor; it becomes the next
                                   ///< value of `oldest`
    std::int64_t way[2] = {0, 0};  ///< displacement of the patch from its anchor, fixed point
  } hold;
  LayMap lay;  ///< map of the surface's lay (PatchOptions::lay) with its limits
};

constexpr double clock_units_per_second = 18446744073709551616.0;  ///< 2^64

/// The part of a patch that every contact model has. Touched by the stepping thread and its workers only.
///
/// `sum` and `part_*` give the sum of deflections over the contact, fixed point, as a function of the
/// position while nothing snaps, enters or leaves: sum + whole (position - here), and for bristles that count
/// in part part_sum + part (position - part_position), rounded.
struct alignas(64) Patch {
  // --- line 1: all that a step of a resting patch needs
  std::uint32_t generation = 0;  ///< generation of the patch in this slot; 0 = none
  bool rests : 1 = false;        ///< whether the numbers of this cache line answer a step without motion
  bool overloaded : 1 = false;
  bool held : 1 = false;  ///< whether no bristle could snap in the last step; a hint for prefetching
  std::uint8_t axes = 2;
  Outputs outputs = Outputs::end;
  std::uint64_t last_step = 0;     ///< number of the last step that named the patch; detects repeated ids
  double normal_load = 0.0;        ///< N, load of the last step
  double elastic[2] = {0.0, 0.0};  ///< N, elastic force on the body at the end of the last step
  double stiffness = 0.0;          ///< N/m, stiffness of the patch (Response::stiffness)
  double rest_damping = 0.0;       ///< N s/m, damping of the patch at rest
  double force_limit = 0.0;        ///< N, highest elastic force (Response::force_limit)

  // --- line 2
  std::int64_t position[2] = {0, 0};  ///< position of the patch, fixed point (kernel_table.hpp)
  Reach bound{{0, 0}, -1.0};          ///< ball about a position: nothing snaps while the patch stays within
                                      ///< it
  std::uint32_t whole = 0;            ///< number of bristles in full blocks, which all count fully
  bool skips : 1 = true;              ///< whether steps skip the bristles of blocks within their bounds
  bool tracks : 1 = true;             ///< whether bounds are recomputed, which pays while most visited blocks
                                      ///< do not snap
  bool literal : 1 = false;           ///< whether the patch follows the paper's literal loop
                                      ///< (ComparisonModes::literal)
  bool damps : 1 = false;             ///< whether the damping depends on the velocity
  bool ages : 1 = false;              ///< whether bristles age, so that time_of(patch) matters
  bool renews : 1 = false;            ///< whether even a trial step changes the patch, and is therefore made
                                      ///< on a copy
  bool laid : 1 = false;              ///< whether the surface has a lay, by which motions and forces are
                                      ///< mapped
  std::uint8_t fetched_lines = 0;     ///< number of cache lines of the record that are worth prefetching
                                      ///< before a step
  double part = 0.0;                  ///< weight of the bristles in contact beyond the `whole` ones, a real
                                      ///< number
  double newtons_per_unit = 0.0;      ///< N, elastic force of one unit of `sum`, the sum of deflections

  // --- line 3
  Int128 sum[2] = {0, 0};
  std::int64_t part_sum[2] = {0, 0};
  std::int64_t part_position[2] = {0, 0};

  // --- line 4
  double lengths_per_metre = 1.0;
  double zeta = 0.0;                ///< number of physical bristles in contact
  double overload = 1.0;            ///< overload: number of physical bristles that the load asks for over the
                                    ///< largest number of the patch, if above 1
  double pending_dissipated = 0.0;  ///< J, energy dissipated by a change of material, which the next step
                                    ///< reports
  double pending_loss = 0.0;        ///< J, energy lost by a change of material or of detail, which the next
                                    ///< step reports
  std::uint64_t pending_snaps = 0;
  const ContactModel* model = nullptr;
  PatchRecord* record = nullptr;  ///< record of the contact model, owned by the batch

  const CompiledMaterial& material() const noexcept { return *record->material; }
  /// Returns the number of representatives in contact, including the one that is in contact in part.
  std::uint32_t in_contact() const noexcept { return whole + static_cast<std::uint32_t>(std::ceil(part)); }
};
static_assert(sizeof(Patch) == 256 && offsetof(Patch, position) == 64 && offsetof(Patch, sum) == 128 &&
              offsetof(Patch, lengths_per_metre) == 192);

/// Returns the patch's own time, s: the time since it was made, plus its age when it was restored. During a
/// step this is the time at its start.
inline double time_of(const Patch& p) noexcept {
  const PatchRecord& r = *p.record;
  return r.clock == nullptr ? 0.0 : static_cast<double>(*r.clock - r.epoch) / clock_units_per_second;
}

/// Makes the shared part of a patch out of contact from its options and material.
Patch make_shared_part(PatchRecord& record, const ContactModel& model) noexcept;
/// Whether a step's dissipated energy is computed as its work less the change of stored energy
/// (LayMap::books_work).
inline bool books_work(const Patch& p) noexcept {
  return p.laid && has(p.outputs, Outputs::energy) && p.record->lay.books_work();
}
/// Updates the numbers of the shared part that follow from load and material. Call it after a change of
/// either.
void note_contact(Patch& patch) noexcept;
/// Returns the damping of the whole patch, N s/m; times the velocity it is the force of damper, lubricant and
/// strengthening with speed.
double damping_at(const Patch& patch, double speed) noexcept;

/// Returns the fixed-point difference of two positions, which wrap.
inline std::int64_t difference(std::int64_t to, std::int64_t from) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from));
}
/// Adds a fixed-point displacement to a position.
inline std::int64_t sum_of(std::int64_t from, std::int64_t way) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(from) + static_cast<std::uint64_t>(way));
}
inline double to_lengths(std::int64_t fixed) noexcept {
  return static_cast<double>(fixed) * length_per_fixed;
}
/// Converts to double as static_cast does, without its long division for numbers below 2^63.
inline double to_double(Int128 x) noexcept {
  const auto low = static_cast<std::int64_t>(x);
  return low == x ? static_cast<double>(low) : static_cast<double>(x);
}
/// Returns count times a fixed-point displacement, rounded. The result depends on the present state alone, so
/// rounding errors do not accumulate.
inline Int128 weighted(double count, std::int64_t fixed) noexcept {
  const double x = count * static_cast<double>(fixed);
  if (std::abs(x) < 9e18) return std::llrint(x);
  return static_cast<Int128>(x);  // a whole number already, at this size
}

/// Returns the sum of deflections at the patch's position along one axis, scaled.
inline double deflection_sum(const Patch& p, int axis) noexcept {
  Int128 sum = p.sum[axis];
  if (p.part > 0.0)
    sum += p.part_sum[axis] + weighted(p.part, difference(p.position[axis], p.part_position[axis]));
  return to_double(sum) * length_per_fixed;
}

}  // namespace bristle::detail
