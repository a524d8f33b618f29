// far.hpp for bristles that age: bristle by bristle in double, both rules.
//
// At constant velocity the paths from snap to snap of redrawn bristles are independent, as without ageing,
// but follow another law: l = delta g(l / v). `PatchView::law` holds the moments of that law (core,
// aged_law.cpp) with the parameters of delta's.
#pragma once

#include "ageing.hpp"
#include "far.hpp"

namespace bristle::detail {
namespace {

/// A bristle met at a random place of a long slide. Its density is proportional to the path between its
/// snaps: it is drawn in proportion to delta and accepted in proportion to l / delta, which grows with delta.
struct MetBristle {
  double delta, length;
};
template <class Next>
inline MetBristle meet_bristle(const KernelLaw& law, const AgeingLaw<double>& ageing, double largest_growth,
                               const Next& next) {
  MetBristle met{};
  for (int n = 0; n < most_trials; ++n) {
    if (law.kind == law_exponential) {
      const double u = next();
      met.delta =
          least(most(-law.location * (natural_log<double>(u) + natural_log<double>(next())), law.shortest),
                law.longest);
    } else {
      met.delta = length_met<double>(law, next());
    }
    met.length = aged_length<double>(ageing, met.delta, largest_growth * met.delta);
    if (next() * largest_growth * met.delta <= met.length) break;
  }
  return met;
}

/// Redraw: carries a bristle along the path left after its first snap. `delta` becomes the fresh snap length
/// that it ends with, `state` its draw state.
template <class T>
inline AfterFarStep land_redraw_aged(const KernelLaw& law, const AgeingLaw<double>& ageing,
                                     double largest_growth, double rest, T& delta, std::uint32_t& state) {
  const auto next = [&state] {
    state += draw_stride;
    return share_of<double>(mix(state));
  };
  AfterFarStep land{0.0, 0.0, 0.0, 0.0};
  for (;;) {
    if (rest > law.stationary_from || rest > phase_is_lost) {
      const MetBristle met = meet_bristle(law, ageing, largest_growth, next);
      land.deflection = least(next() * met.length, rest);
      delta = static_cast<T>(met.delta);
      const double jumped = rest - land.deflection;
      land.squares += most(law.squares_per_length * jumped + law.squares_offset, 0.0);
      land.variance += most(law.variance_per_length * jumped + law.variance_offset, 0.0);
      if (jumped > 0.0) land.count += whole_part(jumped * law.inverse_mean + law.count_offset + 0.5);
      return land;
    }
    if (rest > law.jump_from) {
      rest -= jump_renewals(law, rest, next(), land);
      continue;
    }
    delta = static_cast<T>(length_at<double>(law, next()));
    const double length = aged_length<double>(ageing, static_cast<double>(delta), rest);
    if (rest < length) {
      land.deflection = rest;
      return land;
    }
    rest -= length;
    land.squares += length * length;
    land.count += 1.0;
  }
}

/// Keep: all paths from snap to snap of one bristle are equal.
inline AfterFarStep land_keep_aged(const AgeingLaw<double>& ageing, double rest, double delta,
                                   std::uint32_t phase) {
  AfterFarStep land{rest, 0.0, 0.0, 0.0};
  const double length = aged_length<double>(ageing, delta, rest);
  land.count = whole_part(rest / length);
  land.deflection = least(most(rest - land.count * length, 0.0), length);
  if (rest > phase_is_lost) land.deflection = share_of<double>(phase) * length;
  land.squares = land.count * (length * length);
  return land;
}

template <class T, int axes, bool redraw>
class FarAged {
 public:
  FarAged(const PatchView<T>& the_patch, const Advance& the_advance, const FarMotion& the_motion,
          const BlockAge& the_age)
      : patch(the_patch),
        advance(the_advance),
        motion(the_motion),
        age(the_age),
        ageing(ageing_of<double>(the_advance)) {}

