// One step over the blocks of a patch: decides which blocks are visited, and what is summed.
//
// Most blocks need no work. A block whose bound says that nothing snaps is not visited at all (core/MODEL.md,
// section 10). In any other block a first pass asks whether a bristle snaps. If none does, nothing is
// written, because deflections are stored relative to the displacement since the block's last rewrite, which
// grows by itself. If one does, a second pass rewrites all deflections of the block (snap.hpp).
#pragma once

#include <limits>

#include <type_traits>

#include "blocks.hpp"
#include "far.hpp"
#include "invariants.hpp"
#include "lanes.hpp"
#include "snap_aged.hpp"

namespace bristle::detail {
namespace {

template <class T, int axes, bool redraw, bool mean, bool energy, bool residual, bool ages = false>
class Stepper {
 public:
  Stepper(const PatchView<T>& the_patch, const KernelStep& the_step, Totals& the_totals)
      : patch(the_patch), step(the_step), totals(the_totals), rounds(foreseen_rounds()) {}

  /// Counts the bristles of blocks [first, last) that are beyond their snap length at the end of the step,
  /// without changing any. Shared renewal needs the count before the step.
  std::uint64_t foresee(std::uint32_t first, std::uint32_t last) const {
    std::uint64_t count = 0;
    for (std::uint32_t b = first; b < last; ++b) {
      const Reach& group = patch.groups[b / blocks_per_group];
      if (step.skips_blocks && within(group.anchor, group.reach)) {
        b = b / blocks_per_group * blocks_per_group + blocks_per_group - 1;
        continue;
      }
      Block& block = patch.blocks[b];
      if (step.skips_blocks && within(block.anchor, static_cast<double>(block.reach))) continue;
      const Extent extent = find_extent(b);
      write_zero_block<T, axes, redraw, ages>(patch, b);
      count += count_beyond(b, extent);
    }
    return count;
  }

  /// Steps blocks [first, last). `first` must begin a group of blocks with a common bound.
  void run(std::uint32_t first, std::uint32_t last) {
    assert_step(patch, step, first, last, axes, redraw);
    for (std::uint32_t b = first; b < last; b += blocks_per_group) {
      Reach& group = patch.groups[b / blocks_per_group];
      if (step.skips_blocks && within(group.anchor, group.reach)) continue;
      const std::uint32_t end = b + blocks_per_group < last ? b + blocks_per_group : last;
      const double reach = step.skips_blocks ? run_group(b, end) : run_all(b, end);
      if (!step.stores) continue;
      group.reach = reach;
      group.anchor[0] = step.to[0];
      group.anchor[1] = step.to[1];
    }
  }

 private:
  // Compiles a single kernel for ageing bristles. It computes all outputs, and serves patches that want only
  // some of them.
  static_assert(!ages || (mean && energy && residual));
  using Motion = std::conditional_t<ages, AgedMotion<T, axes>, BlockMotion<T, axes, residual>>;
  static constexpr std::uint32_t width = width_of<T>;
  static constexpr std::uint32_t parts = Row<T>::parts;

  /// Share of bristles that snap in a step below which vectors without a snap are skipped, under uniform laws
  /// and SnapRule::redraw. Above it, testing each vector costs more than it saves.
  static constexpr double few_snap = 0.008;
  static constexpr double most_rounds = 4.0;
  // Step lengths, in mean snap lengths, that select the method for normal and lognormal laws, up to where
  // jumps begin. Vectors without a snap are skipped below few_looked_up, and at any length if vectors are
  // narrower than a row (16 lanes).
  static constexpr bool looks_up_in_registers = width == lane_count;
  static constexpr double few_looked_up = 0.04;
  /// Step length, in mean snap lengths, from which on two random lengths are sampled before either is known
  /// to be needed; below it one.
  static constexpr double two_looked_up = 1.0;

  template <bool is>
  struct Flag {
    static constexpr bool value = is;
  };

  const PatchView<T>& patch;
  const KernelStep& step;
  Totals& totals;
  /// Number of random lengths that most vectors need in the step under SnapRule::redraw, if it is small. 0 if
  /// it is larger, and for vectors of one number.
  const std::uint32_t rounds;

