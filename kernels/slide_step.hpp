// One step over the blocks of a patch whose bristles slide (slide.hpp): visits and sums.
//
// A block in which no bristle slides is not written: its deflections follow the patch. In other blocks only
// the bristles that slide are written, so that creep does not erode the stored deflections of the others. All
// deflections are counted from the patch's place again when that is far enough away.
#pragma once

#include <limits>

#include "ageing.hpp"
#include "slide.hpp"

namespace bristle::detail {
namespace {

/// Longest step, scaled, that is computed directly. After it every bristle lies along the motion, to the last
/// bit.
constexpr double longest_slide = 1048576.0;  // 2^20
/// Farther off, scaled, deflections are counted from the patch's place again.
constexpr double farthest_reference = 0.25;

/// Numbers of a step that all bristles of a block share.
struct SlideMotion {
  double length;        ///< computed; the rest of a longer step changes nothing
  double p0[2], p1[2];  ///< from the block's position, at the start and the end
  bool counts_anew;     ///< the columns will count from the end of the step

  SlideMotion(const Advance& a, const SlideBlock& block)
      : length(least(a.length, longest_slide)),
        p0{displacement(a.from[0], block.position[0]), displacement(a.from[1], block.position[1])},
        p1{displacement(a.to[0], block.position[0]), displacement(a.to[1], block.position[1])},
        counts_anew(p1[0] * p1[0] + p1[1] * p1[1] > farthest_reference * farthest_reference) {}
};

/// Weight times fixed-point displacement, rounded.
inline std::int64_t carried(const SlideBlock& block, const std::int64_t (&to)[2], int axis) {
  return to_integer(block.weight * static_cast<double>(difference(to[axis], block.position[axis])));
}

/// Sums over a block in which a bristle slid.
struct SlideSums {
  double stored[2] = {0.0, 0.0};    ///< weight x deflection as it is stored after the step
  double integral[2] = {0.0, 0.0};  ///< of weight x deflection over the computed part of the step
  double dissipated = 0.0;          ///< there
};

/// Books a block in which no bristle slid.
inline void book_stuck(const SlideBlock& block, const Advance& a, int axes, bool mean, Totals& totals) {
  for (int axis = 0; axis < axes; ++axis) {
    const std::int64_t after = carried(block, a.to, axis);
    totals.stored[axis] += block.stored[axis] + after;
    if (mean) totals.twice_mean[axis] += 2 * block.stored[axis] + carried(block, a.from, axis) + after;
  }
}

/// A block that changed.
inline void book_slid(SlideBlock& block, const Advance& a, const SlideMotion& motion, const SlideSums& sums,
                      int axes, Totals& totals) {
  SlideBlock now = block;
  double along = 0.0;  // deflection at the end, of a step that goes on
  const double rest = a.length - motion.length;
  for (int axis = 0; axis < axes; ++axis) {
    if (motion.counts_anew) now.position[axis] = a.to[axis];
    now.stored[axis] = to_integer(sums.stored[axis] * fixed_per_length);
    totals.stored[axis] += now.stored[axis] + carried(now, a.to, axis);
    const double end =
        rest > 0.0 ? sums.stored[axis] + block.weight * (motion.counts_anew ? 0.0 : motion.p1[axis]) : 0.0;
    along += end * a.direction[axis];
    const double mean = (sums.integral[axis] + rest * end) / a.length;
    totals.twice_mean[axis] += to_integer(2.0 * mean * fixed_per_length);
  }
  totals.squares += to_integer((sums.dissipated + rest * along) / most(a.length, 1.0) * fixed_per_length);
  ++totals.blocks_rewritten;
  now.reach = -1.0;
  if (a.commit) block = now;
}

#if defined(BRISTLE_KERNEL_ISA)
template <class T, int axes, bool mean, bool energy, bool ages>
class Slider {
 public:
  Slider(const SlideView<T>& the_patch, const Advance& the_advance)
      : patch(the_patch), advance(the_advance) {}

