// Preconditions of the calls from core to kernels, checked in builds with asserts.
#pragma once

#include "core/common/assert.hpp"
#include "core/kernel_table.hpp"
#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

/// Largest displacement, scaled, that a block may have moved since it was last rewritten. It is far below the
/// 2^19 lengths at which fixed-point positions wrap: a bristle bent so far would have snapped, and its snap
/// would have rewritten the block.
constexpr double farthest_displacement = 262144.0;  // 2^18

inline bool is_near(double displacement_since) {
  return displacement_since > -farthest_displacement && displacement_since < farthest_displacement;
}

/// Asserts what the kernels of a step over the blocks [first, last) of a patch rely on.
template <class T>
inline void assert_step(const PatchView<T>& patch, const KernelStep& step, std::uint32_t first,
                        std::uint32_t last, int axes, bool redraw) {
  BRISTLE_ASSERT(first <= last);
  BRISTLE_ASSERT(first % blocks_per_group == 0);
  BRISTLE_ASSERT(patch.whole <= patch.bristles);
  // Allows a fraction of 1, because a double below 1 may round to a float of 1.
  BRISTLE_ASSERT(patch.fraction >= T(0) && patch.fraction <= T(1));
  BRISTLE_ASSERT(patch.fraction == T(0) || patch.whole < patch.bristles);
  BRISTLE_ASSERT(last * std::uint64_t{block_size} <
                 patch.whole + (patch.fraction > T(0) ? 1u : 0u) + std::uint64_t{block_size});
  BRISTLE_ASSERT(patch.zx != nullptr && patch.delta != nullptr && patch.blocks != nullptr);
  BRISTLE_ASSERT(axes == 1 || patch.zy != nullptr);
  BRISTLE_ASSERT(!redraw || (patch.random != nullptr && patch.law != nullptr));
  BRISTLE_ASSERT(step.length > 0.0);
  const double ex = step.direction[0], ey = step.direction[1];
  BRISTLE_ASSERT(ex * ex + ey * ey > 0.999999 && ex * ex + ey * ey < 1.000001);
  BRISTLE_ASSERT(step.snaps_all == 0 || (step.from[0] == step.to[0] && step.from[1] == step.to[1]));
  BRISTLE_ASSERT(!redraw || patch.law->shortest > 0.0);
  BRISTLE_ASSERT(!redraw || patch.law->shortest <= patch.law->longest);
  BRISTLE_ASSERT(!redraw ||
                 (patch.law->jump_from > 0.0 && patch.law->stationary_from >= patch.law->jump_from));
  static_cast<void>(axes);
  static_cast<void>(redraw);
}

}  // namespace
}  // namespace bristle::detail
