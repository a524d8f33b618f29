// Bristles that age: growth of their snap lengths, and the path to a snap while the limit grows.
//
// A bristle that has been stuck for the age a (in units of Material::ageing_time) snaps at the deflection |z|
// = residual + delta g(a), with delta its fresh snap length. In a step its age grows in proportion to the
// path, by `per_length`. Both |z| and the limit change along the path, so the snap is the root of an
// equation. Because g is concave, |z| less the limit is a convex function of the path, and it is negative at
// the start: there is at most one snap. Newton's method starts from a path at or beyond the root, which the
// limit at the end of the step gives, and then never passes the root (core/patches/AGEING.md).
//
// The template parameter V is a vector, a bundle of eight vectors, or a plain number.
#pragma once

#include <limits>

#include "core/kernel_table.hpp"
#include "elementary.hpp"

namespace bristle::detail {
namespace {

constexpr double oldest = 1e30;  ///< largest age, in ageing times, and largest age gained per length of path

template <class T, class V = T>
struct AgeingLaw {
  T strength;
  V per_length;  ///< age (in ageing times) gained per length of path
  bool saturates;
};

/// Growth factor g(a) of a snap length at an age a, its derivative g', and the rate -g'' / g' at which the
/// derivative falls.
template <class V>
struct Growth {
  V factor, rate, fall;
};

template <class T, class V, class P>
inline V growth(const AgeingLaw<T, P>& law, V age) {
  const V one(T(1));
  const V strength(law.strength);
  if (law.saturates) return one + strength * (one - exponential<T>(V(T(0)) - least(age, V(T(79)))));
  return one + strength * natural_log<T>(one + age);
}

template <class T, class V, class P>
inline Growth<V> growth_and_rate(const AgeingLaw<T, P>& law, V age) {
  const V one(T(1));
  const V strength(law.strength);
  if (law.saturates) {
    const V missing = exponential<T>(V(T(0)) - least(age, V(T(79))));
    return {one + strength * (one - missing), strength * missing, one};
  }
  const V grown = one + age;
  const V fall = divide(one, grown);
  return {one + strength * natural_log<T>(grown), strength * fall, fall};
}

constexpr int most_newton_steps = 60;

/// Returns whether Newton's method needs another iteration: whether the error left after a correction by
/// `fall` exceeds rounding. With the limit's derivatives before the correction, that error is half curve
/// fall^2 / (1 - slope). Where the path only just touches the limit, each correction halves the error, which
/// is then at most `fall`.
template <class T, class V>
inline auto goes_on(V fall, V slope, V curve, V limit) {
  constexpr T accuracy = sizeof(T) == 4 ? T(0x1p-22) : T(0x1p-50);
  constexpr T touching = sizeof(T) == 4 ? T(0x1p-5) : T(0x1p-14);
  const V rise = V(T(1)) - slope;
  const V size = fall * curve;
  const V left = select_lanes(size > V(T(0.25)) * rise, fall * (V(touching) * rise), fall * size);
  return left > V(accuracy) * (limit * rise);
}

/// Deflection of a bristle at the start of a step, split by the direction of motion: its part along, and the
/// square of its part across.
template <class V>
struct Bent {
  V along, aside2;
};

/// Returns the path along the motion after which the deflection has grown to the length `radius`; 0 if it is
/// that long at the start.
template <class T, int axes, class V>
inline V path_to_circle(const Bent<V>& bent, V radius) {
  const V none(T(0));
  if constexpr (axes == 1) return most(radius - bent.along, none);
  return most(root(most(radius * radius - bent.aside2, none)) - bent.along, none);
}

/// Returns the path after which an ageing bristle snaps, for the lanes of `open`, by Newton's method from the
/// path `path`, which must be at or beyond the snap. `delta`: fresh snap length; `age`: age at the start of
/// the step.
template <class T, int axes, class V, class M, class P>
inline V aged_path(const AgeingLaw<T, P>& law, const Bent<V>& bent, V residual, V delta, V age, V path,
                   M open) {
  const V none(T(0));
  const V one(T(1));
  const V per_length(law.per_length);
  const V flattest(T(16) * std::numeric_limits<T>::epsilon());
  for (int n = 0; n < most_newton_steps && any_lane(open); ++n) {
    const Growth<V> now = growth_and_rate<T>(law, most(age + per_length * path, none));
    const V limit = residual + delta * now.factor;
    V reach = limit;
    V slope = delta * (per_length * now.rate);
    V curve = slope * (per_length * now.fall);
    if constexpr (axes == 2) {
      reach = root(most(limit * limit - bent.aside2, none));
      const V inverse = divide(one, most(reach, flattest));
      slope = slope * (limit * inverse);
      curve = curve * (limit * inverse) + (slope * slope) * ((bent.aside2 * inverse) * (inverse * inverse));
    }
    slope = least(slope, one - flattest);
    const V fall = most(divide(path - (reach - bent.along), one - slope), none);
    path = select_lanes(open, most(path - fall, none), path);
    open = open & goes_on<T>(fall, slope, curve, limit);
  }
  return path;
}

/// Returns the path between two snaps of a bristle that ages, from its fresh snap length. If that path
/// exceeds `remaining`, the path left in the step, any value of at least `remaining` serves, and is returned.
template <class T, class V>
inline V aged_length(const AgeingLaw<T>& law, V delta, V remaining) {
  const V none(T(0));
  const V one(T(1));
  const V per_length(law.per_length);
  V length = delta * growth<T>(law, per_length * most(remaining, none));
  auto open = remaining > length;
  for (int n = 0; n < most_newton_steps && any_lane(open); ++n) {
    const Growth<V> now = growth_and_rate<T>(law, per_length * length);
    // Limits the slope of the limit to 0.75, so that the divisor stays positive in lanes without a bristle.
    // Slopes of bristles never come near: they are below 0.33 at and beyond the root, for every allowed
    // strength of ageing.
    const V slope = least(delta * (per_length * now.rate), V(T(0.75)));
    const V fall = most(divide(length - delta * now.factor, one - slope), none);
    length = select_lanes(open, length - fall, length);
    open = open & goes_on<T>(fall, slope, slope * (per_length * now.fall), length);
  }
  return length;
}

/// Largest number of trials in sampling the bristle at the end of a long slide. On average at least one trial
/// in five is accepted, so the limit only ensures that the loop ends.
constexpr int most_trials = 1000;

template <class A>
inline double age_per_length(const A& step) {
  const double span = least(step.duration * step.ageing_rate, oldest);
  return least(span / step.length, oldest);
}

/// Returns the constants of ageing, taken from a step or a renewal, in the form in which the functions of
/// this file need them.
template <class T, class A>
inline AgeingLaw<T> ageing_of(const A& step) {
  return {static_cast<T>(step.ageing_strength), static_cast<T>(age_per_length(step)), step.ageing_form == 1};
}

/// Returns the age, in ageing times, that bristles have gained from the last rewrite of their block (at
/// `since`) until `time`.
template <class A>
inline double age_at(const A& step, double time, double since) {
  return least(most((time - since) * step.ageing_rate, 0.0), oldest);
}
/// Ages that bristles have gained since the last rewrite of their block, at the start and at the end of a
/// step.
struct BlockAge {
  double before, after;
};
template <class A>
inline BlockAge age_since(const A& step, double since) {
  return {age_at(step, step.start, since), age_at(step, step.start + step.duration, since)};
}
/// Returns a lower bound of the age gained since `since`, valid in every later step. A snap limit computed
/// from it cannot be too high, so no snap is missed.
template <class A>
inline double least_later_age(const A& step, double since) {
  return age_at(step, step.start + step.duration - step.rounding, since);
}

}  // namespace
}  // namespace bristle::detail