  void run(std::uint32_t first, std::uint32_t last, Totals& totals) const {
    for (std::uint32_t b = first; b < last; ++b) {
      SlideBlock& block = patch.blocks[b];
      const Extent extent{b * block_size, least_index((b + 1) * block_size, patch.rows)};
      totals.visited += extent.end - extent.first;
      ++totals.blocks_visited;
      const SlideMotion motion(advance, block);
      const Shared shared(patch, advance, motion);
      T margin = std::numeric_limits<T>::max();
      if (any_slides(shared, extent, margin)) {
        book_slid(block, advance, motion, slide_all(shared, extent, totals), axes, totals);
      } else {
        book_stuck(block, advance, axes, mean, totals);
        if (advance.commit) block.reach = static_cast<double>(margin);
      }
    }
  }

 private:
  static constexpr std::uint32_t width = Lanes<T>::size;
  static constexpr T eps = std::numeric_limits<T>::epsilon();

  const SlideView<T>& patch;
  const Advance& advance;

  struct Extent {
    std::uint32_t first, end;
  };
  static std::uint32_t least_index(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }

  struct Shared {
    Lanes<T> ex, ey, length, p0x, p0y, p1x, p1y, share, kinetic, keep_x, keep_y, shift_x, shift_y;
    AgeingLaw<T> ageing;

    Shared(const SlideView<T>& patch, const Advance& a, const SlideMotion& m)
        : ex(static_cast<T>(a.direction[0])),
          ey(static_cast<T>(a.direction[1])),
          length(static_cast<T>(m.length)),
          p0x(static_cast<T>(m.p0[0])),
          p0y(static_cast<T>(m.p0[1])),
          p1x(static_cast<T>(m.p1[0])),
          p1y(static_cast<T>(m.p1[1])),
          share(patch.share),
          kinetic(patch.kinetic),
          ageing(ageing_of<T>(a)) {
      const Lanes<T> none(T(0));
      keep_x = m.counts_anew ? none : p1x;
      keep_y = m.counts_anew ? none : p1y;
      shift_x = m.counts_anew ? p1x : none;
      shift_y = m.counts_anew ? p1y : none;
    }
  };

  /// Bristles before they slide.
  struct Begin {
    SlideStart<Lanes<T>> start;
    Lanes<T> path;  ///< over which they stick; without ages not filled
    Lanes<T> holds, limit;
    Mask<T> slides;   ///< within the step
    Mask<T> goes_on;  ///< or slid at its beginning, and was not unloaded
  };

  Begin begin(const Shared& m, std::uint32_t i) const {
    Lanes<T> y(T(0));
    if constexpr (axes == 2) y = load(patch.zy + i) + m.p0y;
    Begin b;
    b.start = slide_start<T, axes>(load(patch.zx + i) + m.p0x, y, m.ex, m.ey);
    b.limit = load(patch.limit + i) * m.share;
    b.holds = b.limit;
    if constexpr (ages) {
      Lanes<T> tau;
      alignas(64) T age[width], held[width];
      for (std::uint32_t k = 0; k < width; ++k) {
        const double since = patch.since[i + k];
        age[k] = static_cast<T>(age_at(advance, advance.start, since));
        held[k] = since < advance.start - advance.rounding ? T(1) : T(0);
      }
      const Lanes<T> none(T(0));
      const Lanes<T> static_limit = b.limit;
      b.limit = static_limit * m.kinetic;
      b.goes_on = (load(held) == none) & (b.start.along >= none);
      if (advance.ageing_strength != 0.0) {
        const Lanes<T> later = load(age) + Lanes<T>(m.ageing.per_length) * m.length;
        tau = way_to_slide<T, axes>(b.start, static_limit * growth<T>(m.ageing, later));
        const Bent<Lanes<T>> bent{b.start.along, b.start.aside * b.start.aside};
        tau = aged_way<T, axes>(m.ageing, bent, none, static_limit, load(age), tau, tau < m.length);
        const Lanes<T> reached = b.start.along + tau;
        b.holds = root(reached * reached + bent.aside2);
      } else {
        tau = way_to_slide<T, axes>(b.start, b.holds);
      }
      tau = select_lanes(b.goes_on, way_to_slide<T, axes>(b.start, b.limit), tau);
      b.holds = select_lanes(b.goes_on, b.limit, b.holds);
      b.path = least(tau, m.length);
      b.slides = b.path < m.length;
      b.goes_on = b.goes_on | b.slides;
    } else {
      b.slides = slides_within<T, axes>(b.start, b.limit, m.length);
      b.goes_on = b.slides;
    }
    return b;
  }

