// Drags representatives in a steady slide round a corner of the path, without computing their snaps
// (core/patches/RUBBING.md).
//
// Along a gently bent path the lengths |z| of the deflections are distributed as in a straight slide, to
// first order in the angle; only their directions differ. A bristle with the deflection z last snapped |z| -
// residual ago. The drag keeps every |z|, and turns each deflection to point back to where its bristle
// snapped. Written for single numbers; the compiler vectorises it.
#pragma once

#include "blocks.hpp"
#include "core/common/assert.hpp"

namespace bristle::detail {
namespace {

/// Sums over the bristles of a block, as one partial sum for each of the 16 lanes of a row.
template <class T>
struct CornerLanes {
  T stored[2][lane_count] = {};
  /// Path integral of weight x (deflection along the motion less |z|), by which the force of dragged bristles
  /// falls short of steady sliding.
  T lag[2][lane_count] = {};
};

/// Turns the deflections of a row of bristles round a corner of the path and adds them to the sums in
/// `lanes`; with `sums_lag` also to CornerLanes::lag. Bristles of weight 0 become straight.
template <class T, bool sums_lag>
void drag_row(const Corner& corner, const T (&shift)[2], const T (&weight)[lane_count], T* zx, T* zy,
              CornerLanes<T>& lanes) {
  constexpr T tiny = T(1e-30);
  const T ex = static_cast<T>(corner.direction[0]), ey = static_cast<T>(corner.direction[1]);
  const T before_x = static_cast<T>(corner.before[0]), before_y = static_cast<T>(corner.before[1]);
  const T length = static_cast<T>(corner.length), residual = static_cast<T>(corner.residual);
  const T shift_x = shift[0], shift_y = shift[1];
  // Copies the row into local arrays, so that the compiler knows that no other pointer refers to them, and
  // vectorises the loop.
  T row_x[lane_count], row_y[lane_count], lag_x[lane_count], lag_y[lane_count];
  for (std::uint32_t k = 0; k < lane_count; ++k) {
    const T x = zx[k] + shift_x;
    const T y = zy[k] + shift_y;
    const T bent = root(x * x + y * y);
    const T inverse = T(1) / (bent + tiny);
    const T to_ux = x * inverse - before_x, to_uy = y * inverse - before_y;
    // Computes `path`, the distance since the bristle's last snap, and `low`, the part of the deflection from
    // before the corner that is left at the end. If the bristle snapped before the corner, that part keeps
    // the share low / |z| of its angle to the earlier motion.
    const T beyond = bent - residual;
    const T path = beyond > T(0) ? beyond : T(0);
    const T low = bent - (path < length ? path : length);
    const T old = path > length ? low : T(0);
    const T share = old * inverse;
    const T chord_x = (bent - old) * ex + old * (before_x + share * to_ux);
    const T chord_y = (bent - old) * ey + old * (before_y + share * to_uy);
    const T scale = bent / (root(chord_x * chord_x + chord_y * chord_y) + tiny);
    row_x[k] = chord_x * scale;
    row_y[k] = chord_y * scale;
    if constexpr (sums_lag) {
      // Integrates t, the part of the deflection from before the corner, which falls from `bent` to `low`
      // along the dragged path, and t times its share of the bend. Then adds the part along the motion that
      // keeps |z| unchanged, of second order in the angle.
      const T back = T(0.5) * (bent * bent - low * low);
      const T bent_back = (bent * bent * bent - low * low * low) * T(1.0 / 3.0) * inverse;
      const T off_x = to_ux + (before_x - ex), off_y = to_uy + (before_y - ey);
      const T kept = T(0.5) * (off_x * off_x + off_y * off_y) * (back - bent_back);
      lag_x[k] = (before_x - ex) * back + to_ux * bent_back + ex * kept;
      lag_y[k] = (before_y - ey) * back + to_uy * bent_back + ey * kept;
    }
  }
  for (std::uint32_t k = 0; k < lane_count; ++k) {
    zx[k] = weight[k] > T(0) ? row_x[k] : T(0);
    zy[k] = weight[k] > T(0) ? row_y[k] : T(0);
    lanes.stored[0][k] += weight[k] * row_x[k];
    lanes.stored[1][k] += weight[k] * row_y[k];
    if constexpr (sums_lag) {
      lanes.lag[0][k] += weight[k] * lag_x[k];
      lanes.lag[1][k] += weight[k] * lag_y[k];
    }
  }
}

template <class T>
double sum_of_lanes(const T (&lanes)[lane_count]) noexcept {
  double sum = 0.0;
  for (const T lane : lanes) sum += static_cast<double>(lane);
  return sum;
}

/// Drags the blocks [first, last) of a patch round a corner of its path (KernelSet::drag).
template <class T, bool sums_lag>
void drag_blocks(const PatchView<T>& patch, const Corner& corner, std::uint32_t first, std::uint32_t last,
                 RenewalTotals& totals) {
  for (std::uint32_t b = first; b < last; ++b) {
    Block& block = patch.blocks[b];
    BRISTLE_ASSERT(block.zero == 0);
    const std::uint32_t start = b * block_size, end = end_of_columns(patch, start);
    T shift[2];
    for (int axis = 0; axis < 2; ++axis)
      shift[axis] = static_cast<T>(displacement(corner.at[axis], block.position[axis]));
    const bool tail = b >= patch.whole / block_size;
    CornerLanes<T> lanes;
    T weight[lane_count];
    for (T& w : weight) w = T(1);
    for (std::uint32_t i = start; i < end; i += lane_count) {
      for (std::uint32_t k = 0; tail && k < lane_count; ++k) weight[k] = weight_of(patch, i + k);
      drag_row<T, sums_lag>(corner, shift, weight, patch.zx + i, patch.zy + i, lanes);
    }
    for (int axis = 0; axis < 2; ++axis) {
      const std::int64_t now = to_integer(sum_of_lanes(lanes.stored[axis]) * fixed_per_length);
      if (!tail)
        totals.stored[axis] += static_cast<Int128>(now) - block.stored[axis] -
                               Int128{block_size} * difference(corner.at[axis], block.position[axis]);
      block.stored[axis] = now;
      block.position[axis] = corner.at[axis];
      totals.twice_integral[axis] += to_integer(2.0 * sum_of_lanes(lanes.lag[axis]) * corner.unit);
    }
    totals.tail_changed |= tail ? 1u : 0u;
    block.reach = 0.0f;
    patch.groups[b / blocks_per_group].reach = 0.0;
  }
}

}  // namespace
}  // namespace bristle::detail
