// Changes the number of representatives in use. A population shrinks to its first bristles, since the first k
// are always spread well over the law, and grows by copies of bristles that stayed. The sum of deflections
// then has a small error, which a common shift of some bristles corrects (core/MODEL.md, "Detail").

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/patches/representatives/population.hpp"
#include "core/patches/representatives/representatives.hpp"

namespace bristle::detail {
namespace {

/// Sum of the shifts that bristles could not make because their deflection would exceed their snap length.
struct Clipped {
  double lack[2] = {0.0, 0.0};  ///< sum of weight x the part of the shift that was not made
  double weight = 0.0;
};

template <class T, int axes, bool ages>
class Shifter {
 public:
  Shifter(const Representatives<T>& its_record, std::uint32_t its_first)
      : r(its_record),
        zx(r.zx),
        zy(r.zy),
        delta(r.delta),
        first(its_first),
        end(r.in_contact()),
        fraction(static_cast<T>(r.fraction)) {}

  /// Shifts all bristles from number `first` on by one vector, none beyond its snap length, until the
  /// weighted sum of their deflections has grown by `lack`. If they cannot take all of it, returns false and
  /// leaves the rest in `lack`.
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
  /// Share of its snap length up to which a bristle is shifted, less than 1 by the rounding of a sum of
  /// squares.
  static constexpr T inside = T(1) - T(8) * std::numeric_limits<T>::epsilon();

  const Representatives<T>& r;
  T* zx;
  T* zy;
  const T* delta;
  std::uint32_t first, end;
  T fraction;

