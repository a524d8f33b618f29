// The scalar reference of bristles that slide, one at a time, written to be read beside core/MODEL.md,
// section 30. The vector kernels (slide.hpp, slide_step.hpp) must give the same bits, so the reference
// rounds as they do.
#pragma once

#include <limits>

#include "slide_step.hpp"

namespace bristle::detail {
namespace {

/// Deflection z' and sums of one bristle after a step; whether it slid, and whether it is still sliding.
template <class T>
struct OneSlid {
  T x, y, integral_x, integral_y, dissipated;
  bool slides, goes_on;
};

template <class T, int axes, bool ages>
OneSlid<T> slide_one(const SlideView<T>& patch, const Advance& advance, const SlideMotion& motion,
                     std::uint32_t i) {
  const T ex = static_cast<T>(advance.direction[0]);
  const T ey = static_cast<T>(advance.direction[1]);
  const T length = static_cast<T>(motion.length);
  const T x = patch.zx[i] + static_cast<T>(motion.p0[0]);
  const T y = axes == 2 ? patch.zy[i] + static_cast<T>(motion.p0[1]) : T(0);
  const T along = axes == 2 ? x * ex + y * ey : x * ex;
  const T aside = axes == 2 ? x * ey - y * ex : T(0);
  const auto way_to = [&](T radius) {
    if constexpr (axes == 1) return most(radius - along, T(0));
    return most(root(most(radius * radius - aside * aside, T(0))) - along, T(0));
  };

  // Path after which the bristle begins to slide, and the limit at which it slides. A bristle within its
  // limit slides if it would end beyond the limit.
  constexpr T eps = std::numeric_limits<T>::epsilon();
  T holds = patch.limit[i] * patch.share;
  T limit = holds;
  T path = length;
  bool slides = false;
  bool still_slides = false;
  if constexpr (ages) {
    const T fresh = holds;
    limit = fresh * patch.kinetic;
    still_slides = !(patch.since[i] < advance.start - advance.rounding) && along >= T(0);
    T tau;
    if (still_slides) {
      holds = limit;
      tau = way_to(limit);
    } else if (advance.ageing_strength != 0.0) {
      const AgeingLaw<T> ageing = ageing_of<T>(advance);
      const T age = static_cast<T>(age_at(advance, advance.start, patch.since[i]));
      // Starts Newton's method from the limit at the end of the step, which gives a path that is too long.
      tau = way_to(fresh * growth<T>(ageing, age + ageing.per_length * length));
      tau = aged_way<T, axes>(ageing, Bent<T>{along, aside * aside}, T(0), fresh, age, tau, tau < length);
      const T reached = along + tau;
      holds = root(reached * reached + aside * aside);
    } else {
      tau = way_to(holds);
    }
    path = least(tau, length);
    slides = path < length;
  } else {
    const T ahead = along + length;
    slides = axes == 2 ? ahead * ahead + aside * aside > limit * limit : ahead > limit;
    // A bristle already at its limit slides at once.
    const bool at_limit =
        axes == 2 && along >= T(0) && along * along + aside * aside >= limit * limit * (T(1) - 32 * eps);
    if (slides) path = at_limit ? T(0) : least(way_to(limit), length);
  }
  limit = limit * (T(1) - 4 * eps);

  OneSlid<T> end{};
  end.slides = slides;
  end.goes_on = slides || still_slides;
  T along_integral = T(0.5) * path * path;
  T aside_integral = T(0);
  if (slides) {
    const T s = length - path;
    end.x = limit * ex;
    end.y = limit * ey;
    T work = limit * s;
    const T rounds = least(s, limit) * (4 * eps);
    if (axes == 2 && aside * aside > rounds * rounds) {
      // Half the angle from deflection to motion has the tangent a / p, which falls as exp(-s / limit).
      const T a = aside;
      const T p = most(holds + (along + path), T(1e-15));
      const Decay<T> turn = decay<T>(s * (patch.per_limit[i] * per_share_of(patch)));
      const T w = a * turn.left;
      const T both = p * p + w * w;
      const T scale = limit / both;
      const T along_now = (p * p - w * w) * scale;
      const T aside_now = ((p + p) * w) * scale;
      end.x = along_now * ex + aside_now * ey;
      end.y = along_now * ey - aside_now * ex;
      const T grown = (a * a) * (turn.lost * (T(1) + turn.left));
      work = limit * (s - limit * log_of_one_plus<T>(grown, both));
      const T angle = arc_tangent<T>((a * p) * turn.lost / (p * p + a * w));
      aside_integral = (limit * limit) * (angle + angle);
    }
    along_integral += work;
    end.dissipated = work + T(0.5) * ((holds - limit) * (holds + limit));
  }
  end.integral_x = x * path + along_integral * ex;
  if constexpr (axes == 2) {
    end.integral_x = end.integral_x + aside_integral * ey;
    end.integral_y = y * path + (along_integral * ey - aside_integral * ex);
  }
  return end;
}

template <class T, int axes, bool mean, bool energy, bool ages>
struct SlideOf {
  static void run(const SlideView<T>& patch, const Advance& advance, std::uint32_t first, std::uint32_t last,
                  Totals& totals) {
    for (std::uint32_t b = first; b < last; ++b) run_block(patch, advance, b, totals);
  }