  /// Part of a block that is in contact: whole rows of 16 bristles, then a row whose bristles have different
  /// weights.
  struct Extent {
    std::uint32_t start, active, full_rows;
    bool partial;
    alignas(64) T weights[lane_count];
  };

  /// Sums over the bristles of a block whose deflections the step has rewritten.
  struct BlockSums {
    double stored[2] = {0.0, 0.0};
    double twice_mean[2] = {0.0, 0.0};
    double squares = 0.0;
  };

  /// Steps every block of a group, even those whose bound says that nothing snaps.
  double run_all(std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t b = first; b < last; ++b) visit(b);
    return 0.0;
  }

  /// Steps the blocks of a group, except those whose bound says that nothing snaps. Returns how far the patch
  /// may move from its end position before one of these bounds fails; not above 0 if a bound is unknown.
  double run_group(std::uint32_t first, std::uint32_t last) {
    double reach = std::numeric_limits<double>::max();
    for (std::uint32_t b = first; b < last; ++b) {
      const Block& block = patch.blocks[b];
      if (!within(block.anchor, static_cast<double>(block.reach))) visit(b);
      const double left = static_cast<double>(block.reach) - distance(block.anchor);
      reach = left < reach ? left : reach;
    }
    return reach;
  }

  double distance(const std::int64_t (&anchor)[2]) const {
    const double x = displacement(step.to[0], anchor[0]);
    if constexpr (axes == 1) return x < 0.0 ? -x : x;
    const double y = displacement(step.to[1], anchor[1]);
    return root(x * x + y * y);
  }

  /// Returns whether the patch ends the step within `reach` of `anchor`. Then nothing snaps on the path
  /// either: the deflections within a snap length form a disc, which is convex.
  bool within(const std::int64_t (&anchor)[2], double reach) const { return distance(anchor) < reach; }

  void visit(std::uint32_t b) {
    Block& block = patch.blocks[b];
    const Extent extent = find_extent(b);
    totals.visited += extent.active;
    ++totals.blocks_visited;
    write_zero_block<T, axes, redraw, ages>(patch, b);

    const double q0[2] = {displacement(step.from[0], block.position[0]),
                          displacement(step.from[1], block.position[1])};
    const double q1[2] = {displacement(step.to[0], block.position[0]),
                          displacement(step.to[1], block.position[1])};
    BRISTLE_ASSERT(is_near(q0[0]) && is_near(q0[1]) && is_near(q1[0]) && is_near(q1[1]));
    const T p1x = static_cast<T>(q1[0]);
    const T p1y = static_cast<T>(q1[1]);
    const BlockMotion<T, axes, residual> bends{
        patch.zx,
        patch.zy,
        patch.delta,
        patch.random,
        Lanes<T>(static_cast<T>(step.direction[0])),
        Lanes<T>(static_cast<T>(step.direction[1])),
        Lanes<T>(static_cast<T>(step.length)),
        Lanes<T>(static_cast<T>(q0[0])),
        Lanes<T>(static_cast<T>(q0[1])),
        Lanes<T>(p1x),
        Lanes<T>(p1y),
        Residual<T, residual>(Lanes<T>(static_cast<T>(step.residual)))};
    const Motion& motion = [&]() -> decltype(auto) {
      if constexpr (ages)
        return with_age(bends, b);
      else
        return (bends);
    }();
    if (!step.snaps_all) {
      T margin = std::numeric_limits<T>::max();
      const bool any = step.finds_bounds ? any_snap<true>(motion, extent, margin)
                                         : any_snap<false>(motion, extent, margin);
      if (!any) {
        if (step.finds_bounds && step.stores) keep_bound(block, margin, p1x, p1y);
        return;
      }
    }
    const BlockSums sums = step.in_double ? rewrite_far(extent, q0, q1) : rewrite_near(motion, extent);
    record(block, b, sums);
    if (step.stores) block.reach = 0.0f;
    if constexpr (ages)
      if (step.stores) patch.since[b] = step.start + step.duration;
  }

