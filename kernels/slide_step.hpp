// One step over the blocks of a patch whose bristles slide (slide.hpp): which blocks are visited, and the
// sums.
//
// A block in which no bristle slides keeps its stored deflections, which follow the patch. In other blocks
// only the deflections of bristles that slide change, so that creep does not erode those of the others. If
// such a block's position is far from the patch, all its deflections are rewritten relative to the patch.
#pragma once

#include <limits>
#include <type_traits>

#include "ageing.hpp"
#include "slide.hpp"
#if defined(BRISTLE_KERNEL_ISA)
#include "pair.hpp"
#endif

namespace bristle::detail {
namespace {

/// Longest step, scaled, that is computed directly. After it every bristle lies along the motion, to the last
/// bit.
constexpr double longest_slide = 1048576.0;  // 2^20

/// Distance of the patch from a block's position, scaled, beyond which the block's deflections are rewritten.
constexpr double farthest_reference = 0.25;

/// Returns the factor that turns 1 / limit of a bristle into the inverse of the limit at which it slides
/// under the present load.
template <class T>
inline T per_share_of(const SlideView<T>& patch) {
  return T(1) / most(patch.share * patch.kinetic, T(1e-15));
}

/// Values of a step (length, displacement of the patch) that all bristles of a block share.
struct SlideMotion {
  double length;  ///< computed part of the step's length; more length changes no deflection

  /// Displacement of the patch from the block's position, at the start and the end of the step.
  double p0[2], p1[2];
  bool counts_anew;  ///< whether deflections are rewritten relative to the position at the end of the step

  SlideMotion(const Advance& a, const SlideBlock& block)
      : length(least(a.length, longest_slide)),
        p0{displacement(a.from[0], block.position[0]), displacement(a.from[1], block.position[1])},
        p1{displacement(a.to[0], block.position[0]), displacement(a.to[1], block.position[1])},
        counts_anew(p1[0] * p1[0] + p1[1] * p1[1] > farthest_reference * farthest_reference) {}
};

/// Returns the block's weight times the displacement from its position to `to`, in fixed point, rounded.
inline std::int64_t carried(const SlideBlock& block, const std::int64_t (&to)[2], int axis) {
  return to_integer(block.weight * static_cast<double>(difference(to[axis], block.position[axis])));
}

/// Sums over the bristles of a block in which at least one slid.
struct SlideSums {
  double stored[2] = {0.0, 0.0};  ///< sum of weight x deflection, as stored after the step

  /// Sum of weight x the deflection's integral over the computed part of the step.
  double integral[2] = {0.0, 0.0};
  double dissipated = 0.0;  ///< energy dissipated in the computed part of the step
};

/// Adds the deflections of a block in which no bristle slid to the totals of the patch.
inline void book_stuck(const SlideBlock& block, const Advance& a, int axes, bool mean, Totals& totals) {
  for (int axis = 0; axis < axes; ++axis) {
    const std::int64_t after = carried(block, a.to, axis);
    totals.stored[axis] += block.stored[axis] + after;
    if (mean) totals.twice_mean[axis] += 2 * block.stored[axis] + carried(block, a.from, axis) + after;
  }
}

/// Adds the sums of a block in which bristles slid to the totals of the patch, and updates the block.
inline void book_slid(SlideBlock& block, const Advance& a, const SlideMotion& motion, const SlideSums& sums,
                      int axes, Totals& totals) {
  SlideBlock now = block;
  // Sum of weight x deflection along the motion at the end, for the part of a step beyond the computed
  // length.
  double along = 0.0;
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
  /// Whether the exponentials of a block are computed in a loop of their own, before its deflections are
  /// read: in one loop each vector's chain of operations would be so long that the processor could overlap
  /// too few.
  static constexpr bool keeps_decays = axes == 2 && !mean && !energy && !ages;

  const SlideView<T> patch;  ///< copy, because what a step writes may alias the caller's view
  const Advance& advance;
  const bool commits = advance.commit != 0;

  struct Extent {
    std::uint32_t first, end;
  };
  static std::uint32_t least_index(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }

  struct Shared {
    Lanes<T> ex, ey, length, p0x, p0y, p1x, p1y, share, per_share, kinetic, keep_x, keep_y, shift_x, shift_y;
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
          per_share(per_share_of(patch)),
          kinetic(patch.kinetic),
          ageing(ageing_of<T>(a)) {
      const Lanes<T> none(T(0));
      keep_x = m.counts_anew ? none : p1x;
      keep_y = m.counts_anew ? none : p1y;
      shift_x = m.counts_anew ? p1x : none;
      shift_y = m.counts_anew ? p1y : none;
    }
  };

  /// State of a vector of bristles at the beginning of a step in which they may slide.
  template <class V>
  struct Begin {
    using Which = decltype(V() < V());
    SlideStart<V> start;
    V path;  ///< path over which the bristles stick; not filled without ageing
    V holds, limit;
    Which slides;   ///< bristles that slide within the step
    Which goes_on;  ///< bristles that slide in the step, or slid when it began and were not unloaded
  };

  template <class V>
  Begin<V> begin(const Shared& m, std::uint32_t i) const {
    Begin<V> b;
    V y(T(0));
    if constexpr (axes == 2) y = load_as<V>(patch.zy + i) + V(m.p0y);
    b.start = slide_start<T, axes>(load_as<V>(patch.zx + i) + V(m.p0x), y, V(m.ex), V(m.ey));
    b.limit = load_as<V>(patch.limit + i) * V(m.share);
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
      b.slides = slides_within<T, axes>(b.start, b.limit, V(m.length));
      b.goes_on = b.slides;
    }
    return b;
  }

