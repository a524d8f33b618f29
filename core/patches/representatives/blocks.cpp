#include <algorithm>

#include "core/patches/representatives/representatives.hpp"

namespace bristle::detail {
namespace {

/// Returns the weight of the bristles in contact in the last block, which is partly filled: a number of
/// bristles, not always whole.
template <class T>
double tail_weight(const Representatives<T>& r) noexcept {
  return static_cast<double>(r.whole - r.full_blocks() * block_size) +
         static_cast<double>(static_cast<T>(r.fraction));
}

}  // namespace

template <class T>
void rewrite_block(const Patch& p, std::uint32_t b) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  if (r.age != nullptr) write_ages<T>(p, b);
  r.kernels->rewrite(r.view(), b, p.position);
}

template <class T>
void enter_block(const Patch& p, std::uint32_t b) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  Block& block = r.blocks[b];
  block.zero = 1;
  if (r.since != nullptr) r.since[b] = time_of(p);
  // Bounds the motion in which no bristle of a block of straight bristles snaps: the patch may move by the
  // shortest of their snap lengths.
  block.reach = block.shortest * (1.0f - 1e-5f);
  for (int axis = 0; axis < 2; ++axis) {
    block.position[axis] = block.anchor[axis] = p.position[axis];
    block.stored[axis] = 0;
  }
}

template <class T>
void book_block(Patch& p, std::uint32_t b, int sign) noexcept {
  const Block& block = representatives<T>(p).blocks[b];
  for (int axis = 0; axis < 2; ++axis) {
    const Int128 moved = difference(p.position[axis], block.position[axis]);
    p.sum[axis] += sign * (static_cast<Int128>(block.stored[axis]) + Int128{block_size} * moved);
  }
}

template <class T>
double block_squares(const Patch& p, std::uint32_t b) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const double across = r.lay.energy;
  if (across == 1.0) return r.kernels->squares(r.view(), b, p.position);
  double sum = 0.0;
  const Block& block = r.blocks[b];
  for (std::uint32_t i = b * block_size; i < std::min((b + 1) * block_size, r.in_contact()); ++i) {
    double z[2] = {moved_since(p, block, 0), moved_since(p, block, 1)};
    if (!block.zero) {
      z[0] += static_cast<double>(r.zx[i]);
      z[1] += static_cast<double>(r.zy[i]);
    }
    sum += (i < r.whole ? 1.0 : r.fraction) * (z[0] * z[0] + across * z[1] * z[1]);
  }
  return sum;
}

template <class T>
double all_squares(const Patch& p) noexcept {
  double squares = 0.0;
  for (std::uint32_t b = 0; b < representatives<T>(p).active_blocks(); ++b) squares += block_squares<T>(p, b);
  return squares;
}

template <class T>
double joules_per_square(const Patch& p) noexcept {
  const CompiledMaterial& m = p.material();
  return 0.5 * m.material.bristle_stiffness * representatives<T>(p).full_weight * p.overload *
         m.metres_per_length * m.metres_per_length;
}

template <class T>
void forget_bristles(Representatives<T>& r, std::uint32_t from, std::uint32_t to) noexcept {
  if (!r.redraws()) return;  // snap lengths never change with SnapRule::keep
  for (std::uint32_t i = from; i < to; ++i) r.delta[i] = r.first[i];
}

template <class T>
void forget_upper_bounds(Patch& p) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  p.known = Bound::none;
  for (std::uint32_t g = 0; g < r.group_count; ++g) r.groups[g].reach = 0.0;
}

template <class T>
void note_tail(Patch& p) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  if (!r.has_tail()) return;
  const Block& tail = r.blocks[r.full_blocks()];
  for (int axis = 0; axis < 2; ++axis) {
    p.part_sum[axis] = tail.stored[axis];
    p.part_position[axis] = tail.position[axis];
  }
}

template <class T>
void note_count(Patch& p) noexcept {
  Representatives<T>& r = representatives<T>(p);
  const CompiledMaterial& m = p.material();
  r.largest_work = r.bristles;
  p.whole = r.full_blocks() * block_size;
  p.part = r.has_tail() ? tail_weight(r) : 0.0;
  p.newtons_per_unit =
      m.material.bristle_stiffness * r.full_weight * p.overload * m.metres_per_length * length_per_fixed;
  note_tail<T>(p);
  note_contact(p);
}

BRISTLE_INSTANTIATE(rewrite_block, enter_block, book_block, block_squares, all_squares, joules_per_square,
                    forget_bristles, forget_upper_bounds, note_tail, note_count)

}  // namespace bristle::detail