  /// Whether any bristle slides. If none does, `margin` becomes the shortest distance from a deflection to
  /// where it would.
  bool any_slides(const Shared& m, const Extent& extent, T& margin) const {
    Lanes<T> shortest(margin);
    for (std::uint32_t i = extent.first; i < extent.end; i += width) {
      const Begin b = begin(m, i);
      if (xsimd::any(b.goes_on)) return true;
      const Lanes<T> x = load(patch.zx + i) + m.p1x;
      Lanes<T> bent = xsimd::abs(x);
      if constexpr (axes == 2) {
        const Lanes<T> y = load(patch.zy + i) + m.p1y;
        bent = root(x * x + y * y);
      }
      shortest = least(shortest, load(patch.limit + i) * m.share * Lanes<T>(T(1) - 16 * eps) - bent);
    }
    alignas(64) T lane[width];
    shortest.store_aligned(lane);
    for (const T x : lane) margin = least(margin, x);
    return false;
  }

  SlideSums slide_all(const Shared& m, const Extent& extent, Totals& totals) const {
    Row<T> stored[2], integral[2], dissipated, count;
    const Lanes<T> none(T(0));
    for (std::uint32_t i = extent.first; i < extent.end; i += width) {
      const std::uint32_t part = i / width % Row<T>::parts;
      Begin b = begin(m, i);
      if constexpr (!ages) b.path = way_that_sticks<T, axes>(b.start, b.limit, b.slides, m.length);
      // Short of the limit by what a step may round: the next one sticks until it has moved by more.
      const Lanes<T> limit = b.limit * Lanes<T>(T(1) - 4 * eps);
      const Slid<Lanes<T>> end =
          slide_on<T, axes, mean, energy>(b.start, b.slides, b.path, b.holds, limit, m.ex, m.ey, m.length);
      const Lanes<T> weight = load(patch.weight + i);
      const Lanes<T> x = select_lanes(b.slides, end.x - m.keep_x, load(patch.zx + i) + m.shift_x);
      stored[0].part[part] = stored[0].part[part] + weight * x;
      if (advance.commit) x.store_aligned(patch.zx + i);
      if constexpr (axes == 2) {
        const Lanes<T> y = select_lanes(b.slides, end.y - m.keep_y, load(patch.zy + i) + m.shift_y);
        stored[1].part[part] = stored[1].part[part] + weight * y;
        if (advance.commit) y.store_aligned(patch.zy + i);
      }
      if constexpr (mean) {
        integral[0].part[part] = integral[0].part[part] + weight * end.integral_x;
        if constexpr (axes == 2) integral[1].part[part] = integral[1].part[part] + weight * end.integral_y;
      }
      if constexpr (energy) {
        dissipated.part[part] = dissipated.part[part] + weight * end.dissipated;
        count.part[part] = count.part[part] + select_lanes(b.slides & (weight > none), Lanes<T>(T(1)), none);
      }
      if constexpr (ages)
        if (advance.commit) note_time(b.goes_on, i);
    }
    SlideSums sums;
    for (int axis = 0; axis < axes; ++axis) {
      sums.stored[axis] = tree_sum(stored[axis]);
      if constexpr (mean) sums.integral[axis] = tree_sum(integral[axis]);
    }
    if constexpr (energy) {
      sums.dissipated = tree_sum(dissipated);
      totals.snaps += to_count(tree_sum(count));
    }
    return sums;
  }

  void note_time(Mask<T> slid, std::uint32_t i) const {
    alignas(64) T lane[width];
    select_lanes(slid, Lanes<T>(T(1)), Lanes<T>(T(0))).store_aligned(lane);
    for (std::uint32_t k = 0; k < width; ++k)
      if (lane[k] != T(0)) patch.since[i + k] = advance.start + advance.duration;
  }
};

template <class T, int axes, bool mean, bool energy, bool ages>
struct SlideOf {
  static void run(const SlideView<T>& patch, const Advance& advance, std::uint32_t first, std::uint32_t last,
                  Totals& totals) {
    Slider<T, axes, mean, energy, ages>(patch, advance).run(first, last, totals);
  }
};
#endif

}  // namespace
}  // namespace bristle::detail