 private:
  static void run_block(const SlideView<T>& patch, const Advance& advance, std::uint32_t b, Totals& totals) {
    SlideBlock& block = patch.blocks[b];
    const std::uint32_t start = b * block_size;
    const std::uint32_t end = start + block_size < patch.rows ? start + block_size : patch.rows;
    totals.visited += end - start;
    ++totals.blocks_visited;
    const SlideMotion motion(advance, block);

    bool any = false;
    T margin = std::numeric_limits<T>::max();
    for (std::uint32_t i = start; i < end && !any; ++i) {
      any = slide_one<T, axes, ages>(patch, advance, motion, i).goes_on;
      const T x = patch.zx[i] + static_cast<T>(motion.p1[0]);
      const T y = axes == 2 ? patch.zy[i] + static_cast<T>(motion.p1[1]) : T(0);
      const T bent = axes == 2 ? root(x * x + y * y) : (x < T(0) ? -x : x);
      margin = least(margin,
                     patch.limit[i] * patch.share * (T(1) - 16 * std::numeric_limits<T>::epsilon()) - bent);
    }
    if (!any) {
      book_stuck(block, advance, axes, mean, totals);
      if (advance.commit) block.reach = static_cast<double>(margin);
      return;
    }

    T stored[2][lane_count] = {}, integral[2][lane_count] = {}, dissipated[lane_count] = {};
    const T keep[2] = {static_cast<T>(motion.counts_anew ? 0.0 : motion.p1[0]),
                       static_cast<T>(motion.counts_anew ? 0.0 : motion.p1[1])};
    const T shift[2] = {static_cast<T>(motion.counts_anew ? motion.p1[0] : 0.0),
                        static_cast<T>(motion.counts_anew ? motion.p1[1] : 0.0)};
    for (std::uint32_t i = start; i < end; ++i) {
      const std::uint32_t k = i % lane_count;
      const T w = patch.weight[i];
      const OneSlid<T> slid = slide_one<T, axes, ages>(patch, advance, motion, i);
      const T x = slid.slides ? slid.x - keep[0] : patch.zx[i] + shift[0];
      stored[0][k] += w * x;
      integral[0][k] += w * slid.integral_x;
      dissipated[k] += w * slid.dissipated;
      if (advance.commit) patch.zx[i] = x;
      if constexpr (axes == 2) {
        const T y = slid.slides ? slid.y - keep[1] : patch.zy[i] + shift[1];
        stored[1][k] += w * y;
        integral[1][k] += w * slid.integral_y;
        if (advance.commit) patch.zy[i] = y;
      }
      if constexpr (energy)
        if (slid.slides && w > T(0)) ++totals.snaps;
      if constexpr (ages)
        if (slid.goes_on && advance.commit) patch.since[i] = advance.start + advance.duration;
    }
    SlideSums sums;
    for (int axis = 0; axis < axes; ++axis) {
      sums.stored[axis] = static_cast<double>(tree_sum(stored[axis]));
      if constexpr (mean) sums.integral[axis] = static_cast<double>(tree_sum(integral[axis]));
    }
    if constexpr (energy) sums.dissipated = static_cast<double>(tree_sum(dissipated));
    book_slid(block, advance, motion, sums, axes, totals);
  }
};

}  // namespace
}  // namespace bristle::detail