  static double size_of(const double (&lack)[2]) noexcept {
    return std::max(std::abs(lack[0]), std::abs(lack[1]));
  }
  T limit_of(std::uint32_t i) const noexcept {
    if constexpr (ages) return static_cast<T>(limit_now(r, i)) * inside;
    return delta[i] * inside;
  }
  double weight_of(std::uint32_t i) const noexcept {
    return i < r.whole ? 1.0 : static_cast<double>(fraction);
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
      const T limit = limit_of(at + k);
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
      const T limit = limit_of(at + k);
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

template <class T>
bool shift_bristles(const Representatives<T>& r, std::uint32_t first, double (&lack)[2]) noexcept {
  if (r.ages())
    return r.options.axes == 1 ? Shifter<T, 1, true>(r, first).run(lack)
                               : Shifter<T, 2, true>(r, first).run(lack);
  return r.options.axes == 1 ? Shifter<T, 1, false>(r, first).run(lack)
                             : Shifter<T, 2, false>(r, first).run(lack);
}

/// Rewrites all blocks in contact at the patch's position, and returns their sums of deflections in `sums`.
template <class T>
void rewrite_all(Patch& p, double (&sums)[2]) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  p.sum[0] = p.sum[1] = 0;
  for (std::uint32_t b = 0; b < r.active_blocks(); ++b) {
    rewrite_block<T>(p, b);
    if (b < r.full_blocks()) book_block<T>(p, b, +1);
  }
  note_count<T>(p);
  for (int axis = 0; axis < 2; ++axis) sums[axis] = deflection_sum(p, axis);
}

/// Shifts all bristles by one vector until the patch's sums of deflections are `wanted`.
template <class T>
void shift_all(Patch& p, const double (&wanted)[2]) noexcept {
  double sums[2];
  rewrite_all<T>(p, sums);
  double lack[2] = {wanted[0] - sums[0], wanted[1] - sums[1]};
  shift_bristles(representatives<T>(p), 0, lack);
  rewrite_all<T>(p, sums);
}

/// Takes the last bristles out of use, when detail falls; the others take over their share of the load.
template <class T>
void drop_bristles(Patch& p, const ContactCount& now, const double (&wanted)[2]) noexcept {
  Representatives<T>& r = representatives<T>(p);
  const std::uint32_t old_blocks = r.active_blocks();
  const std::uint32_t old_contact = r.in_contact();
  r.whole = now.whole;
  r.fraction = now.fraction;
  const std::uint32_t blocks = r.active_blocks();
  for (std::uint32_t b = blocks; b < old_blocks; ++b) enter_block<T>(p, b);
  forget_bristles(r, r.in_contact(), std::min(old_contact, blocks * block_size));
  shift_all<T>(p, wanted);
}

/// Bends a copied bristle so that it has gone the same fraction of the way from residual to snap as its
/// original, for SnapRule::keep with a residual.
template <class T>
void fit_to_length(const Representatives<T>& r, std::uint32_t from, std::uint32_t to) noexcept {
  const double left = static_cast<double>(static_cast<T>(r.material->residual));
  const double x = static_cast<double>(r.zx[to]);
  const double y = r.zy == nullptr ? 0.0 : static_cast<double>(r.zy[to]);
  const double bent = std::sqrt(x * x + y * y);
  if (!(bent > left)) return;
  const double lengths =
      (static_cast<double>(r.delta[to]) - left) / (static_cast<double>(r.delta[from]) - left);
  const double factor = (left + (bent - left) * lengths) / bent;
  r.zx[to] = static_cast<T>(x * factor);
  if (r.zy != nullptr) r.zy[to] = static_cast<T>(y * factor);
}

/// Copies `count` bristles of one block, from number `from` on, to the numbers from `to` on.
template <class T>
void copy_part(const Patch& p, std::uint32_t from, std::uint32_t to, std::uint32_t count) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const Block& block = r.blocks[from / block_size];
  const T* lengths = block.zero ? r.first : r.delta;
  const bool residual = r.material->residual > 0.0;
  T* const columns[2] = {r.zx, r.zy};
  for (int axis = 0; axis < r.options.axes; ++axis) {
    T* const z = columns[axis];
    const auto moved = static_cast<T>(moved_since(p, block, axis));
    for (std::uint32_t k = 0; k < count; ++k) {
      const T copied = (block.zero ? T(0) : z[from + k]) + moved;
      // Bends a copied bristle, whose snap length differs, to the fraction of its snap length to which its
      // original is bent.
      z[to + k] = r.redraws() || residual ? copied : copied * (r.delta[to + k] / r.delta[from + k]);
    }
  }
  if (r.age != nullptr) {
    const auto aged = static_cast<T>(aged_since<T>(p, from / block_size));
    for (std::uint32_t k = 0; k < count; ++k) r.age[to + k] = (block.zero ? T(0) : r.age[from + k]) + aged;
  }
  if (!r.redraws() && residual)
    for (std::uint32_t k = 0; k < count; ++k) fit_to_length(r, from + k, to + k);
  if (r.redraws()) std::copy_n(lengths + from, count, r.delta + to);
}

/// Returns the number of the first bristle to copy, 0 or 1. Bristle i and its copy i + `count` may have
/// nearly equal snap lengths and would snap in step for long; beginning with bristle 1 changes the difference
/// of their shares of the law. With the plain seed that difference is frac(count / golden ratio); with any
/// other seed the shares have as many bits in common as `count` ends in zeros.
template <class T>
std::uint32_t first_copied(const Representatives<T>& r, std::uint32_t count) noexcept {
  if (r.redraws() || count < 2) return 0;
  if (r.options.seed != plain_seed) return count % 4 == 0 ? 1 : 0;
  const double share = 0.6180339887498949 * count;
  return std::abs(share - std::floor(share + 0.5)) < 0.19 ? 1 : 0;
}

/// Fills the bristles from number `first` to the last in contact by copies of those before it, in turn.
template <class T>
void copy_bristles(const Patch& p, std::uint32_t first) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  std::uint32_t from = first_copied(r, first);
  for (std::uint32_t to = first; to < r.in_contact();) {
    const std::uint32_t end = std::min((from / block_size + 1) * block_size, first);
    const std::uint32_t count = std::min(end - from, r.in_contact() - to);
    copy_part<T>(p, from, to, count);
    to += count;
    from = end < first ? end : 0;
  }
}

/// Adds to `sums` the weighted deflections of the bristles in contact from number `from` on.
template <class T>
void add_bristles(const Representatives<T>& r, std::uint32_t from, double (&sums)[2]) noexcept {
  const T* const columns[2] = {r.zx, r.zy};
  for (int axis = 0; axis < r.options.axes; ++axis) {
    const T* const z = columns[axis];
    double lanes[lane_count] = {};
    std::uint32_t i = from;
    for (; i + lane_count <= r.whole; i += lane_count)
      for (std::uint32_t k = 0; k < lane_count; ++k) lanes[k] += static_cast<double>(z[i + k]);
    for (; i < r.whole; ++i) lanes[0] += static_cast<double>(z[i]);
    if (r.fraction > 0.0) lanes[0] += static_cast<double>(static_cast<T>(r.fraction) * z[r.whole]);
    for (double lane : lanes) sums[axis] += lane;
  }
}

/// Adds bristles as copies when detail rises. Shifts only copies: bristles before them need no rewrite.
template <class T>
void admit_copies(Patch& p, const ContactCount& now, const double (&wanted)[2]) noexcept {
  Representatives<T>& r = representatives<T>(p);
  const std::uint32_t old_blocks = r.active_blocks();
  const std::uint32_t old_full = r.full_blocks();
  const std::uint32_t old_contact = r.in_contact();
  const std::uint32_t old_whole = r.whole;
  if (old_contact == 0) {  // the load was so small that not even a fraction of a bristle was in contact
    r.whole = now.whole;
    r.fraction = now.fraction;
    for (std::uint32_t b = 0; b < r.active_blocks(); ++b) enter_block<T>(p, b);
    return;
  }
  if (r.has_tail()) rewrite_block<T>(p, old_full);
  note_tail<T>(p);
  double stay[2] = {0.0, 0.0};  // sum of deflections over the bristles that count fully both before and after
                                // the change
  double edge[2] = {0.0, 0.0};
  add_bristles(r, old_whole, edge);
  for (int axis = 0; axis < 2; ++axis) stay[axis] = deflection_sum(p, axis) - edge[axis];

  r.whole = now.whole;
  r.fraction = now.fraction;
  for (std::uint32_t b = old_blocks; b < r.active_blocks(); ++b) {
    enter_block<T>(p, b);
    r.blocks[b].zero = 0;  // copy_bristles() below writes these bristles
  }
  forget_bristles(r, r.in_contact(), std::min(r.active_blocks() * block_size, r.padded()));
  copy_bristles<T>(p, old_contact);
  double come[2] = {0.0, 0.0};
  add_bristles(r, old_whole, come);
  double lack[2];
  for (int axis = 0; axis < 2; ++axis) lack[axis] = wanted[axis] - stay[axis] - come[axis];
  const bool met = shift_bristles(r, old_whole, lack);
  for (std::uint32_t b = old_full; b < r.active_blocks(); ++b) {
    rewrite_block<T>(p, b);
    if (b < r.full_blocks()) book_block<T>(p, b, +1);
  }
  if (!met) shift_all<T>(p, wanted);
}

}  // namespace

