// A population may shrink to any prefix of itself, since every prefix is well spread, and grow again by
// copies of those that stayed. Either way the sum of the deflections is off by a little then: a common shift
// of some bristles puts it right (core/MODEL.md, "Detail").
#include "core/patches/patch_detail.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/patches/patch_state.hpp"

namespace bristle::detail {
namespace {

/// What bristles that reached their snap length could not take of a shift.
struct Clipped {
  double lack[2] = {0.0, 0.0};  ///< weighted
  double weight = 0.0;
};

template <class T, int axes>
class Shifter {
 public:
  Shifter(PatchState& the_patch, std::uint32_t its_first)
      : patch(the_patch),
        zx(static_cast<T*>(the_patch.zx)),
        zy(static_cast<T*>(the_patch.zy)),
        delta(static_cast<const T*>(the_patch.delta)),
        first(its_first),
        end(the_patch.in_contact()),
        fraction(static_cast<T>(the_patch.fraction)) {}

  /// Shifts all bristles from `first` on together until the weighted sum of their deflections has grown by
  /// `lack`, none beyond its snap length. False: they cannot take it all; the rest is in `lack`.
  bool run(double (&lack)[2]) {
    if (first >= end) return false;
    const double all = weight_of(end - 1) + static_cast<double>(end - 1 - first);
    const double enough = std::numeric_limits<T>::epsilon() * size_of(lack);
    double free = all;
    for (int pass = 0; pass < most_passes && free > 0.0 && size_of(lack) > enough; ++pass) {
      const T shift[2] = {static_cast<T>(lack[0] / free), static_cast<T>(lack[1] / free)};
      Clipped clipped;
      std::uint32_t i = first;
      for (; i + lane_count <= end; i += lane_count) shift_row(i, lane_count, shift, clipped);
      shift_row(i, end - i, shift, clipped);
      free = all - clipped.weight;
      for (int axis = 0; axis < 2; ++axis)
        lack[axis] -= all * static_cast<double>(shift[axis]) - clipped.lack[axis];
    }
    return size_of(lack) <= enough;
  }

 private:
  static constexpr int most_passes = 24;
  /// Short of the snap length by what a sum of squares may round.
  static constexpr T inside = T(1) - T(8) * std::numeric_limits<T>::epsilon();

  PatchState& patch;
  T* zx;
  T* zy;
  const T* delta;
  std::uint32_t first, end;
  T fraction;

  static double size_of(const double (&lack)[2]) noexcept {
    return std::max(std::abs(lack[0]), std::abs(lack[1]));
  }
  double weight_of(std::uint32_t i) const noexcept {
    return i < patch.whole ? 1.0 : static_cast<double>(fraction);
  }

  [[gnu::always_inline]] void shift_row(std::uint32_t at, std::uint32_t count, const T (&shift)[2],
                                        Clipped& clipped) {
    T x[lane_count], y[lane_count] = {};
    int any = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      x[k] = zx[at + k] + shift[0];
      T squares = x[k] * x[k];
      if constexpr (axes == 2) {
        y[k] = zy[at + k] + shift[1];
        squares += y[k] * y[k];
      }
      const T limit = delta[at + k] * inside;
      any |= squares > limit * limit;
    }
    if (any != 0) clip_row(at, count, x, y, clipped);
    for (std::uint32_t k = 0; k < count; ++k) zx[at + k] = x[k];
    if constexpr (axes == 1) return;
    for (std::uint32_t k = 0; k < count; ++k) zy[at + k] = y[k];
  }

