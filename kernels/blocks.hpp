// Operations on blocks of 256 representatives besides a step: first contact, energy, and storing deflections
// relative to a position. They are written for single numbers, and the compiler vectorises them.
#pragma once

#include "core/kernel_table.hpp"
#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

/// Returns the number of bristles in contact, counting the last one even if it is in contact only in part.
template <class T>
inline std::uint32_t in_contact(const PatchView<T>& patch) {
  return patch.whole + (patch.fraction > T(0) ? 1u : 0u);
}
template <class T>
inline T weight_of(const PatchView<T>& patch, std::uint32_t i) {
  return i < patch.whole ? T(1) : i == patch.whole ? patch.fraction : T(0);
}
/// Returns the index after the last bristle of the block that begins at `start`.
template <class T>
inline std::uint32_t end_of_columns(const PatchView<T>& patch, std::uint32_t start) {
  const std::uint32_t padded = (patch.bristles + lane_count - 1) / lane_count * lane_count;
  return start + block_size < padded ? start + block_size : padded;
}

/// Writes the columns of a block whose bristles came into contact straight. Until a kernel first visits the
/// block, it is only marked as straight.
template <class T, int axes, bool redraw, bool ages>
inline void write_zero_block(const PatchView<T>& patch, std::uint32_t b) {
  if (!patch.blocks[b].zero) return;
  const std::uint32_t start = b * block_size, end = end_of_columns(patch, start);
  for (std::uint32_t i = start; i < end; ++i) {
    patch.zx[i] = T(0);
    if constexpr (axes == 2) patch.zy[i] = T(0);
    if constexpr (redraw) patch.delta[i] = patch.first[i];
    if constexpr (ages) patch.age[i] = T(0);
  }
  patch.blocks[b].zero = 0;
}

/// Rewrites the deflections of a block relative to the patch's position `at` (KernelSet::rewrite).
template <class T>
void rewrite_block(const PatchView<T>& patch, std::uint32_t b, const std::int64_t at[2]) {
  Block& block = patch.blocks[b];
  const std::uint32_t start = b * block_size, end = end_of_columns(patch, start);
  T* const columns[2] = {patch.zx, patch.zy};
  for (int axis = 0; axis < 2; ++axis) {
    T* const z = columns[axis];
    const T shift = static_cast<T>(displacement(at[axis], block.position[axis]));
    T lanes[lane_count] = {};
    for (std::uint32_t row = start; z != nullptr && row < end; row += lane_count) {
      for (std::uint32_t k = 0; k < lane_count; ++k) {
        const T weight = weight_of(patch, row + k);
        const T now = (block.zero ? T(0) : z[row + k]) + shift;
        z[row + k] = weight > T(0) ? now : T(0);
        lanes[k] += z[row + k] * weight;
      }
    }
    block.position[axis] = at[axis];
    block.stored[axis] = to_integer(static_cast<double>(tree_sum(lanes)) * fixed_per_length);
  }
  if (block.zero && patch.random != nullptr)
    for (std::uint32_t i = start; i < end; ++i) patch.delta[i] = patch.first[i];
  block.zero = 0;
  block.reach = 0.0f;
}

/// Returns the sum of weight x squared deflection, scaled, over the bristles of block b in contact, with the
/// patch at `at`. All instruction sets add in the same order (KernelSet::squares).
template <class T>
double block_squares(const PatchView<T>& patch, std::uint32_t b, const std::int64_t at[2]) {
  const Block& block = patch.blocks[b];
  const std::uint32_t start = b * block_size, contact = in_contact(patch);
  const std::uint32_t end = start + block_size < contact ? start + block_size : contact;
  const double px = displacement(at[0], block.position[0]);
  const double py = displacement(at[1], block.position[1]);
  double lanes[lane_count] = {};
  for (std::uint32_t i = start; i < end; ++i) {
    const double x = (block.zero ? 0.0 : static_cast<double>(patch.zx[i])) + px;
    const double y = patch.zy == nullptr ? 0.0 : (block.zero ? 0.0 : static_cast<double>(patch.zy[i])) + py;
    lanes[i % lane_count] += static_cast<double>(weight_of(patch, i)) * (x * x + y * y);
  }
  return tree_sum(lanes);
}

}  // namespace
}  // namespace bristle::detail
