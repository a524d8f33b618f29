// Shared renewal: the snaps of a piece of path make other bristles slip too (core/patches/RUBBING.md).
//
// Each renewal selects a bristle in contact by its number, and a point within the piece ahead. A bristle
// that is bent along the motion by more than the residual length at that point slips to the residual and
// samples a new snap length (SnapRule::redraw); on any other bristle the selection has no effect. The
// selected bristle is stored as if it had come from (residual - path) e, with e the direction of motion and
// `path` the path to the point. The step kernels then move it with all others, and the sums that they make
// along `path` are corrected here.
//
// A renewer serves a range of blocks and passes over selections of other bristles. A selection changes only
// its own bristle and sums are integers, so ranges can be processed in any order. Instruction sets differ in
// `Lengths`, which computes from random states snap lengths and says whether selections are processed in
// columns (for the widest vectors) or one by one. Both give the same bits.
#pragma once

#include "ageing.hpp"
#include "blocks.hpp"
#include "core/common/assert.hpp"
#include "core/kernel_table.hpp"
#include "law.hpp"
#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

constexpr std::uint32_t selections_at_once =
    64;  ///< number of selections processed together, column by column
constexpr std::uint32_t marks =
    8192;  ///< size of the table that finds bristles selected twice, a power of two

/// Number of fine units (1 / Renewal::unit) in a coarse unit. Sums over selections first add up each term
/// rounded to coarse units, then the remainders in fine units, so that no digit is lost.
constexpr double finer = 0x1p40;

template <class T, int axes, bool redraw, bool ages, class Lengths>
class Renewer {
 public:
  Renewer(const PatchView<T>& the_patch, const Renewal& the_renewal, std::uint32_t first_block,
          std::uint32_t last_block, RenewalTotals& the_totals)
      : patch(the_patch),
        renewal(the_renewal),
        totals(the_totals),
        first(first_block * block_size),
        size(last_block * block_size - first),
        left(static_cast<double>(static_cast<T>(the_renewal.residual))),
        part(the_renewal.length / static_cast<double>(the_renewal.selections)),
        contact(in_contact(the_patch)),
        ageing(ages ? ageing_of<double>(the_renewal) : AgeingLaw<double>{}) {}

  void run() {
    BRISTLE_ASSERT(contact > 0 || renewal.selections == 0);
    clear_marks();
    if (size >= contact)
      renew_all();
    else
      renew_range();
  }

 private:
  /// Whether selections are processed in columns. With vectors of two or four doubles that would gain
  /// nothing.
  static constexpr bool by_columns = Lengths::by_columns && !ages;

  const PatchView<T>& patch;
  const Renewal& renewal;
  RenewalTotals& totals;
  /// First bristle of the range and number of bristles in it. The last block may contain bristles out of
  /// contact.
  const std::uint32_t first, size;
  const double left;  ///< residual deflection that a snap leaves
  const double part;  ///< length of that part of the piece which belongs to each selection
  const std::uint32_t contact;
  const AgeingLaw<double> ageing;
  /// Table of the bristles selected in this group, indexed by the last bits of a bristle's number: the entry
  /// is `mark` if a bristle with these bits was selected. It tells possible repeats.
  std::uint8_t marked[by_columns ? marks : 1];
  std::uint8_t mark = 0;