  void clip_row(std::uint32_t at, std::uint32_t count, T (&x)[lane_count], T (&y)[lane_count],
                Clipped& clipped) {
    for (std::uint32_t k = 0; k < count; ++k) {
      const T limit = delta[at + k] * inside;
      const T squares = x[k] * x[k] + y[k] * y[k];
      if (!(squares > limit * limit)) continue;
      const T shrink = limit / std::sqrt(squares);
      const double weight = weight_of(at + k);
      clipped.lack[0] += weight * static_cast<double>(x[k] - x[k] * shrink);
      clipped.lack[1] += weight * static_cast<double>(y[k] - y[k] * shrink);
      clipped.weight += weight;
      x[k] *= shrink;
      y[k] *= shrink;
    }
  }
};

bool shift_bristles(PatchState& p, std::uint32_t first, double (&lack)[2]) noexcept {
  if (p.options.axes == 1)
    return p.is_double() ? Shifter<double, 1>(p, first).run(lack) : Shifter<float, 1>(p, first).run(lack);
  return p.is_double() ? Shifter<double, 2>(p, first).run(lack) : Shifter<float, 2>(p, first).run(lack);
}

/// Writes every block in contact down anew and gives the sums over them.
void rewrite_all(PatchState& p, double (&sums)[2]) noexcept {
  for (int axis = 0; axis < 2; ++axis) p.stored[axis] = p.offset[axis] = 0;
  for (std::uint32_t b = 0; b < p.active_blocks(); ++b) {
    p.rewrite_block(b);
    if (b < p.full_blocks()) p.book_block(b, +1);
  }
  for (int axis = 0; axis < 2; ++axis) sums[axis] = p.deflection_sum(axis);
}

/// All bristles share in bringing the sums to `wanted`.
void shift_all(PatchState& p, const double (&wanted)[2]) noexcept {
  double sums[2];
  rewrite_all(p, sums);
  double lack[2] = {wanted[0] - sums[0], wanted[1] - sums[1]};
  shift_bristles(p, 0, lack);
  rewrite_all(p, sums);
}

/// The last bristles leave; those that stay take over their share.
void drop_bristles(PatchState& p, const ContactCount& now, const double (&wanted)[2]) noexcept {
  const std::uint32_t old_blocks = p.active_blocks();
  const std::uint32_t old_contact = p.in_contact();
  p.whole = now.whole;
  p.fraction = now.fraction;
  const std::uint32_t blocks = p.active_blocks();
  for (std::uint32_t b = blocks; b < old_blocks; ++b) p.enter_block(b);
  p.forget_bristles(p.in_contact(), std::min(old_contact, blocks * block_size));
  shift_all(p, wanted);
}

/// Bristles [to, to + count) copy those from `from` on, of one block.
template <class T>
void copy_part(PatchState& p, std::uint32_t from, std::uint32_t to, std::uint32_t count) noexcept {
  const Block& block = p.blocks[from / block_size];
  auto* delta = static_cast<T*>(p.delta);
  const T* lengths = block.zero ? static_cast<const T*>(p.first) : delta;
  T* const columns[2] = {static_cast<T*>(p.zx), static_cast<T*>(p.zy)};
  for (int axis = 0; axis < p.options.axes; ++axis) {
    T* const z = columns[axis];
    const auto moved = static_cast<T>(p.moved_since(block, axis));
    for (std::uint32_t k = 0; k < count; ++k) {
      const T copied = (block.zero ? T(0) : z[from + k]) + moved;
      // With a length of its own a bristle is as far on the way to its snap.
      z[to + k] = p.draw != nullptr ? copied : copied * (delta[to + k] / delta[from + k]);
    }
  }
  if (p.draw != nullptr) std::copy_n(lengths + from, count, delta + to);
}

/// The first bristle to copy. Bristle i and its copy i + `count` have stratified lengths that differ by
/// frac(count / golden ratio) in share: with lengths of their own but nearly the same they would keep step
/// for long. One bristle on the difference is another.
std::uint32_t first_copied(const PatchState& p, std::uint32_t count) noexcept {
  if (p.draw != nullptr || count < 2) return 0;
  const double share = 0.6180339887498949 * count;
  return std::abs(share - std::floor(share + 0.5)) < 0.19 ? 1 : 0;
}

/// Bristles [first, in_contact) copy those before them, in turn.
template <class T>
void copy_bristles(PatchState& p, std::uint32_t first) noexcept {
  std::uint32_t from = first_copied(p, first);
  for (std::uint32_t to = first; to < p.in_contact();) {
    const std::uint32_t end = std::min((from / block_size + 1) * block_size, first);
    const std::uint32_t count = std::min(end - from, p.in_contact() - to);
    copy_part<T>(p, from, to, count);
    to += count;
    from = end < first ? end : 0;
  }
}

/// Weighted sum of bristles [from, in_contact).
template <class T>
void add_bristles(const PatchState& p, std::uint32_t from, double (&sums)[2]) noexcept {
  const T* const columns[2] = {static_cast<const T*>(p.zx), static_cast<const T*>(p.zy)};
  for (int axis = 0; axis < p.options.axes; ++axis) {
    const T* const z = columns[axis];
    double lanes[lane_count] = {};
    std::uint32_t i = from;
    for (; i + lane_count <= p.whole; i += lane_count)
      for (std::uint32_t k = 0; k < lane_count; ++k) lanes[k] += static_cast<double>(z[i + k]);
    for (; i < p.whole; ++i) lanes[0] += static_cast<double>(z[i]);
    if (p.fraction > 0.0) lanes[0] += static_cast<double>(static_cast<T>(p.fraction) * z[p.whole]);
    for (double lane : lanes) sums[axis] += lane;
  }
}

void add_bristles(const PatchState& p, std::uint32_t from, double (&sums)[2]) noexcept {
  if (p.is_double())
    add_bristles<double>(p, from, sums);
  else
    add_bristles<float>(p, from, sums);
}

/// Bristles come back as copies; they alone are shifted, so that what was there costs nothing.
void admit_copies(PatchState& p, const ContactCount& now, const double (&wanted)[2]) noexcept {
  const std::uint32_t old_blocks = p.active_blocks();
  const std::uint32_t old_full = p.full_blocks();
  const std::uint32_t old_contact = p.in_contact();
  const std::uint32_t old_whole = p.whole;
  if (old_contact == 0) {  // a load so small that not even a fraction of one was in contact
    p.whole = now.whole;
    p.fraction = now.fraction;
    for (std::uint32_t b = 0; b < p.active_blocks(); ++b) p.enter_block(b);
    return;
  }
  if (p.has_tail()) p.rewrite_block(old_full);
  double stay[2] = {0.0, 0.0};  // of those that counted whole and still do
  double edge[2] = {0.0, 0.0};
  add_bristles(p, old_whole, edge);
  for (int axis = 0; axis < 2; ++axis) stay[axis] = p.deflection_sum(axis) - edge[axis];

  p.whole = now.whole;
  p.fraction = now.fraction;
  for (std::uint32_t b = old_blocks; b < p.active_blocks(); ++b) {
    p.enter_block(b);
    p.blocks[b].zero = 0;  // written at once, below
  }
  p.forget_bristles(p.in_contact(), std::min(p.active_blocks() * block_size, p.padded()));
  if (p.is_double())
    copy_bristles<double>(p, old_contact);
  else
    copy_bristles<float>(p, old_contact);
  double come[2] = {0.0, 0.0};
  add_bristles(p, old_whole, come);
  double lack[2];
  for (int axis = 0; axis < 2; ++axis) lack[axis] = wanted[axis] - stay[axis] - come[axis];
  const bool met = shift_bristles(p, old_whole, lack);
  for (std::uint32_t b = old_full; b < p.active_blocks(); ++b) {
    p.rewrite_block(b);
    if (b < p.full_blocks()) p.book_block(b, +1);
  }
  if (!met) shift_all(p, wanted);
}

}  // namespace

void change_detail(PatchState& p, std::uint32_t bristles) noexcept {
  if (bristles == p.detail) return;
  const bool energy = has(p.options.outputs, Outputs::energy);
  const double before = energy ? find_stored_energy(p) : 0.0;
  const double old_count = p.weight * p.overload;  // physical bristles that one stood for
  const double sums[2] = {p.deflection_sum(0), p.deflection_sum(1)};
  p.detail = bristles;
  p.weight =
      bristles == p.bristles ? p.full_weight : p.full_weight * (static_cast<double>(p.bristles) / bristles);
  if (!(p.active > 0.0)) return;

  const ContactCount now = count_contacts(p.zeta, p.weight, p.detail);
  const bool fewer = now.active < p.active;
  p.active = now.active;
  p.overload = now.overload;
  p.forget_upper_bounds();
  const double ratio = old_count / (p.weight * p.overload);
  const double wanted[2] = {sums[0] * ratio, sums[1] * ratio};
  if (fewer)
    drop_bristles(p, now, wanted);
  else
    admit_copies(p, now, wanted);
  if (energy) p.pending_loss += before - find_stored_energy(p);
}

}  // namespace bristle::detail