  Motion with_age(const BlockMotion<T, axes, residual>& motion, std::uint32_t b) const {
    const BlockAge age = age_since(step, patch.since[b]);
    return {motion,
            patch.age,
            Lanes<T>(static_cast<T>(age.before)),
            Lanes<T>(static_cast<T>(age.after)),
            Lanes<T>(static_cast<T>(least_later_age(step, patch.since[b]))),
            ageing_of<T>(step)};
  }

  std::uint64_t count_beyond(std::uint32_t b, const Extent& extent) const {
    const Block& block = patch.blocks[b];
    const Lanes<T> none(T(0));
    BlockMotion<T, axes, residual> motion{
        patch.zx, patch.zy, patch.delta, patch.random,
        none,     none,     none,        none,
        none,     none,     none,        Residual<T, residual>(Lanes<T>(static_cast<T>(step.residual)))};
    motion.p1x = Lanes<T>(static_cast<T>(displacement(step.to[0], block.position[0])));
    motion.p1y = Lanes<T>(static_cast<T>(displacement(step.to[1], block.position[1])));
    if constexpr (ages)
      return count_beyond(with_age(motion, b), extent);
    else
      return count_beyond(motion, extent);
  }

  static std::uint64_t count_beyond(const Motion& motion, const Extent& extent) {
    const Lanes<T> none(T(0));
    const Lanes<T> one(T(1));
    Lanes<T> sum = none;
    const std::uint32_t end = extent.start + extent.full_rows * lane_count;
    for (std::uint32_t i = extent.start; i < end; i += width)
      sum = sum + select_lanes(motion.beyond_at(i), one, none);
    if (extent.partial)
      for (std::uint32_t k = 0; k < lane_count; k += width)
        sum = sum + select_lanes(motion.beyond_at(end + k) & (load(extent.weights + k) > none), one, none);
    return to_count(fold_lanes<T>(sum));
  }

  Extent find_extent(std::uint32_t b) const {
    const std::uint32_t start = b * block_size;
    const std::uint32_t contact = in_contact(patch);
    const std::uint32_t whole = patch.whole - start < block_size ? patch.whole - start : block_size;
    Extent extent;
    extent.start = start;
    extent.active = contact - start < block_size ? contact - start : block_size;
    extent.full_rows = whole / lane_count;
    extent.partial = extent.active > extent.full_rows * lane_count;
    if (extent.partial) {
      const std::uint32_t first = start + extent.full_rows * lane_count;
      for (std::uint32_t k = 0; k < lane_count; ++k) extent.weights[k] = weight_of(patch, first + k);
    }
    return extent;
  }

  /// Returns whether any bristle of the block snaps. If none does and bounds are kept, sets `margin` to the
  /// shortest distance from a deflection to its snap length.
  template <bool keep_margin>
  static bool any_snap(const Motion& motion, const Extent& extent, T& margin) {
    const std::uint32_t end = extent.start + extent.full_rows * lane_count;
    Lanes<T> shortest(margin);
    for (std::uint32_t i = extent.start; i < end; i += lane_count) {
      Mask<T> any = motion.beyond_at(i);
      for (std::uint32_t k = width; k < lane_count; k += width) any = any | motion.beyond_at(i + k);
      if (any_lane(any)) return true;
      if constexpr (keep_margin)
        for (std::uint32_t k = 0; k < lane_count; k += width)
          shortest = least(shortest, motion.margin_at(i + k));
    }
    if (extent.partial) {
      for (std::uint32_t k = 0; k < lane_count; k += width) {
        const Mask<T> active = load(extent.weights + k) > Lanes<T>(T(0));
        if (any_lane(motion.beyond_at(end + k) & active)) return true;
        if constexpr (keep_margin)
          shortest = least(shortest, select_lanes(active, motion.margin_at(end + k), shortest));
      }
    }
    if constexpr (keep_margin) {
      alignas(64) T lane[width];
      put_lanes(lane, shortest);
      for (T x : lane) margin = least(margin, x);
    }
    return false;
  }

