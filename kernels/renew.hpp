// Shared renewal: the snaps of a piece of path make other bristles slip too (core/patches/RUBBING.md).
//
// Each renewal selects a bristle in contact by its number, and a point within the piece ahead. A bristle
// that is bent along the motion by more than the residual length at that point slips to the residual and
// samples a new snap length (SnapRule::redraw); on any other bristle the selection has no effect. The
// selected bristle is stored as if it had come from (residual - path) e, with e the direction of motion and
// `path` the path to the point. The step kernels then move it with all others, and the sums that they make
// along `path` are corrected here.
//
// A selection changes only its own bristle, and sums are integers, so the order of selections cannot change a
// sum.
#pragma once

#include "ageing.hpp"
#include "blocks.hpp"
#include "core/common/assert.hpp"
#include "core/kernel_table.hpp"
#include "law.hpp"
#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

/// Number of selections that are chosen together, so that their bristles can be prefetched.
constexpr std::uint32_t selections_at_once = 64;

/// Number of fine units (1 / Renewal::unit) in a coarse unit. A term of a sum over selections is rounded to
/// coarse units, and its remainder to fine ones, so that no digit is lost.
constexpr double finer = 0x1p40;

template <class T, int axes, bool redraw, bool ages>
class Renewer {
 public:
  Renewer(const PatchView<T>& the_patch, const Renewal& the_renewal, RenewalTotals& the_totals)
      : patch(the_patch),
        renewal(the_renewal),
        totals(the_totals),
        left(static_cast<double>(static_cast<T>(the_renewal.residual))),
        part(the_renewal.length / static_cast<double>(the_renewal.selections)),
        contact(in_contact(the_patch)),
        ageing(ages ? ageing_of<double>(the_renewal) : AgeingLaw<double>{}) {}

  /// Makes all selections of the piece in order, in groups; prefetches the bristles of the next group.
  void run() {
    BRISTLE_ASSERT(contact > 0 || renewal.selections == 0);
    Selections selections[2];
    select(0, selections[0]);
    for (std::uint64_t k = 0; k < renewal.selections; k += selections_at_once) {
      const std::uint64_t remaining = renewal.selections - k;
      const Selections& now = selections[k / selections_at_once % 2];
      if (remaining > selections_at_once)
        select(k + selections_at_once, selections[(k / selections_at_once + 1) % 2]);
      for (std::uint32_t n = 0; n < selections_at_once && n < remaining; ++n)
        renew(now.bristle[n], now.path[n]);
    }
  }

 private:
  const PatchView<T>& patch;
  const Renewal& renewal;
  RenewalTotals& totals;
  const double left;  ///< residual deflection that a snap leaves
  const double part;  ///< length of that part of the piece which belongs to each selection
  const std::uint32_t contact;
  const AgeingLaw<double> ageing;

  struct Selections {
    alignas(64) std::uint32_t bristle[selections_at_once];
    alignas(64) double path[selections_at_once];  ///< path from the start of the piece to the renewal point
  };
  /// State of a bristle at the start of the piece, before any renewal.
  struct Start {
    double shift[2];  ///< displacement of the bristle since its block's last rewrite
    double z[2];
    double along;    ///< deflection of the bristle along the motion
    double limit;    ///< deflection at which the bristle snaps, residual + snap length
    double chord2;   ///< square of the deflection along the motion at which the bristle snaps
    double aside2;   ///< square of the bristle's deflection across the motion
    double to_snap;  ///< path to the bristle's snap, if it ages and snaps before its renewal point
  };
  /// Energy and path integral of a bristle up to its renewal point, which its selection chose on
  /// the path.
  struct Passed {
    double bent2 = 0.0;    ///< squared deflection |z|^2 at the renewal point
    double squares = 0.0;  ///< sum of squared snap lengths over the snaps before the renewal point
    double twice_integral[2] = {0.0, 0.0};
  };

