// Shared renewal: what the snaps of a piece of path do to other bristles (core/patches/RUBBING.md).
//
// Bristles are drawn by number out of those in contact, each at a place of the piece that lies ahead. One
// that is bent along the motion by more than the residual there slips to it and draws a fresh snap length
// (redraw); any other draw is spent. It is written down as if it had come from (residual - way) e: the
// kernels carry it on from there, with all others, and what they count before that place is put right here.
// One text for the reference and every instruction set: they differ in `Lengths`, which turns draw states
// into snap lengths.
#pragma once

#include "ageing.hpp"
#include "core/common/assert.hpp"
#include "core/kernel_table.hpp"
#include "law.hpp"
#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

constexpr std::uint32_t draws_together = 64;  ///< so that snap lengths are drawn in vectors

template <class T, int axes, bool redraw, bool ages, class Lengths>
class Renewer {
 public:
  Renewer(const PatchView<T>& the_patch, const Renewal& the_renewal, RenewalTotals& the_totals)
      : patch(the_patch),
        renewal(the_renewal),
        totals(the_totals),
        left(static_cast<double>(static_cast<T>(the_renewal.residual))),
        part(the_renewal.length / static_cast<double>(the_renewal.draws)),
        in_contact(the_patch.whole + (the_patch.fraction > T(0) ? 1u : 0u)),
        ageing(ages ? ageing_of<double>(the_renewal) : AgeingLaw<double>{}) {}

  void run() {
    BRISTLE_ASSERT(in_contact > 0 || renewal.draws == 0);
    for (std::uint64_t k = 0; k < renewal.draws; k += draws_together) {
      const std::uint64_t rest = renewal.draws - k;
      renew(k, rest < draws_together ? static_cast<std::uint32_t>(rest) : draws_together);
    }
  }

 private:
  const PatchView<T>& patch;
  const Renewal& renewal;
  RenewalTotals& totals;
  const double left;  ///< residual
  const double part;  ///< of the piece, for each draw
  const std::uint32_t in_contact;
  const AgeingLaw<double> ageing;

  struct Drawn {
    std::uint32_t bristle;
    double way;  ///< path from the start of the piece to the place where it slips
  };
  /// Where a bristle is at the start of the piece.
  struct Start {
    double shift[2];  ///< displacement since its block's last rewrite
    double z[2];
    double along;    ///< the motion
    double limit;    ///< residual + snap length
    double chord2;   ///< square of how far along the motion it bends before it snaps
    double aside2;   ///< square of how far it is bent aside of the motion
    double to_snap;  ///< with ageing: way to its snap, if that comes before the place where it was drawn
  };
  /// What it does up to the place where it was drawn.
  struct Passed {
    double bent2 = 0.0;    ///< |z|^2 there
    double squares = 0.0;  ///< of what slipped in snaps
    double twice_integral[2] = {0.0, 0.0};
  };

  /// The k-th. Each has its part of the piece to itself: so they come in the order of their places.
  Drawn draw(std::uint64_t k) const {
    const std::uint64_t random = mix64(renewal.key + (renewal.first_draw + k) * 0x9E3779B97F4A7C15u);
    const double share = (static_cast<double>((random & 0xFFFFFFFFu) >> 8) + 0.5) * 0x1p-24;
    return {static_cast<std::uint32_t>((random >> 32) * in_contact >> 32),
            (static_cast<double>(k) + share) * part};
  }

  Start find_start(std::uint32_t i) const {
    const Block& block = patch.blocks[i / block_size];
    const T* const columns[2] = {patch.zx, patch.zy};
    Start start{};
    for (int axis = 0; axis < axes; ++axis) {
      start.shift[axis] = displacement(renewal.from[axis], block.position[axis]);
      start.z[axis] = (block.zero ? 0.0 : static_cast<double>(columns[axis][i])) + start.shift[axis];
      start.along += start.z[axis] * renewal.direction[axis];
    }
    start.limit = static_cast<double>((block.zero ? patch.first : patch.delta)[i]);
    start.chord2 = start.limit * start.limit;
    if constexpr (axes == 2) {
      const double aside = start.z[0] * renewal.direction[1] - start.z[1] * renewal.direction[0];
      start.aside2 = aside * aside;
      start.chord2 -= start.aside2;
    }
    return start;
  }

