// Energy of a block, up to a factor. No step computes it, so one text serves the reference and every
// instruction set.
#pragma once

#include "core/kernel_table.hpp"
#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

/// Sum of weight |z + p|^2 over the bristles in contact of block b, scaled, by the fixed tree.
template <class T>
double block_squares(const PatchView<T>& patch, std::uint32_t b, const std::int64_t at[2]) {
  const Block& block = patch.blocks[b];
  const std::uint32_t start = b * block_size;
  const std::uint32_t in_contact = patch.whole + (patch.fraction > T(0) ? 1u : 0u);
  const std::uint32_t end = start + block_size < in_contact ? start + block_size : in_contact;
  const double px = displacement(at[0], block.position[0]);
  const double py = displacement(at[1], block.position[1]);
  double lanes[lane_count] = {};
  for (std::uint32_t i = start; i < end; ++i) {
    const double x = (block.zero ? 0.0 : static_cast<double>(patch.zx[i])) + px;
    const double y = patch.zy == nullptr ? 0.0 : (block.zero ? 0.0 : static_cast<double>(patch.zy[i])) + py;
    const double weight = i < patch.whole ? 1.0 : static_cast<double>(patch.fraction);
    lanes[i % lane_count] += weight * (x * x + y * y);
  }
  return tree_sum(lanes);
}

}  // namespace
}  // namespace bristle::detail