  struct Selections {
    alignas(64) std::uint32_t bristle[selections_at_once];
    alignas(64) double path[selections_at_once];  ///< path from the start of the piece to the renewal point
  };
  /// Selections that fall into the renewer's range, collected until there are enough to process in vectors.
  struct Waiting {
    std::uint32_t bristle[2 * selections_at_once];
    double path[2 * selections_at_once];
    std::uint32_t count = 0;
  };
  /// Contributions of selections to the totals of the patch. A selection that has no effect contributes 0.
  struct Gains {
    alignas(64) double twice_integral[axes][selections_at_once];
    alignas(64) double squares[selections_at_once];
  };
  /// Columns with an entry for each selection: state of the selected bristle before and after its renewal.
  struct Columns {
    /// Displacement of the bristle from the last rewrite of its block to the start of the piece.
    alignas(64) double shift[axes][selections_at_once];
    alignas(64) T stored[axes][selections_at_once];
    alignas(64) T limit[selections_at_once];
    alignas(64) T now[axes][selections_at_once];  ///< new value of `stored` (deflection) after the selection
    alignas(64) double change[axes][selections_at_once];  ///< change of `stored`, in fixed-point units
    alignas(64) std::uint64_t slips[selections_at_once];
    alignas(64) std::uint64_t snaps[selections_at_once];
    /// Random state from which the bristle's next snap length is sampled (SnapRule::redraw).
    alignas(64) std::uint32_t state[selections_at_once];
    alignas(64) T length[selections_at_once];  ///< snap length that the bristle's next random number gives
    std::uint8_t alone[selections_at_once];    ///< 1 if the selection must be handled by itself, otherwise 0
  };
  struct List {
    std::uint32_t k[selections_at_once];
    std::uint32_t size = 0;
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

  /// Makes all selections of the piece, in groups; prefetches the bristles of the next group.
  void renew_all() {
    Selections selections[2];
    select(0, selections[0]);
    fetch(selections[0].bristle, selections_at_once);
    for (std::uint64_t k = 0; k < renewal.selections; k += selections_at_once) {
      const std::uint64_t remaining = renewal.selections - k;
      Selections& next = selections[(k / selections_at_once + 1) % 2];
      if (remaining > selections_at_once) {
        select(k + selections_at_once, next);
        fetch(next.bristle, selections_at_once);
      }
      renew(selections[k / selections_at_once % 2],
            remaining < selections_at_once ? static_cast<std::uint32_t>(remaining) : selections_at_once);
    }
  }

  /// Makes, in order, the selections whose bristle is in this renewer's range. Other renewers make the
  /// others.
  void renew_range() {
    Selections selected, ready;
    Waiting waiting;
    std::uint32_t count = 0;  // number of selections in `ready`
    for (std::uint64_t k = 0; k < renewal.selections; k += selections_at_once) {
      const std::uint64_t remaining = renewal.selections - k;
      select(k, selected);
      sift(selected,
           remaining < selections_at_once ? static_cast<std::uint32_t>(remaining) : selections_at_once,
           waiting);
      if (waiting.count < selections_at_once) continue;
      if (count > 0) renew(ready, count);
      count = selections_at_once;
      take(waiting, count, ready);
    }
    if (count > 0) renew(ready, count);
    count = waiting.count;
    take(waiting, count, ready);
    if (count > 0) renew(ready, count);
  }

  /// Keeps the selections whose bristle is in the range. Has no branch, because it could not be predicted.
  void sift(const Selections& selected, std::uint32_t count, Waiting& waiting) const {
    const std::uint32_t before = waiting.count;
    std::uint32_t n = before;
    for (std::uint32_t k = 0; k < count; ++k) {
      waiting.bristle[n] = selected.bristle[k];
      waiting.path[n] = selected.path[k];
      n += selected.bristle[k] - first < size ? 1u : 0u;
    }
    waiting.count = n;
    fetch(waiting.bristle + before, n - before);
  }

  /// Moves the first `count` waiting selections to `selections`, whose unused entries get some bristle of the
  /// range.
  void take(Waiting& waiting, std::uint32_t count, Selections& selections) const {
    for (std::uint32_t k = 0; k < selections_at_once; ++k) {
      selections.bristle[k] = k < count ? waiting.bristle[k] : first;
      selections.path[k] = k < count ? waiting.path[k] : 0.0;
    }
    waiting.count -= count;
    std::memmove(waiting.bristle, waiting.bristle + count, waiting.count * sizeof waiting.bristle[0]);
    std::memmove(waiting.path, waiting.path + count, waiting.count * sizeof waiting.path[0]);
  }

