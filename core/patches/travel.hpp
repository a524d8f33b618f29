// The motion of a patch (Travel), the input and the output of a contact model's step, and the steps that need
// no contact model because no bristle can snap.
#pragma once

#include <cmath>

#include "core/patches/patch.hpp"

namespace bristle::detail {

/// Returns an upper bound on the rounding error, s, of a time up to `end` that was computed by `sums`
/// additions.
inline double rounding_of_times(double end, double sums) noexcept { return (sums + 1.0) * 0x1p-52 * end; }

/// Longest time, s, that a patch counts. The clock of a batch stops there, and a step that lasts longer ages
/// a patch by this time only.
constexpr double longest_time = 1e16;
inline bool stands_still(const Int128& clock) noexcept {
  return !(clock < static_cast<Int128>(longest_time * clock_units_per_second));
}

/// Displacement and times of one step of a patch, computed from its motion.
struct PatchStep {
  /// Displacement of the step. For a far step, in which every bristle snaps, it has length and direction; for
  /// other steps only when a contact model is called. The model fills `in_double`, `energy_unit`, `phase_key`
  /// and `finds_bounds`, and may shorten the displacement.
  KernelStep kernel;
  double scaled[2];       ///< displacement in scaled lengths, which are near the mean snap length
  std::int64_t units[2];  ///< displacement in fixed-point units of the position; 0 in a far step
  /// Times of the patch at the start and at the end of the step, s; 0 for a patch that does not age.
  double begins, ends;
  double remainder[2];  ///< rounding remainder of short displacements after this step
  bool moves;           ///< whether the patch moves; if it does not, nothing can snap
  /// Whether the displacement along an axis is so short that its rounding remainder is added to the next one.
  bool creeps;
  double contact_loss = 0.0;  ///< elastic energy that the step's change of load took, J
  double stored = 0.0;        ///< elastic energy before the step, J; filled only if books_work()
};

/// Result of a contact model's step: sums over all bristles in contact, from which the response follows.
struct StepSums {
  double end[2] = {0.0, 0.0};         ///< sum of deflections at the end; times Patch::newtons_per_unit in N
  double twice_mean[2] = {0.0, 0.0};  ///< twice the mean, over the step, of the sum of deflections
  double dissipated = 0.0;            ///< energy lost in snaps, J (Outputs::energy)
  std::uint64_t snaps = 0;
  std::uint64_t visited = 0;  ///< number of bristles or cohorts that a kernel read
};

/// Computes length and direction of a displacement. A far step, in which every bristle snaps, came with both.
inline void find_direction(Travel& t) noexcept {
  if (t.snaps_all) return;
  double moved[2];
  for (int axis = 0; axis < 2; ++axis) moved[axis] = to_lengths(difference(t.to[axis], t.from[axis]));
  t.length = std::sqrt(moved[0] * moved[0] + moved[1] * moved[1]);
  t.direction[0] = moved[0] / t.length;
  t.direction[1] = moved[1] / t.length;
}

/// Adds the bristles beyond full blocks (Patch::part) to the sum of deflections at the end of a step in which
/// none of them snaps and, with `mean`, to twice its mean over the step.
inline void add_last_block(const Patch& p, int axis, std::int64_t from, std::int64_t to, bool mean,
                           Int128& end, Int128& twice_mean) noexcept {
  if (!(p.part > 0.0)) return;
  const Int128 after = weighted(p.part, difference(to, p.part_position[axis]));
  end += p.part_sum[axis] + after;
  if (mean)
    twice_mean += 2 * static_cast<Int128>(p.part_sum[axis]) +
                  weighted(p.part, difference(from, p.part_position[axis])) + after;
}

/// Calculates the sums of deflections of a step without snaps, in which all bristles bend alike; `mean`: also
/// averaged over the step.
template <bool mean>
inline void bend_all(Patch& p, const Travel& t, StepSums& sums) noexcept {
  for (int axis = 0; axis < 2; ++axis) {  // runs to a constant 2, so that the loop is unrolled
    if (axis == p.axes) break;
    const Int128 whole = p.sum[axis] + Int128{p.whole} * difference(t.to[axis], t.from[axis]);
    Int128 end = whole;
    Int128 twice_mean = p.sum[axis] + whole;
    add_last_block(p, axis, t.from[axis], t.to[axis], mean, end, twice_mean);
    sums.end[axis] = to_double(end);
    if (mean) sums.twice_mean[axis] = to_double(twice_mean);
    if (!t.stores) continue;
    p.sum[axis] = whole;
    p.position[axis] = t.to[axis];
  }
}
/// Calculates the sums of deflections of a step in which no bristle snaps. Moves the patch, but
/// not in a trial step.
inline void bend_without_snap(Patch& p, const Travel& t, StepSums& sums) noexcept {
  if (has(p.outputs, Outputs::mean))
    bend_all<true>(p, t, sums);
  else
    bend_all<false>(p, t, sums);
}

}  // namespace bristle::detail