  /// Stores the bound of a block: how far the patch may move from its end position before a bristle of the
  /// block snaps.
  void keep_bound(Block& block, T margin, T p1x, T p1y) const {
    constexpr double ulp = std::numeric_limits<T>::epsilon();
    const auto path = static_cast<double>(margin);
    // Reduces the bound by rounding errors: of the displacement since the last rewrite, here and at the
    // patch's later position, and (by the factor) of `reach`, a float.
    const double shift = static_cast<double>((p1x < 0 ? -p1x : p1x) + (p1y < 0 ? -p1y : p1y));
    const double reach = path * (1.0 - 2e-7) - 2.0 * ulp * (shift + 2.0 * path);
    block.reach = reach > 0.0 ? static_cast<float>(reach) : 0.0f;
    block.anchor[0] = step.to[0];
    block.anchor[1] = step.to[1];
  }

  /// Columns of one block into which a trial step writes, so that the patch's state stays as it is.
  struct Scratch {
    alignas(64) T zx[block_size];
    alignas(64) T zy[axes == 2 ? block_size : 1];
    alignas(64) T delta[redraw ? block_size : 1];
    alignas(64) std::uint32_t random[redraw ? block_size : 1];
  };

  /// Returns the columns that a step of a block writes: its own or, in a trial, those of `scratch`.
  [[gnu::always_inline]] BlockOutput<T> output_to(Scratch& scratch, const Extent& extent) const {
    if (!step.stores) return {scratch.zx, scratch.zy, scratch.delta, scratch.random};
    BlockOutput<T> output{patch.zx + extent.start, scratch.zy, patch.delta + extent.start, scratch.random};
    if constexpr (axes == 2) output.zy = patch.zy + extent.start;
    if constexpr (redraw) output.random = patch.random + extent.start;
    return output;
  }

  /// Calls `step_row(partial, i, weights)` for the vector of bristles that begins at lane k, in every row.
  template <class F>
  [[gnu::always_inline]] static void for_rows(const Extent& extent, std::uint32_t k, F&& step_row) {
    const std::uint32_t at = extent.start + k;
    for (std::uint32_t row = 0; row < extent.full_rows; ++row)
      step_row(Flag<false>{}, at + row * lane_count, nullptr);
    if (extent.partial) step_row(Flag<true>{}, at + extent.full_rows * lane_count, extent.weights + k);
  }

  BlockSums rewrite_near(const Motion& motion, const Extent& extent) {
    if constexpr (ages)
      return rewrite_aged(motion, extent);
    else
      return rewrite(motion, extent);
  }

  BlockSums rewrite(const BlockMotion<T, axes, residual>& block_motion, const Extent& extent) {
    const BlockMotion<T, axes, residual> motion =
        block_motion;  // a local whose address nobody takes, so that it stays in registers
    Scratch scratch;
    const BlockOutput<T> output = output_to(scratch, extent);
    RowSums<T> sums[parts];
    double noise = 0.0;
    if constexpr (!redraw) {
      double shortest = static_cast<double>(patch.blocks[extent.start / block_size].shortest);
      if constexpr (residual) shortest -= step.residual;
      if (step.length >= shortest)
        rewrite_keep<true>(motion, output, extent, sums);
      else
        rewrite_keep<false>(motion, output, extent, sums);
    } else if constexpr (width == 1) {
      noise = rewrite_by_rounds(motion, output, extent, sums);
    } else if (rounds > 0) {
      for (std::uint32_t part = 0; part < parts; ++part) {
        if constexpr (looks_up_in_registers) {
          if (patch.law->kind != law_uniform) {
            walk_side_by_side<4, CellLengths<T>>(motion, output, extent, part * width, sums[part]);
            continue;
          }
        }
        if (rounds > 2)
          walk_side_by_side<8, UniformLengths<T>>(motion, output, extent, part * width, sums[part]);
        else
          walk_side_by_side<4, UniformLengths<T>>(motion, output, extent, part * width, sums[part]);
      }
    } else {
      noise = rewrite_by_rounds(motion, output, extent, sums);
    }
    return total(motion, sums, noise);
  }