  /// Makes the selections from number `k_first` on: chooses for each a bristle and a point on the path of the
  /// piece. Each selection has its own part of the piece, so selections are ordered by point.
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
  }

  [[gnu::always_inline]] void fetch(const std::uint32_t* bristles, std::uint32_t count) const {
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t i = bristles[k];
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

  void renew(const Selections& selections, std::uint32_t count) {
    Columns columns;
    Gains gains;
    if constexpr (redraw) {
      for (std::uint32_t k = 0; k < selections_at_once; ++k)
        columns.state[k] = patch.random[selections.bristle[k]] + random_stride;
      Lengths::fill(*patch.law, columns.state, count, columns.length);
    }
    if constexpr (!by_columns) {
      for (std::uint32_t k = 0; k < count; ++k) slip(selections, k, columns, gains);
    } else {
      read(selections, count, columns);
      bend_all(selections, columns, gains);
      List list, remaining;
      sort(count, columns, list, remaining);
      write(selections, columns, list);
      for (std::uint32_t n = 0; n < remaining.size; ++n) slip(selections, remaining.k[n], columns, gains);
    }
    for (int axis = 0; axis < axes; ++axis)
      totals.twice_integral[axis] += sum_of(gains.twice_integral[axis], count);
    totals.squares += sum_of(gains.squares, count);
  }

  /// Sums a column in integer units, so that the order of selections cannot change the sum. Adding `whole` to
  /// a double below 2^51 rounds it to an integer, which then stands in the low bits. A second sum, in finer
  /// units, takes the remainders of the first.
  Int128 sum_of(const double (&column)[selections_at_once], std::uint32_t count) const {
    constexpr double whole = 6755399441055744.0;  // 1.5 * 2^52; adding it rounds to an integer
    const double coarse = renewal.unit / finer;
    std::uint64_t sum = 0, remaining = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      const double x = column[k] * coarse;
      BRISTLE_ASSERT(x > -0x1p51 && x < 0x1p51);
      const double rounded = x + whole;
      const double left_over = (x - (rounded - whole)) * finer + whole;
      sum += bits_of(rounded) - bits_of(whole);
      remaining += bits_of(left_over) - bits_of(whole);
    }
    return (static_cast<Int128>(static_cast<std::int64_t>(sum)) * static_cast<std::int64_t>(finer)) +
           static_cast<std::int64_t>(remaining);
  }

  void clear_marks() {
    if constexpr (by_columns) std::memset(marked, 0, contact < marks ? contact : marks);
    mark = 0;
  }

