// The motion of a patch (Travel), the input and output of a model's step, and the shared part's own steps
// within a bound.
#pragma once

#include <cmath>

#include "core/patches/crew.hpp"
#include "core/patches/patch.hpp"

namespace bristle::detail {

/// Returns the largest rounding error, in s, of `sums` sums of times up to `end`, and of `end` itself.
inline double rounding_of_times(double end, double sums) noexcept { return (sums + 1.0) * 0x1p-52 * end; }

/// Longest time, s. A batch's clock stops once it has counted this far, and a longer step ages a patch by
/// this much only.
constexpr double longest_time = 1e16;
inline bool stands_still(const Int128& clock) noexcept {
  return !(clock < static_cast<Int128>(longest_time * clock_units_per_second));
}

/// A step of a patch, read from its motion.
struct PatchStep {
  /// Displacement of the step. Length and direction are set only for a far step (every bristle snaps) and for
  /// a contact model, which fills `in_double`, `energy_unit`, `phase_key` and `renews_bounds` and may shorten
  /// the displacement.
  Advance advance;
  double scaled[2];            ///< the displacement in scaled lengths
  std::int64_t units[2];       ///< change of the position, fixed point; 0 in a far step
  double begins, ends;         ///< the patch's time (time_of) at the start and the end of the step, s; 0
                               ///< without ageing
  double remainder[2];         ///< PatchRecord::remainder after the step, if `creeps`
  bool moves;                  ///< whether the patch moves; if not, nothing can snap
  bool creeps;                 ///< whether the displacement is so short that its rounding remainder is
                               ///< carried to the next one
  double contact_loss = 0.0;   ///< J, energy of the bristles that the load of this step took out of contact
  double stored = 0.0;         ///< J, energy of the bristles before the step; filled only if books_work()
  const Crew* crew = nullptr;  ///< threads that may prepare the step; null = none
};

/// Result of a step for all bristles in contact.
struct StepSums {
  double end[2] = {0.0, 0.0};         ///< sum of deflections at the end, in units of Patch::newtons_per_unit
  double twice_mean[2] = {0.0, 0.0};  ///< twice the mean of that sum over the step (Outputs::mean)
  double dissipated = 0.0;            ///< J, energy lost in snaps (Outputs::energy)
  std::uint64_t snaps = 0;
  std::uint64_t visited = 0;  ///< number of bristles that a kernel visited
};

/// Kinds of motion of a patch by whether bristles have to be visited.
enum class Bound : unsigned char {
  none,   ///< some bristle may snap, so ContactModel::advance must visit the bristles
  rest,   ///< the patch does not move, so its last response is still right
  ball,   ///< the motion ends within Patch::bound, so no bristle snaps, and the sums follow from the
          ///< displacement
  glide,  ///< a steady slide continues without visiting any cohort (glide.hpp)
};

/// Values of Patch::bound.reach without a bound: nothing is known (no_reach), or the patch is in a glide
/// (glide_reach).
constexpr double no_reach = -1.0;
constexpr double glide_reach = -2.0;

/// Computes length and direction of a displacement, unless a far step states them.
inline void find_direction(Travel& t) noexcept {
  if (t.snaps_all) return;
  double moved[2];
  for (int axis = 0; axis < 2; ++axis) moved[axis] = to_lengths(difference(t.to[axis], t.from[axis]));
  t.length = std::sqrt(moved[0] * moved[0] + moved[1] * moved[1]);
  t.direction[0] = moved[0] / t.length;
  t.direction[1] = moved[1] / t.length;
}

/// Finds the sums of a step without snaps as hold() does, for outputs with or without the mean.
template <bool mean>
inline void carry(Patch& p, const Travel& t, StepSums& sums) noexcept {
  for (int axis = 0; axis < 2; ++axis) {  // a constant bound, so that the loop is unrolled
    if (axis == p.axes) break;
    const Int128 whole = p.sum[axis] + Int128{p.whole} * difference(t.to[axis], t.from[axis]);
    Int128 end = whole;
    Int128 twice_mean = p.sum[axis] + whole;
    if (p.part > 0.0) {
      const Int128 after = weighted(p.part, difference(t.to[axis], p.part_position[axis]));
      end += p.part_sum[axis] + after;
      if (mean)
        twice_mean += 2 * static_cast<Int128>(p.part_sum[axis]) +
                      weighted(p.part, difference(t.from[axis], p.part_position[axis])) + after;
    }
    sums.end[axis] = to_double(end);
    if (mean) sums.twice_mean[axis] = to_double(twice_mean);
    if (!t.commit) continue;
    p.sum[axis] = whole;
    p.position[axis] = t.to[axis];
  }
}
/// Finds the sums of a step in which no bristle snaps; moves the patch if the step is committed (not a
/// trial).
inline void hold(Patch& p, const Travel& t, StepSums& sums) noexcept {
  if (has(p.outputs, Outputs::mean))
    carry<true>(p, t, sums);
  else
    carry<false>(p, t, sums);
}

}  // namespace bristle::detail