  /// Makes the selections from number `k_first` on: chooses for each a bristle, which it prefetches, and a
  /// point on the path of the piece. Each selection has its own part of the piece, so selections are ordered
  /// by point.
  void select(std::uint64_t k_first, Selections& selections) const {
    alignas(64) std::uint32_t low[selections_at_once];
    const std::uint64_t seed = renewal.key + (renewal.first_selection + k_first) * 0x9E3779B97F4A7C15u;
    const std::uint64_t count = contact;
    for (std::uint32_t k = 0; k < selections_at_once; ++k) {
      const std::uint64_t random = mix64(seed + k * 0x9E3779B97F4A7C15u);
      low[k] = static_cast<std::uint32_t>(random) >> 8;
      selections.bristle[k] = static_cast<std::uint32_t>((random >> 32) * count >> 32);
    }
    const double before = static_cast<double>(k_first);
    const double each = part;
    for (std::uint32_t k = 0; k < selections_at_once; ++k) {
      const double share = (static_cast<double>(static_cast<std::int32_t>(low[k])) + 0.5) * 0x1p-24;
      selections.path[k] = ((before + static_cast<double>(static_cast<std::int32_t>(k))) + share) * each;
    }
    for (const std::uint32_t i : selections.bristle) {
      __builtin_prefetch(patch.zx + i);
      if constexpr (axes == 2) __builtin_prefetch(patch.zy + i);
      __builtin_prefetch(patch.delta + i);
      if constexpr (redraw) __builtin_prefetch(patch.random + i);
    }
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

  /// Returns whether a bristle that ages snaps within the path `path` from the start of the piece.
  bool snaps_within(std::uint32_t i, double path, Start& start) const {
    const Block& block = patch.blocks[i / block_size];
    const double age = (block.zero ? 0.0 : static_cast<double>(patch.age[i])) +
                       age_since(renewal, patch.since[i / block_size]).before;
    const double fresh = start.limit - left;
    const Bent<double> bent{start.along, start.aside2};
    const double limit = left + fresh * growth<double>(ageing, most(age + ageing.per_length * path, 0.0));
    start.to_snap = path_to_circle<double, axes>(bent, limit);
    if (!(start.to_snap < path)) return false;
    start.to_snap = aged_path<double, axes>(ageing, bent, left, fresh, age, start.to_snap, true);
    return true;
  }

  /// Converts a sum's term to fine units, as an integer.
  Int128 in_units(double x) const {
    const double coarse = x * (renewal.unit / finer);
    BRISTLE_ASSERT(coarse > -0x1p51 && coarse < 0x1p51);
    const std::int64_t whole = to_integer(coarse);
    return static_cast<Int128>(whole) * static_cast<std::int64_t>(finer) +
           to_integer((coarse - static_cast<double>(whole)) * finer);
  }

  /// Renews bristle i, which slips to the residual at the renewal point after the path `path`, if it is bent
  /// enough there.
  void renew(std::uint32_t i, double path) {
    Block& block = patch.blocks[i / block_size];
    Start start = find_start(i);
    const double end = start.along + path;
    const bool snaps = ages ? snaps_within(i, path, start) : end > 0.0 && start.chord2 <= end * end;
    if (!snaps && !(end > left)) return;  // the bristle is not bent enough, so the selection has no effect
    write_zero_block<T, axes, redraw, ages>(patch, i / block_size);
    if constexpr (ages) age_block(i / block_size);
    const auto sample_length = [&] {
      return length_at<T>(*patch.law, share_of<T>(mix(patch.random[i] += random_stride)));
    };
    Passed passed;
    if (snaps)
      snap(start, path, sample_length, passed);
    else
      bend(start, path, passed);
    if constexpr (redraw) patch.delta[i] = static_cast<T>(left) + sample_length();
    if constexpr (ages) patch.age[i] = static_cast<T>(-(ageing.per_length * path));
    book(block, i, start, path, passed);
  }

  /// Rewrites the ages of a block relative to the start of the piece, so that the ages of renewed bristles
  /// keep their digits beside those of old ones.
  void age_block(std::uint32_t b) const {
    const T before = static_cast<T>(age_since(renewal, patch.since[b]).before);
    patch.since[b] = renewal.start;
    if (!(before > T(0))) return;
    const std::uint32_t start = b * block_size;
    for (std::uint32_t i = start; i < start + block_size && i < contact; ++i) patch.age[i] += before;
  }

  void bend(const Start& start, double path, Passed& passed) const {
    for (int axis = 0; axis < axes; ++axis) {
      const double z = start.z[axis] + path * renewal.direction[axis];
      passed.bent2 += z * z;
      passed.twice_integral[axis] = (start.z[axis] + z) * path;
    }
  }

  /// Moves a bristle that snaps before its renewal point through the snap to that point.
  template <class Sample>
  void snap(const Start& start, double path, const Sample& sample_length, Passed& passed) {
    const double to_snap =
        ages ? start.to_snap : least(most(root(most(start.chord2, 0.0)) - start.along, 0.0), path);
    const double remaining = path - to_snap;
    double further = 0.0;  // sum of squared lengths over the snaps after the first
    double r = remaining;
    ++totals.snaps;
    const auto path_of = [&](double length) {
      return ages ? aged_length<double>(ageing, length, r) : length;
    };
    if constexpr (redraw) {
      const auto next_path = [&] { return path_of(static_cast<double>(sample_length())); };
      for (double length = next_path(); length <= r; length = next_path()) {
        r -= length;
        further += length * length;
        ++totals.snaps;
      }
    } else {
      const double delta = path_of(start.limit - left);
      const double count = whole_part(r / delta);
      r = least(most(r - count * delta, 0.0), delta);
      further = count * (delta * delta);
      totals.snaps += to_count(count);
    }
    passed.bent2 = (left + r) * (left + r);
    const double reached = start.along + to_snap;
    passed.squares = (ages ? reached * reached + start.aside2 - left * left
                           : (start.limit - left) * (start.limit + left)) +
                     further + 2.0 * left * (remaining - r);
    const double after = 2.0 * left * remaining + further + r * r;
    for (int axis = 0; axis < axes; ++axis) {
      const double e = renewal.direction[axis];
      passed.twice_integral[axis] = (2.0 * start.z[axis] + to_snap * e) * to_snap + e * after;
    }
  }

  /// Stores the deflection from which the path `path` brings the bristle to the residual, and adds the
  /// changes to the totals.
  void book(Block& block, std::uint32_t i, const Start& start, double path, const Passed& passed) {
    const auto weight = static_cast<double>(weight_of(patch, i));
    const bool tail = patch.whole < (i / block_size + 1) * block_size;
    T* const columns[2] = {patch.zx, patch.zy};
    // Computes twice the integral of the deflection that the step kernels will wrongly count along `path`, in
    // order to subtract it.
    const double written = (2.0 * left - path) * path;
    for (int axis = 0; axis < axes; ++axis) {
      const double e = renewal.direction[axis];
      totals.twice_integral[axis] += in_units(weight * (passed.twice_integral[axis] - e * written));
      T& stored = columns[axis][i];
      const T now = static_cast<T>((left - path) * e - start.shift[axis]);
      const std::int64_t more =
          to_integer(weight * (static_cast<double>(now) - static_cast<double>(stored)) * fixed_per_length);
      stored = now;
      block.stored[axis] += more;
      if (!tail) totals.stored[axis] += more;
    }
    totals.squares += in_units(weight * ((passed.bent2 - left * left) + passed.squares));
    totals.tail_changed |= tail ? 1u : 0u;
    ++totals.renewed;
    block.reach = 0.0f;
    patch.groups[i / block_size / blocks_per_group].reach = 0.0;
  }
};

template <class T, int axes, bool redraw, bool ages>
void renew_bristles(const PatchView<T>& patch, const Renewal& renewal, RenewalTotals& totals) {
  Renewer<T, axes, redraw, ages>(patch, renewal, totals).run();
}

}  // namespace
}  // namespace bristle::detail