  /// Moves the rows of a block through the step under SnapRule::keep. `again`: a bristle may snap more than
  /// once.
  template <bool again>
  static void rewrite_keep(const BlockMotion<T, axes, residual>& motion, const BlockOutput<T>& output,
                           const Extent& extent, RowSums<T> (&sums)[parts]) {
    // Splits the work into two passes if vectors are narrow. The operations on one vector form a long chain,
    // and the registers have room for only three chains at a time, too few to keep the processor busy; the
    // first pass therefore runs over all rows before the second begins.
    constexpr bool two_passes = width < lane_count;
    alignas(64) T path[two_passes ? block_size : 1];
    for (std::uint32_t part = 0; part < parts; ++part) {
      PassSums<T> first;  // local sums, which stay in registers
      RowSums<T> sum;
      const auto end = [&](auto partial, std::uint32_t i, Lanes<T> to_snap, const T* weights) {
        end_keep<T, axes, mean, energy, residual, partial.value, again>(motion, output, i, to_snap, weights,
                                                                        sum);
      };
      for_rows(extent, part * width, [&](auto partial, std::uint32_t i, const T* weights) {
        const Lanes<T> to_snap =
            begin_pass<T, axes, mean, energy, residual, partial.value>(motion, i, weights, first).path;
        if constexpr (two_passes)
          put_lanes(path + i % block_size, to_snap);
        else
          end(partial, i, to_snap, weights);
      });
      if constexpr (two_passes)
        for_rows(extent, part * width, [&](auto partial, std::uint32_t i, const T* weights) {
          end(partial, i, load(path + i % block_size), weights);
        });
      sum.PassSums<T>::operator=(first);
      sums[part] = sum;
    }
  }

  BlockSums rewrite_aged(const Motion& block_motion, const Extent& extent) {
    const Motion motion = block_motion;
    Scratch scratch;
    const BlockOutput<T> output = output_to(scratch, extent);
    alignas(64) T scratch_age[block_size];
    T* const age = step.stores ? patch.age + extent.start : scratch_age;
    RowSums<T> sums[parts];
    VectorList<T> snapping;
    const auto begin = [&](T* path) {
      for (std::uint32_t part = 0; part < parts; ++part)
        for_rows(extent, part * width, [&](auto partial, std::uint32_t i, const T* weights) {
          snapping.add_if(begin_aged<T, axes, partial.value>(motion, i, weights, path), i % block_size);
        });
    };
    if constexpr (!redraw) {
      const double shortest =
          static_cast<double>(patch.blocks[extent.start / block_size].shortest) - step.residual;
      const bool again = step.length >= shortest;
      AgedPaths<T> paths;
      begin(paths.path);
      for (T& interval : paths.interval)
        interval = T(1);  // any valid path will do for vectors in which no bristle snaps
      find_snaps<T, axes, true>(motion, extent.start, snapping, again, paths.path, paths.interval);
      for (std::uint32_t part = 0; part < parts; ++part) {
        RowSums<T> sum;
        for_rows(extent, part * width, [&](auto partial, std::uint32_t i, const T* weights) {
          end_keep_aged<T, axes, partial.value>(motion, output, age, i, weights, again, paths, sum);
        });
        sums[part] = sum;
      }
      return total(motion, sums, 0.0);
    } else {
      const bool jumps = step.length > patch.law->jump_from;
      const std::uint32_t key = jumps ? noise_key(patch.random + extent.start) : 0u;
      AgedWalk<T> walk;
      walk.ageing = motion.ageing;
      walk.largest_growth = static_cast<T>(step.largest_growth);
      begin(walk.path);
      find_snaps<T, axes, false>(motion, extent.start, snapping, false, walk.path, nullptr);
      const RedrawColumns<T> columns{patch.delta + extent.start, patch.random + extent.start, output.delta,
                                     output.random};
      walk_rounds<T, true, true>(*patch.law, static_cast<T>(step.length), static_cast<T>(step.residual),
                                 columns, snapping, walk);
      for (std::uint32_t part = 0; part < parts; ++part) {
        RowSums<T> sum;
        for_rows(extent, part * width, [&](auto partial, std::uint32_t i, const T* weights) {
          end_redraw_aged<T, axes, partial.value>(motion, output, age, i, weights, walk, sum);
        });
        sums[part] = sum;
      }
      return total(motion, sums, jumps ? open_noise(extent, walk, motion.length, key) : 0.0);
    }
  }