  /// Loads the bristles of the selections. Sets `alone` for selections that must be handled one by one:
  /// bristles that may be selected twice, bristles of unwritten blocks, and the bristle in contact only in
  /// part.
  void read(const Selections& selections, std::uint32_t count, Columns& columns) {
    if (mark == 255) clear_marks();
    const std::uint8_t now = ++mark;
    // Copies the pointers first. The compiler must assume that the bytes written below may change any member.
    const T* const z[2] = {patch.zx, patch.zy};
    const T* const limit = patch.delta;
    const Block* const blocks = patch.blocks;
    const std::int64_t from[2] = {renewal.from[0], renewal.from[1]};
    const std::uint32_t part_counted = patch.whole;
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t i = selections.bristle[k];
      const Block& block = blocks[i / block_size];
      std::uint8_t& last = marked[i % marks];
      columns.alone[k] = (last == now) | (i == part_counted) | (block.zero != 0);
      last = now;
      for (int axis = 0; axis < axes; ++axis) {
        columns.shift[axis][k] = displacement(from[axis], block.position[axis]);
        columns.stored[axis][k] = z[axis][i];
      }
      columns.limit[k] = limit[i];
    }
    for (std::uint32_t k = count; k < selections_at_once; ++k) {
      for (int axis = 0; axis < axes; ++axis) columns.shift[axis][k] = columns.stored[axis][k] = 0;
      columns.limit[k] = 0;
    }
  }

  /// Computes the renewal of all selected bristles, a vector at a time, as if none snapped before its renewal
  /// point. sort() then leaves those that do snap to slip(), one by one.
  void bend_all(const Selections& selections, Columns& columns, Gains& gains) const {
    const double e[2] = {renewal.direction[0], renewal.direction[1]};
    const double residual = left;
    for (std::uint32_t k = 0; k < selections_at_once; ++k) {
      const double path = selections.path[k];
      double z[axes], bent[axes];
      double along = 0.0, bent2 = 0.0;
      for (int axis = 0; axis < axes; ++axis) {
        z[axis] = static_cast<double>(columns.stored[axis][k]) + columns.shift[axis][k];
        along += z[axis] * e[axis];
        bent[axis] = z[axis] + path * e[axis];
        bent2 += bent[axis] * bent[axis];
      }
      const double limit = static_cast<double>(columns.limit[k]);
      double chord2 = limit * limit;
      if constexpr (axes == 2) {
        const double aside = z[0] * e[1] - z[1] * e[0];
        chord2 -= aside * aside;
      }
      const double end = along + path;
      const bool snaps = (end > 0.0) & (chord2 <= end * end);
      const bool slips = end > residual;
      columns.snaps[k] = snaps ? 1u : 0u;
      columns.slips[k] = slips ? 1u : 0u;
      const double written = (2.0 * residual - path) * path;
      for (int axis = 0; axis < axes; ++axis) {
        const double gain = (z[axis] + bent[axis]) * path - e[axis] * written;
        gains.twice_integral[axis][k] = slips ? gain : 0.0;
        const T now = static_cast<T>((residual - path) * e[axis] - columns.shift[axis][k]);
        columns.now[axis][k] = now;
        columns.change[axis][k] =
            (static_cast<double>(now) - static_cast<double>(columns.stored[axis][k])) * fixed_per_length;
      }
      gains.squares[k] = slips ? bent2 - residual * residual : 0.0;
    }
  }

  /// Sorts the selections into two lists: `slipping` for those that
  /// slip without a snap, which write() handles together, and `remaining` for those that slip() handles one
  /// by one. A bristle may be selected twice; `slipping` can then have only the first selection, so it is
  /// processed before `remaining`. Has no branch, because the outcome is unpredictable.
  void sort(std::uint32_t count, const Columns& columns, List& slipping, List& remaining) const {
    for (std::uint32_t k = 0; k < count; ++k) {
      const bool alone = (columns.alone[k] != 0) | (columns.snaps[k] != 0);
      slipping.k[slipping.size] = k;
      remaining.k[remaining.size] = k;
      const bool ahead = (columns.slips[k] != 0) & !alone;
      remaining.size += alone ? 1u : 0u;
      slipping.size += ahead ? 1u : 0u;
    }
  }

  void write(const Selections& selections, const Columns& columns, const List& list) const {
    T* const z[2] = {patch.zx, patch.zy};
    T* const limit = patch.delta;
    std::uint32_t* const state = patch.random;
    Block* const blocks = patch.blocks;
    const T residual = static_cast<T>(left);
    const std::uint32_t full_blocks = patch.whole / block_size;
    Int128 sum[2] = {0, 0};
    std::uint32_t full = 0;
    for (std::uint32_t n = 0; n < list.size; ++n) {
      const std::uint32_t k = list.k[n];
      const std::uint32_t i = selections.bristle[k];
      const std::uint32_t b = i / block_size;
      Block& block = blocks[b];
      const std::int64_t counts = b < full_blocks ? -1 : 0;
      for (int axis = 0; axis < axes; ++axis) {
        const std::int64_t more = to_integer(columns.change[axis][k]);
        z[axis][i] = columns.now[axis][k];
        block.stored[axis] += more;
        sum[axis] += more & counts;
      }
      if constexpr (redraw) {
        state[i] = columns.state[k];
        limit[i] = residual + columns.length[k];
      }
      full += static_cast<std::uint32_t>(-counts);
      block.reach = 0.0f;
      patch.groups[b / blocks_per_group].reach = 0.0;
    }
    for (int axis = 0; axis < axes; ++axis) totals.stored[axis] += sum[axis];
    totals.tail_changed |= full < list.size ? 1u : 0u;
    totals.renewed += list.size;
  }

  /// Renews the bristle of one selection, which slips to the residual. Its snap length has been sampled
  /// ahead, unless the bristle is selected twice.
  void slip(const Selections& selections, std::uint32_t k, const Columns& columns, Gains& gains) {
    const std::uint32_t i = selections.bristle[k];
    const double path = selections.path[k];
    for (int axis = 0; axis < axes; ++axis) gains.twice_integral[axis][k] = 0.0;
    gains.squares[k] = 0.0;
    Block& block = patch.blocks[i / block_size];
    Start start = find_start(i);
    const double end = start.along + path;
    const bool snaps = ages ? snaps_within(i, path, start) : end > 0.0 && start.chord2 <= end * end;
    if (!snaps && !(end > left)) return;  // the bristle is not bent enough, so the selection has no effect
    write_zero_block<T, axes, redraw, ages>(patch, i / block_size);
    if constexpr (ages) age_block(i / block_size);
    T fresh{};
    const auto sample_length = [&] {
      const std::uint32_t next = patch.random[i] += random_stride;
      fresh = next == columns.state[k] ? columns.length[k] : length_at<T>(*patch.law, share_of<T>(mix(next)));
    };
    Passed passed;
    if (snaps)
      snap(start, path, sample_length, fresh, passed);
    else
      bend(start, path, passed);
    if constexpr (redraw) {
      sample_length();
      patch.delta[i] = static_cast<T>(left) + fresh;
    }
    if constexpr (ages) patch.age[i] = static_cast<T>(-(ageing.per_length * path));
    book(block, i, start, path, passed, k, gains);
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
  void snap(const Start& start, double path, const Sample& sample_length, const T& fresh, Passed& passed) {
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
      sample_length();
      for (double length = path_of(static_cast<double>(fresh)); length <= r;) {
        r -= length;
        further += length * length;
        ++totals.snaps;
        sample_length();
        length = path_of(static_cast<double>(fresh));
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
  void book(Block& block, std::uint32_t i, const Start& start, double path, const Passed& passed,
            std::uint32_t k, Gains& gains) {
    const auto weight = static_cast<double>(weight_of(patch, i));
    const bool tail = patch.whole < (i / block_size + 1) * block_size;
    T* const columns[2] = {patch.zx, patch.zy};
    // Computes twice the integral of the deflection that the step kernels will wrongly count along `path`, in
    // order to subtract it.
    const double written = (2.0 * left - path) * path;
    for (int axis = 0; axis < axes; ++axis) {
      const double e = renewal.direction[axis];
      gains.twice_integral[axis][k] = weight * (passed.twice_integral[axis] - e * written);
      T& stored = columns[axis][i];
      const T now = static_cast<T>((left - path) * e - start.shift[axis]);
      const std::int64_t more =
          to_integer(weight * (static_cast<double>(now) - static_cast<double>(stored)) * fixed_per_length);
      stored = now;
      block.stored[axis] += more;
      if (!tail) totals.stored[axis] += more;
    }
    gains.squares[k] = weight * ((passed.bent2 - left * left) + passed.squares);
    totals.tail_changed |= tail ? 1u : 0u;
    ++totals.renewed;
    block.reach = 0.0f;
    patch.groups[i / block_size / blocks_per_group].reach = 0.0;
  }
};

template <class T, int axes, bool redraw, bool ages, class Lengths>
void renew_bristles(const PatchView<T>& patch, const Renewal& renewal, std::uint32_t first,
                    std::uint32_t last, RenewalTotals& totals) {
  Renewer<T, axes, redraw, ages, Lengths>(patch, renewal, first, last, totals).run();
}

}  // namespace
}  // namespace bristle::detail