  /// With ageing: whether a bristle snaps on this way.
  bool snaps_within(std::uint32_t i, double way, Start& start) const {
    const Block& block = patch.blocks[i / block_size];
    const double age = (block.zero ? 0.0 : static_cast<double>(patch.age[i])) +
                       age_since(renewal, patch.since[i / block_size]).before;
    const double fresh = start.limit - left;
    const Bent<double> bent{start.along, start.aside2};
    const double limit = left + fresh * growth<double>(ageing, most(age + ageing.per_length * way, 0.0));
    start.to_snap = way_to_circle<double, axes>(bent, limit);
    if (!(start.to_snap < way)) return false;
    start.to_snap = aged_way<double, axes>(ageing, bent, left, fresh, age, start.to_snap, true);
    return true;
  }

  void renew(std::uint64_t first, std::uint32_t count) {
    Drawn drawn[draws_together];
    for (std::uint32_t k = 0; k < count; ++k) {
      drawn[k] = draw(first + k);
      __builtin_prefetch(patch.zx + drawn[k].bristle);
      if constexpr (axes == 2) __builtin_prefetch(patch.zy + drawn[k].bristle);
      if constexpr (redraw) __builtin_prefetch(patch.draw + drawn[k].bristle);
    }
    alignas(64) std::uint32_t states[draws_together];
    alignas(64) T lengths[draws_together];
    if constexpr (redraw) {
      for (std::uint32_t k = 0; k < count; ++k) states[k] = patch.draw[drawn[k].bristle] + draw_stride;
      Lengths::fill(*patch.law, states, count, lengths);
    }
    for (std::uint32_t k = 0; k < count; ++k)
      slip(drawn[k], redraw ? states[k] : 0u, redraw ? lengths[k] : T(0));
  }

  /// `length` is that of the draw state `state`, which is the bristle's next unless it was drawn twice.
  void slip(const Drawn& drawn, std::uint32_t state, T length) {
    const std::uint32_t i = drawn.bristle;
    Block& block = patch.blocks[i / block_size];
    Start start = find_start(i);
    const double end = start.along + drawn.way;
    const bool snaps = ages ? snaps_within(i, drawn.way, start) : end > 0.0 && start.chord2 <= end * end;
    if (!snaps && !(end > left)) return;  // the draw is spent
    if (block.zero) write_down(block, i / block_size * block_size);
    if constexpr (ages) age_block(i / block_size);
    T fresh{};
    const auto draw_length = [&] {
      const std::uint32_t next = patch.draw[i] += draw_stride;
      fresh = next == state ? length : length_at<T>(*patch.law, share_of<T>(mix(next)));
    };
    Passed passed;
    if (snaps)
      snap(start, drawn.way, draw_length, fresh, passed);
    else
      bend(start, drawn.way, passed);
    if constexpr (redraw) {
      draw_length();
      patch.delta[i] = static_cast<T>(left) + fresh;
    }
    if constexpr (ages) patch.age[i] = static_cast<T>(-(ageing.per_length * drawn.way));
    book(block, i, start, drawn.way, passed);
  }

  /// Ages of a block written down at the start of the piece: those of young bristles among old ones keep
  /// their digits.
  void age_block(std::uint32_t b) const {
    const T before = static_cast<T>(age_since(renewal, patch.since[b]).before);
    patch.since[b] = renewal.start;
    if (!(before > T(0))) return;
    const std::uint32_t start = b * block_size;
    for (std::uint32_t i = start; i < start + block_size && i < in_contact; ++i) patch.age[i] += before;
  }