  /// Samples the random part of a block's sum of delta^2. Only the mean is known of snaps that were jumped
  /// over.
  static double open_noise(const Extent& extent, const Walk<T>& walk, Lanes<T> length, std::uint32_t key) {
    Row<T> squares, variance;
    for (std::uint32_t part = 0; part < parts; ++part)
      for_rows(extent, part * width, [&](auto partial, std::uint32_t i, const T* weights) {
        add_jumped<T, partial.value>(i, weights, walk, length, squares.part[part], variance.part[part]);
      });
    return jump_noise(tree_sum(squares), tree_sum(variance), key);
  }

  template <std::uint32_t together, class Lengths>
  void walk_side_by_side(const BlockMotion<T, axes, residual>& block_motion, const BlockOutput<T>& output,
                         const Extent& extent, std::uint32_t k, RowSums<T>& sums) {
    const BlockMotion<T, axes, residual> motion = block_motion;
    const Lengths lengths(*patch.law);
    RowSums<T> sum;
    const std::uint32_t at = extent.start + k;
    std::uint32_t row = 0;
    for (; row + together <= extent.full_rows; row += together)
      step_in_registers<T, axes, mean, energy, residual, false, together>(
          motion, output, at + row * lane_count, nullptr, lengths, rounds, sum);
    for (; row < extent.full_rows; ++row)
      step_in_registers<T, axes, mean, energy, residual, false, 1>(motion, output, at + row * lane_count,
                                                                   nullptr, lengths, rounds, sum);
    if (extent.partial)
      step_in_registers<T, axes, mean, energy, residual, true, 1>(motion, output, at + row * lane_count,
                                                                  extent.weights + k, lengths, rounds, sum);
    sums = sum;
  }

  std::uint32_t foreseen_rounds() const {
    if constexpr (!redraw || width == 1) return 0;
    const KernelLaw& law = *patch.law;
    if (!(step.length < law.jump_from)) return 0;
    if (looks_up_in_registers && (law.kind == law_normal || law.kind == law_lognormal)) {
      const double lengths = step.length * law.inverse_mean;
      return lengths < few_looked_up ? 0 : lengths < two_looked_up ? 1 : 2;
    }
    if (law.kind != law_uniform) return 0;
    if (step.length < few_snap * law.mean) return 0;
    const double lengths_needed = step.length / law.location;
    return lengths_needed <= most_rounds ? static_cast<std::uint32_t>(__builtin_ceil(0.99 * lengths_needed))
                                         : 0;
  }

  /// Moves the rows of a block through the step by rounds. Returns the random part of its sum of delta^2
  /// (open_noise()).
  double rewrite_by_rounds(const BlockMotion<T, axes, residual>& motion, const BlockOutput<T>& output,
                           const Extent& extent, RowSums<T> (&sums)[parts]) {
    const bool jumps = (mean || energy) && step.length > patch.law->jump_from;
    const std::uint32_t key = jumps ? noise_key(patch.random + extent.start) : 0u;
    Walk<T> walk;
    VectorList<T> snapping;
    for (std::uint32_t part = 0; part < parts; ++part) {
      RowSums<T> sum;
      for_rows(extent, part * width, [&](auto partial, std::uint32_t i, const T* weights) {
        snapping.add_if(
            begin_redraw<T, axes, mean, energy, residual, partial.value>(motion, i, weights, walk, sum),
            i % block_size);
      });
      sums[part] = sum;
    }
    const RedrawColumns<T> columns{patch.delta + extent.start, patch.random + extent.start, output.delta,
                                   output.random};
    walk_rounds<T, mean || energy, residual>(*patch.law, static_cast<T>(step.length),
                                             static_cast<T>(step.residual), columns, snapping, walk);
    for (std::uint32_t part = 0; part < parts; ++part) {
      RowSums<T> sum;
      sum = sums[part];
      for_rows(extent, part * width, [&](auto partial, std::uint32_t i, const T* weights) {
        end_redraw<T, axes, mean, energy, residual, partial.value>(motion, output, i, weights, walk, sum);
      });
      sums[part] = sum;
    }
    return jumps ? open_noise(extent, walk, motion.length, key) : 0.0;
  }