  void advance_bristle(std::uint32_t i, double w, FarLanes& lanes) const {
    const std::uint32_t lane = i % lane_count;
    const double left = motion.residual;
    const double sx = static_cast<double>(patch.zx[i]) + motion.p0[0];
    const double sy = axes == 2 ? static_cast<double>(patch.zy[i]) + motion.p0[1] : 0.0;
    T x = patch.zx[i] + static_cast<T>(motion.p1[0]);
    T y = axes == 2 ? patch.zy[i] + static_cast<T>(motion.p1[1]) : T(0);
    T end_age = patch.age[i] + static_cast<T>(age.after);
    T limit = patch.delta[i];
    const double delta = static_cast<double>(limit) - left;
    const double aside = axes == 2 ? sx * motion.ey - sy * motion.ex : 0.0;
    const Bent<double> bent{axes == 2 ? sx * motion.ex + sy * motion.ey : sx * motion.ex, aside * aside};
    const double oldest_limit =
        left + delta * growth<double>(ageing, most(static_cast<double>(end_age), 0.0));
    double tau = way_to_circle<double, axes>(bent, oldest_limit);
    if (!(tau < motion.length)) {
      if (advance.snaps_all) {  // longer than a far step: the position stays, so the bristle is carried
        x = static_cast<T>(sx + motion.ex * motion.length);
        if constexpr (axes == 2) y = static_cast<T>(sy + motion.ey * motion.length);
      }
      lanes.mean[0][lane] += w * (sx + static_cast<double>(x));
      lanes.mean[1][lane] += w * (sy + static_cast<double>(y));
    } else {
      tau = aged_way<double, axes>(ageing, bent, left, delta, static_cast<double>(patch.age[i]) + age.before,
                                   tau, true);
      const double rest = motion.length - tau;
      std::uint32_t state = 0;
      AfterFarStep land;
      if constexpr (redraw) {
        state = patch.draw[i];
        T fresh{};
        land = land_redraw_aged<T>(*patch.law, ageing, advance.largest_growth, rest, fresh, state);
        limit = static_cast<T>(left) + fresh;
      } else {
        const std::uint32_t phase = mix(static_cast<std::uint32_t>(advance.phase_key) ^ mix(i + 1));
        land = land_keep_aged(ageing, rest, delta, phase);
      }
      const double r = land.deflection;
      const double part = tau * motion.inverse;
      const double integral = part * tau + land.squares * motion.inverse + (r * motion.inverse) * r +
                              2.0 * left * (rest * motion.inverse);
      const double reached = bent.along + tau;
      x = static_cast<T>((left + r) * motion.ex);
      y = static_cast<T>((left + r) * motion.ey);
      end_age = static_cast<T>(least(ageing.per_length * r, oldest));
      lanes.mean[0][lane] += w * (2.0 * sx * part + motion.ex * integral);
      lanes.mean[1][lane] += w * (2.0 * sy * part + motion.ey * integral);
      lanes.squares[lane] +=
          w * ((reached * reached + bent.aside2 - left * left) + land.squares + 2.0 * left * (rest - r));
      lanes.further[lane] += w * land.squares;
      lanes.variance[lane] += w * (w * land.variance);
      lanes.snaps[lane] += 1.0 + land.count;
      if (advance.commit) {
        if constexpr (redraw) {
          patch.delta[i] = limit;
          patch.draw[i] = state;
        }
      }
    }
    if (advance.commit) {
      patch.zx[i] = x;
      if constexpr (axes == 2) patch.zy[i] = y;
      patch.age[i] = least(end_age, static_cast<T>(oldest));
    }
    lanes.stored[0][lane] += w * static_cast<double>(x);
    lanes.stored[1][lane] += w * static_cast<double>(y);
  }

 private:
  const PatchView<T>& patch;
  const Advance& advance;
  const FarMotion& motion;
  const BlockAge& age;
  const AgeingLaw<double> ageing;
};

/// Advances the bristles [start, start + active) of one block in which a bristle snaps.
template <class T, int axes, bool redraw>
[[gnu::noinline]] FarSums far_block_aged(const PatchView<T>& patch, const Advance& advance,
                                         std::uint32_t start, std::uint32_t active, const double (&p0)[2],
                                         const double (&p1)[2]) {
  const FarMotion motion{advance.direction[0], advance.direction[1], advance.length, 1.0 / advance.length,
                         advance.residual,     {p0[0], p0[1]},       {p1[0], p1[1]}};
  const BlockAge age = age_since(advance, patch.since[start / block_size]);
  const std::uint32_t end = start + active;
  const auto weight_of = [&patch](std::uint32_t i) {
    return i < patch.whole ? 1.0 : static_cast<double>(patch.fraction);
  };
  [[maybe_unused]] const std::uint32_t key = redraw ? noise_key(patch.draw + start) : 0u;
  FarLanes lanes;
  const FarAged<T, axes, redraw> far(patch, advance, motion, age);
  for (std::uint32_t i = start; i < end; ++i) far.advance_bristle(i, weight_of(i), lanes);
  return far_total<axes, redraw>(lanes, advance, key);
}

}  // namespace
}  // namespace bristle::detail