  /// Whether any bristle slides. If none does, `margin` becomes the shortest path on which one would begin to
  /// slide.
  bool any_slides(const Shared& m, const Extent& extent, T& margin) const {
    Lanes<T> shortest(margin);
    for (std::uint32_t i = extent.first; i < extent.end; i += width) {
      const Begin<Lanes<T>> b = begin<Lanes<T>>(m, i);
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

  /// Returns exp(-s / l) and 1 - exp(-s / l) for bristles from i on: path s, limit l under the present load.
  template <class V>
  [[gnu::always_inline]] Decay<V> decay_over(const Shared& m, std::uint32_t i, V s) const {
    return decay<T>(s * (load_as<V>(patch.per_limit + i) * V(m.per_share)));
  }

  /// Advances one vector of bristles, from bristle i on. `decays`: exp(-length / limit) of the block's
  /// bristles, or null.
  template <class V>
  [[gnu::always_inline]] void slide_some(const Shared& m, std::uint32_t i, const T* decays,
                                         Row<T> (&stored)[2], Row<T> (&integral)[2], Row<T>& dissipated,
                                         Row<T>& count) const {
    Begin<V> b = begin<V>(m, i);
    // Stops short of the limit by the rounding error of a step, so that in the next step the tip sticks until
    // the patch has moved by more.
    const V limit = b.limit * V(T(1) - 4 * eps);
    const auto finish = [&](auto at_once) {
      return slide_on<T, axes, mean, energy, at_once.value>(
          b.start, b.slides, b.path, b.holds, limit, V(m.ex), V(m.ey), V(m.length), [&](V s) {
            if constexpr (at_once.value && keeps_decays)
              if (decays != nullptr) return Decay<V>{load_as<V>(decays + i % block_size), V(T(0))};
            return decay_over<V>(m, i, s);
          });
    };
    if constexpr (!ages) b.path = way_that_sticks<T, axes>(b.start, b.limit, b.slides, V(m.length));
    // Branches, which can be predicted; after a selection the exponential would wait for comparisons.
    bool at_once = false;
    if constexpr (keeps_decays) at_once = !any_lane(sticks_first<T>(b.start, b.limit, b.slides));
    const Slid<V> end = at_once ? finish(std::true_type{}) : finish(std::false_type{});
    const V weight = load_as<V>(patch.weight + i);
    const V x = select_lanes(b.slides, end.x - V(m.keep_x), load_as<V>(patch.zx + i) + V(m.shift_x));
    add_to(stored[0], i, weight * x);
    if (commits) store(x, patch.zx + i);
    if constexpr (axes == 2) {
      const V y = select_lanes(b.slides, end.y - V(m.keep_y), load_as<V>(patch.zy + i) + V(m.shift_y));
      add_to(stored[1], i, weight * y);
      if (commits) store(y, patch.zy + i);
    }
    if constexpr (mean) {
      add_to(integral[0], i, weight * end.integral_x);
      if constexpr (axes == 2) add_to(integral[1], i, weight * end.integral_y);
    }
    if constexpr (energy) {
      const V none(T(0));
      add_to(dissipated, i, weight * end.dissipated);
      add_to(count, i, select_lanes(b.slides & (weight > none), V(T(1)), none));
    }
    if constexpr (ages)
      if (advance.commit) note_time(b.goes_on, i);
  }

  /// Whether any bristle of the vector from i on is bent across the motion by more than root(eps).
  bool turns(const Shared& m, std::uint32_t i) const {
    const Lanes<T> aside = begin<Lanes<T>>(m, i).start.aside;
    return xsimd::any(aside * aside > Lanes<T>(eps));
  }

  SlideSums slide_all(const Shared& m, const Extent& extent, Totals& totals) const {
    Row<T> stored[2], integral[2], dissipated, count;
    std::uint32_t i = extent.first;
    alignas(64) T decays[keeps_decays ? block_size : 1];
    const T* ready = nullptr;
    if constexpr (keeps_decays)
      if (extent.end - extent.first > 2 * width && turns(m, i)) {
        for (std::uint32_t k = i; k < extent.end; k += width)
          store(decay_over<Lanes<T>>(m, k, m.length).left, decays + k % block_size);
        ready = decays;
      }
    if constexpr (!ages)
      for (; i + 2 * width <= extent.end; i += 2 * width)
        slide_some<Pair<T>>(m, i, ready, stored, integral, dissipated, count);
    for (; i < extent.end; i += width) slide_some<Lanes<T>>(m, i, ready, stored, integral, dissipated, count);
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