  static double tree_total(const RowSums<T> (&sums)[parts], Lanes<T> RowSums<T>::*which) {
    Row<T> row;
    for (std::uint32_t part = 0; part < parts; ++part) row.part[part] = sums[part].*which;
    return tree_sum(row);
  }

  BlockSums total(const BlockMotion<T, axes, residual>& motion, const RowSums<T> (&sums)[parts],
                  double noise) {
    BlockSums block;
    const Lanes<T> direction[2] = {motion.ex, motion.ey};
    for (int axis = 0; axis < axes; ++axis) {
      Row<T> stored;
      for (std::uint32_t part = 0; part < parts; ++part) stored.part[part] = sums[part].stored[axis];
      block.stored[axis] = tree_sum(stored);
      if constexpr (mean) {
        // Twice the integral of the bristles' deflections along the path of the step, from which the mean
        // force follows.
        Row<T> integral;
        for (std::uint32_t part = 0; part < parts; ++part)
          integral.part[part] = Lanes<T>(T(2)) * sums[part].passed[axis] + direction[axis] * sums[part].along;
        block.twice_mean[axis] = (tree_sum(integral) + step.direction[axis] * noise) / step.length;
      }
    }
    if constexpr (energy) {
      block.squares = tree_total(sums, &RowSums<T>::squares) + tree_total(sums, &RowSums<T>::further) + noise;
      totals.snaps += to_count(tree_total(sums, &RowSums<T>::snaps));
    }
    return block;
  }

  BlockSums rewrite_far(const Extent& extent, const double (&q0)[2], const double (&q1)[2]) {
    const FarSums far =
        far_block<T, axes, redraw, residual, ages>(patch, step, extent.start, extent.active, q0, q1);
    BlockSums block;
    for (int axis = 0; axis < axes; ++axis) {
      block.stored[axis] = far.stored[axis];
      block.twice_mean[axis] = far.twice_mean[axis];
    }
    block.squares = far.squares;
    if constexpr (energy) totals.snaps += to_count(far.snaps);
    return block;
  }

  /// Adds the sums of a rewritten block to the totals of the patch.
  void record(Block& block, std::uint32_t b, const BlockSums& sums) {
    const bool tail = patch.whole < (b + 1) * block_size;
    ++totals.blocks_rewritten;
    for (int axis = 0; axis < axes; ++axis) {
      const std::int64_t now = to_integer(sums.stored[axis] * fixed_per_length);
      const std::int64_t mean_now = mean ? to_integer(sums.twice_mean[axis] * fixed_per_length) : 0;
      if (tail) {
        totals.tail_stored[axis] = now;
        totals.tail_twice_mean[axis] = mean_now;
      } else {
        const Int128 gone = difference(step.to[axis], block.position[axis]);
        totals.stored[axis] += static_cast<Int128>(now) - block.stored[axis];
        totals.offset[axis] -= gone;
        if constexpr (mean) {
          const Int128 before = difference(step.from[axis], block.position[axis]);
          totals.twice_mean[axis] += static_cast<Int128>(mean_now) -
                                     2 * static_cast<Int128>(block.stored[axis]) -
                                     Int128{block_size} * (before + gone);
        }
      }
      if (step.stores) {
        block.stored[axis] = now;
        block.position[axis] = step.to[axis];
      }
    }
    if (tail) totals.tail_snapped = 1;
    if constexpr (energy) totals.squares += to_integer(sums.squares * step.energy_unit);
  }
};

template <class T, int axes, bool redraw, bool ages>
std::uint64_t foresee_blocks(const PatchView<T>& patch, const KernelStep& step, std::uint32_t first,
                             std::uint32_t last) {
  Totals unused{};
  return Stepper<T, axes, redraw, ages, true, ages, ages>(patch, step, unused).foresee(first, last);
}

template <class T, int axes, bool redraw, bool mean, bool energy, bool residual, bool ages>
void step_blocks(const PatchView<T>& patch, const KernelStep& step, std::uint32_t first, std::uint32_t last,
                 Totals& totals) {
  Stepper<T, axes, redraw, mean, energy, residual, ages>(patch, step, totals).run(first, last);
}

}  // namespace
}  // namespace bristle::detail