  void bend(const Start& start, double way, Passed& passed) const {
    for (int axis = 0; axis < axes; ++axis) {
      const double z = start.z[axis] + way * renewal.direction[axis];
      passed.bent2 += z * z;
      passed.twice_integral[axis] = (start.z[axis] + z) * way;
    }
  }

  /// It snaps before the place where it was drawn, and goes on to there.
  template <class Draw>
  void snap(const Start& start, double way, const Draw& draw_length, const T& fresh, Passed& passed) {
    const double to_snap =
        ages ? start.to_snap : least(most(root(most(start.chord2, 0.0)) - start.along, 0.0), way);
    const double rest = way - to_snap;
    double further = 0.0;  // sum of delta^2
    double r = rest;
    ++totals.snaps;
    const auto way_of = [&](double length) { return ages ? aged_length<double>(ageing, length, r) : length; };
    if constexpr (redraw) {
      draw_length();
      for (double length = way_of(static_cast<double>(fresh)); length <= r;) {
        r -= length;
        further += length * length;
        ++totals.snaps;
        draw_length();
        length = way_of(static_cast<double>(fresh));
      }
    } else {
      const double delta = way_of(start.limit - left);
      const double count = whole_part(r / delta);
      r = least(most(r - count * delta, 0.0), delta);
      further = count * (delta * delta);
      totals.snaps += to_count(count);
    }
    passed.bent2 = (left + r) * (left + r);
    const double reached = start.along + to_snap;
    passed.squares = (ages ? reached * reached + start.aside2 - left * left
                           : (start.limit - left) * (start.limit + left)) +
                     further + 2.0 * left * (rest - r);
    const double after = 2.0 * left * rest + further + r * r;
    for (int axis = 0; axis < axes; ++axis) {
      const double e = renewal.direction[axis];
      passed.twice_integral[axis] = (2.0 * start.z[axis] + to_snap * e) * to_snap + e * after;
    }
  }

  /// Writes the bristle down so that it is bent by the residual at `way`, and sums what changed.
  void book(Block& block, std::uint32_t i, const Start& start, double way, const Passed& passed) {
    const double weight = i < patch.whole ? 1.0 : static_cast<double>(patch.fraction);
    const bool tail = patch.whole < (i / block_size + 1) * block_size;
    T* const columns[2] = {patch.zx, patch.zy};
    const double written = (2.0 * left - way) * way;  // twice the integral that the kernels will count
    for (int axis = 0; axis < axes; ++axis) {
      const double e = renewal.direction[axis];
      totals.twice_integral[axis] += weight * (passed.twice_integral[axis] - e * written);
      T& stored = columns[axis][i];
      const T now = static_cast<T>((left - way) * e - start.shift[axis]);
      const std::int64_t more =
          to_integer(weight * (static_cast<double>(now) - static_cast<double>(stored)) * fixed_per_length);
      stored = now;
      block.stored[axis] += more;
      if (!tail) totals.stored[axis] += more;
    }
    totals.squares += weight * ((passed.bent2 - left * left) + passed.squares);
    totals.tail_changed |= tail ? 1u : 0u;
    ++totals.renewed;
    block.reach = -1.0f;
    patch.groups[i / block_size / blocks_per_group].reach = -1.0;
  }

  /// A block that entered together and was not visited since.
  void write_down(Block& block, std::uint32_t start) const {
    const std::uint32_t padded = (patch.bristles + lane_count - 1) / lane_count * lane_count;
    for (std::uint32_t i = start; i < start + block_size && i < padded; ++i) {
      patch.zx[i] = T(0);
      if constexpr (axes == 2) patch.zy[i] = T(0);
      if constexpr (redraw) patch.delta[i] = patch.first[i];
      if constexpr (ages) patch.age[i] = T(0);
    }
    block.zero = 0;
  }
};

template <class T, int axes, bool redraw, bool ages, class Lengths>
void renew_bristles(const PatchView<T>& patch, const Renewal& renewal, RenewalTotals& totals) {
  Renewer<T, axes, redraw, ages, Lengths>(patch, renewal, totals).run();
}

}  // namespace
}  // namespace bristle::detail