template <class T>
Status set_detail(Patch& p, std::uint32_t bristles) noexcept {
  Representatives<T>& r = representatives<T>(p);
  if (bristles == 0 || bristles > r.bristles) return Status::bad_input;
  if (bristles == r.detail) return Status::ok;
  if (r.shared != nullptr) r.shared->end_slide();
  const bool energy = has(p.outputs, Outputs::energy);
  const double before = energy ? find_stored_energy<T>(p) : 0.0;
  const double old_count = r.weight * p.overload;  // physical bristles per representative before the change
  const double sums[2] = {deflection_sum(p, 0), deflection_sum(p, 1)};
  r.detail = bristles;
  r.weight =
      bristles == r.bristles ? r.full_weight : r.full_weight * (static_cast<double>(r.bristles) / bristles);
  if (!(r.active > 0.0)) {
    note_count<T>(p);
    return Status::ok;
  }

  const ContactCount now = count_contacts(p.zeta, r.weight, r.detail);
  const bool fewer = now.active < r.active;
  r.active = now.active;
  p.overload = now.overload;
  forget_upper_bounds<T>(p);
  const double ratio = old_count / (r.weight * p.overload);
  const double wanted[2] = {sums[0] * ratio, sums[1] * ratio};
  if (fewer)
    drop_bristles<T>(p, now, wanted);
  else
    admit_copies<T>(p, now, wanted);
  note_count<T>(p);
  if (energy) p.pending_loss += before - find_stored_energy<T>(p);
  return Status::ok;
}

BRISTLE_INSTANTIATE(set_detail)

}  // namespace bristle::detail
