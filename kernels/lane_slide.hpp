// A step of sixteen contacts whose springs slide at their limit (SnapRule::slide), one contact in each lane
// (core/MODEL.md, section 30, has the formulas). One source for vectors and for plain numbers.
//
// A spring's state is its force, so a load that rises at rest changes only the stiffness and the limits.
// Within a step forces are divided by the stiffness that belongs to the present load. In these units, scaled
// lengths, a spring slides at its limit l under every load, and a contact that is stiffer than its load
// (after a fall) moves by a longer path. A spring that sticks is not written: its force grows with `base`,
// which is in double. A slide adds the path of the tip to a stored force, never the difference of two forces.
// Its rounding is spread evenly, and over the next 1/64 limits the spring returns to its limit. Therefore
// slow sliding turns and dissipates as it should. The force of a contact is the sum of what its springs
// store: while they stick it has no rounding of single precision, which would make a stuck body creep.
#pragma once

#include <limits>

#include "lane_finish.hpp"
#include "slide.hpp"

namespace bristle::detail {
namespace {

/// Start of the slide of each tip in a vector: whether it slides in the step, where it begins, and at which
/// lengths of its deflection.
template <class V, class Which>
struct LaneStart {
  Which slides;
  Which at_once;  ///< slides from the start of the step, at |z| within roundings of the limit
  V path;         ///< path over which the tip sticks
  V start_limit;  ///< |z| at which the tip begins to slide
  V limit;        ///< |z| at which the tip slides
};

/// Steps the contacts of one vector from the lane `first` on, one contact in each lane, spring by spring.
template <class E, class T, int axes, bool all, bool timed>
class LaneSlider {
  using V = typename E::V;
  using Which = decltype(V() < V());

 public:
  /// Runs the step. Makes the object as a local variable whose address is not taken, so that its vectors may
  /// stay in registers.
  [[gnu::noinline]] static void run(const SlideLaw<T>& law, const SlideColumns<T>& columns,
                                    const LaneInput& input, const LaneMotion<T>& motion, std::uint32_t first,
                                    LaneSums<T>& sums) {
    LaneSlider slider(law, columns, input, motion, first);
    slider.run(sums);
  }

 private:
  LaneSlider(const SlideLaw<T>& the_law, const SlideColumns<T>& the_columns, const LaneInput& the_input,
             const LaneMotion<T>& the_motion, std::uint32_t the_first)
      : law(the_law), columns(the_columns), input(the_input), motion(the_motion), first(the_first) {}

  [[gnu::always_inline]] void run(LaneSums<T>& sums) {
    // Adds up sixteen springs in T, then these sums in double. Springs that are alike have equal roundings,
    // which would add up in a longer sum in single precision.
    for (std::uint32_t i = 0; i < law.springs;) {
      const bool is_first = i == 0;
      for (V& x : part) x = none;
      for (const std::uint32_t end = least_index(i + 16, law.springs); i < end; ++i) step(i);
      for (std::uint32_t c = 0; c < count; ++c) {
        alignas(64) T sum[E::size];
        E::put(sum, part[c]);
        double* const total = sums.of[c].lane + first;
        for (std::uint32_t k = 0; k < E::size; ++k)
          total[k] = (is_first ? 0.0 : total[k]) + static_cast<double>(sum[k]);
      }
    }
  }

  static constexpr T eps = std::numeric_limits<T>::epsilon();
  const V none = V(T(0));

  const SlideLaw<T>& law;
  const SlideColumns<T>& columns;
  const LaneInput& input;
  const LaneMotion<T>& motion;
  const std::uint32_t first;
  const V ex = get(motion.ex), ey = get(motion.ey), length = get(motion.length);
  const V base_x = get(motion.base[0]), base_y = get(motion.base[1]), per_unit = get(motion.per_unit);
  const V unit = get(motion.unit), taken_x = get(motion.taken[0]), taken_y = get(motion.taken[1]);
  const Which moves = length > none, is_long = length >= V(T(1));
  const T per_kinetic_share = T(1) / static_cast<T>(law.kinetic * (1.0 - 4 * eps));
  const bool softens = all || motion.any_softens, any_long = any_lane(is_long);
  static constexpr std::uint32_t count = all ? lane_sums : lane_sums_of_end;
  V part[count];

  [[gnu::always_inline]] V get(const Lane16<T>& from) const { return E::get(from.lane + first); }
  static std::uint32_t least_index(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }
  [[gnu::always_inline]] void add(LaneSum to, V x) { part[to] = part[to] + x; }

  /// Returns limit / deflection, sqrt(limit^2 / bent2), by which a deflection beyond its limit is scaled.
  /// Uses a series if the load has fallen by little.
  [[gnu::always_inline]] V share_kept(V bent2, V limit, V per_limit) const {
    const V one(T(1)), over = bent2 * (per_limit * per_limit) - one;
    const Which little = over < V(T(sizeof(T) == 4 ? 0x1p-5 : 0.0));
    V share = V(T(0.3125)) - over * V(T(0.2734375));
    share = one - over * (V(T(0.5)) - over * (V(T(0.375)) - over * share));
    const Which is_far = (bent2 > limit * limit) & (!little);
    if (!any_lane(is_far)) return share;
    return select_lanes(little, share, divide(limit, most(root(bent2), V(T(1e-30)))));
  }

  [[gnu::always_inline]] V square_of(V x, V y, V centre) const {
    const V from_root = x + centre;
    if constexpr (axes == 1) return from_root * from_root;
    return from_root * from_root + V(static_cast<T>(law.energy)) * (y * y);
  }

  /// Steps spring i of each contact.
  [[gnu::always_inline]] void step(std::uint32_t i) {
    const V weight(law.weight[i]), full(law.limit[i]);
    const V centre(static_cast<T>(law.lean) * law.limit[i]);
    T* const at_x = columns.x[i].lane + first;
    T* const at_y = axes == 2 ? columns.y[i].lane + first : nullptr;
    if (first == 0 && input.ahead != nullptr) {
      const auto* const ahead = static_cast<const LaneColumn<T>*>(input.ahead);
      __builtin_prefetch(ahead + i);
      if constexpr (axes == 2) __builtin_prefetch(ahead + law.springs + i);
    }
    const V stored_x = E::get(at_x);
    const V stored_y = axes == 2 ? E::get(at_y) : none;
    V x = stored_x * per_unit + base_x - centre;
    V y = axes == 2 ? stored_y * per_unit + base_y : none;
    if constexpr (all) add(sum_squares_before, weight * square_of(x, y, centre));

    // Slides tips whose limits have fallen below their deflection with the load, although the contact does
    // not move. Afterwards all springs are within their limits up to a few roundings.
    V kinetic = full * V(T(1) - 4 * eps);
    V most_stuck = full * V(T(1) - eps);
    V static_reach = kinetic, age = none;
    Which goes_on = none > none;  // tips that were sliding when the step began
    if constexpr (timed) {
      find_age(i, age, goes_on);
      const V static_limit = law.ageing_strength != 0.0 ? full * growth<T>(ageing(), age) : full;
      static_reach = static_limit * V(T(1) - 3 * eps);
      kinetic = kinetic * V(static_cast<T>(law.kinetic));
      most_stuck = select_lanes(goes_on, full * V(static_cast<T>(law.kinetic)), static_limit) * V(T(1) - eps);
    }
    V bent2 = axes == 2 ? x * x + y * y : x * x;
    const Which beyond = bent2 > most_stuck * most_stuck;
    const bool any_beyond = any_lane(beyond);
    const V per_kinetic = V(law.per_limit[i] * per_kinetic_share);
    if (any_beyond) {
      const V keep = select_lanes(beyond, share_kept(bent2, kinetic, per_kinetic), V(T(1)));
      x = keep * x;
      y = keep * y;
      bent2 = select_lanes(beyond, kinetic * kinetic, bent2);
    }
    if constexpr (all) add(sum_squares_start, weight * square_of(x, y, centre));

    const SlideStart<V> start = slide_start<T, axes>(x, y, ex, ey);
    if constexpr (timed) goes_on = (goes_on | beyond) & (start.along >= none) & moves;
    const LaneStart<V, Which> onset = start_of(start, bent2, full, kinetic, goes_on, static_reach, age);
    // Changes of the deflection by sliding, along the motion and across it. The path over which the tip
    // sticks is not in them, because `base` has its effect.
    V along = none, aside = none, slide = none;
    Turn turned;
    if (any_lane(onset.slides)) {
      slide = select_lanes(onset.slides, length - onset.path, none);
      V a = start.along + onset.path, b = start.aside;  // deflection at which the tip begins to slide
      // Brings a deflection that rounding has changed back to the limit, fully over a path of 1/64 limits.
      // Otherwise the roundings of many steps would add up.
      const V limit2 = onset.limit * onset.limit,
              short_of = select_lanes(onset.at_once, limit2 - bent2, none);
      const V pace = least(V(T(64)) * length * per_kinetic, V(T(1)));
      V more = V(T(0.5)) * pace * (short_of * (per_kinetic * per_kinetic));
      const V not_slid = more * limit2;  // work that the tip does not do, as its path is shorter
      if constexpr (timed) {
        const V share = divide(onset.limit, most(onset.start_limit, V(T(1e-30))));
        more = select_lanes(onset.at_once, more, select_lanes(onset.slides, share - V(T(1)), none));
      }
      along = more * a;
      a = a + along;
      if constexpr (axes == 2) {
        aside = more * b;
        b = b + aside;
      }
      turned.work = select_lanes(onset.slides, onset.limit * slide, none);
      if constexpr (axes == 2) {
        // Takes an angle up to 4 eps s / l, at most 4 eps, as 0, because it is only rounding (s: path of the
        // slide, l: limit).
        const V rounds = least(slide, onset.limit) * V(4 * eps);
        const Which turns = onset.slides & (b * b > rounds * rounds);
        if (any_lane(turns)) turn(turns, a, b, slide, onset.limit, per_kinetic, turned);
        along = along + turned.along;
        aside = aside + turned.aside;
      }
      turned.work = turned.work - not_slid;
    }
    const V gain = onset.path + along;
    V now_x = none, now_y = none;
    if (softens || any_beyond || any_long) {
      now_x = x + (axes == 2 ? gain * ex + aside * ey : gain * ex);
      now_y = axes == 2 ? y + (gain * ey - aside * ex) : none;
    }
    if (softens) {
      add(sum_work, weight * turned.work);
      add(sum_squares_end, weight * square_of(now_x, now_y, centre));
    }
    if constexpr (all) add_integrals(weight, onset, gain, aside, turned);
    // Computes the tip's path: `slide` less the change of the deflection by the turn, which points backwards
    // in these units.
    const V tip = along - slide;
    V after_x = stored_after(stored_x, axes == 2 ? tip * ex + aside * ey : tip * ex, onset.slides) + taken_x;
    V after_y = axes == 2 ? stored_after(stored_y, tip * ey - aside * ex, onset.slides) + taken_y : none;
    if (any_beyond || any_long) {
      const Which anew = beyond | is_long;
      after_x = select_lanes(anew, (now_x + centre) * unit - get(motion.left[0]), after_x);
      after_y = select_lanes(anew, now_y * unit - get(motion.left[1]), after_y);
    }
    add(sum_force_x, weight * after_x);
    if constexpr (axes == 2) add(sum_force_y, weight * after_y);
    if (!input.stores) return;
    if (!motion.all_named) {
      after_x = select_lanes(named(), after_x, stored_x);
      after_y = select_lanes(named(), after_y, stored_y);
    }
    E::put(at_x, after_x);
    if constexpr (axes == 2) E::put(at_y, after_y);
    if constexpr (timed) note_time(i, onset.slides | goes_on, beyond);
  }

  /// Effects of sliding, without those of the path over which the tip sticks: changes of the deflection along
  /// the motion and across it, the integral of the deflection along the motion over the path of the slide,
  /// and the integral of what the deflection still changes.
  struct Turn {
    V along = V(T(0)), aside = V(T(0)), work = V(T(0));
    V missing_along = V(T(0)), missing_aside = V(T(0));
  };
  /// Turns the deflection (a, b), along and across the motion, towards the motion, while the root moves by
  /// `slide` and drags the tip. The tangent of half the angle shrinks by the factor exp(-slide / limit)
  /// (MODEL.md).
  [[gnu::always_inline]] void turn(Which turns, V a, V b, V slide, V limit, V per_limit, Turn& turned) const {
    const Tractrix<V> tip(b, most(limit + a, V(T(1e-30))), decay<T>(slide * per_limit));
    turned.along = select_lanes(turns, tip.template gained_along<T>(), none);
    turned.aside = none - select_lanes(turns, tip.lost_aside(), none);
    if (!softens) return;
    // Integrates the deflection by the trapezoidal rule with its end correction, because its slope is known:
    // along the motion sin^2(theta), across it -sin(theta) cos(theta). Where the error could exceed 1e-6 of
    // limit x path (1e-13 in double), takes the closed forms.
    constexpr T far = sizeof(T) == 4 ? 0x1p-13 : 0x1p-38;
    const V lengths = slide * per_limit, squared = lengths * lengths, twelfth = squared * V(T(1.0 / 12));
    const V half_slide = V(T(0.5)) * slide, end = a + turned.along, end_aside = b + turned.aside;
    V along = half_slide * turned.along + twelfth * (turned.aside * (b + end_aside));
    V aside = half_slide * turned.aside + twelfth * (a * b - end * end_aside);
    const Which is_far = turns & (squared * squared * magnitude(b) > limit * V(far));
    if (any_lane(is_far)) {
      along =
          select_lanes(is_far, end * slide - limit * (slide - limit * tip.template log_of_turn<T>()), along);
      if constexpr (all)
        aside = select_lanes(is_far, end_aside * slide - (limit * limit) * tip.template angle<T>(), aside);
    }
    turned.work = select_lanes(turns, end * slide - along, turned.work);
    turned.missing_along = select_lanes(turns, along, none);
    turned.missing_aside = select_lanes(turns, aside, none);
  }

  /// Finds the tips that slide in the step, where each begins and at which limit. `static_reach`: greatest
  /// |z| at which a tip that has stuck goes on sticking.
  [[gnu::always_inline]] LaneStart<V, Which> start_of(const SlideStart<V>& start, V bent2, V full, V kinetic,
                                                      Which goes_on, V static_reach, V age) const {
    LaneStart<V, Which> onset;
    onset.limit = kinetic;
    onset.start_limit = static_reach;
    // Lets a tip at its limit, up to roundings, slide at once, even if the step is too short to change the
    // sum of deflection and path.
    const Which outward = (start.along >= none) & moves;
    onset.at_once = outward & (bent2 >= kinetic * kinetic * V(T(1) - 32 * eps));
    if constexpr (timed) {
      onset.at_once = onset.at_once & goes_on;
      onset.start_limit = select_lanes(goes_on, kinetic, static_reach);
      onset.path = path_to_slide<T, axes>(start, onset.start_limit);
      if (law.ageing_strength != 0.0) {
        const AgeingLaw<T, V> grows = ageing();
        const V later =
            path_to_slide<T, axes>(start, full * growth<T>(grows, age + grows.per_length * length));
        const Bent<V> bent{start.along, start.aside * start.aside};
        const V met = aged_path<T, axes>(grows, bent, none, full, age, later, (later < length) & !goes_on);
        onset.path = select_lanes(goes_on, onset.path, met);
        const V reached = start.along + onset.path;
        onset.start_limit =
            select_lanes(goes_on, kinetic, root(reached * reached + start.aside * start.aside));
      }
      onset.path = least(select_lanes(onset.at_once, none, onset.path), length);
      onset.slides = onset.path < length;
      return onset;
    }
    const V ahead = start.along + length;
    onset.slides = onset.at_once | (ahead * ahead + start.aside * start.aside > kinetic * kinetic);
    onset.path = select_lanes(onset.slides, none, length);
    const Which sticks = (onset.slides & !onset.at_once);
    if (any_lane(sticks))
      onset.path = select_lanes(sticks, least(path_to_slide<T, axes>(start, kinetic), length), onset.path);
    return onset;
  }

  [[gnu::always_inline]] void add_integrals(V weight, const LaneStart<V, Which>& onset, V gain, V aside,
                                            const Turn& turned) {
    const V half(T(0.5));
    const V along = (gain - half * onset.path) * onset.path + turned.missing_along;
    const V across = aside * onset.path + turned.missing_aside;
    add(sum_missing_x, weight * (axes == 2 ? along * ex + across * ey : along * ex));
    if constexpr (axes == 2) add(sum_missing_y, weight * (along * ey - across * ex));
    V work = turned.work;
    if constexpr (timed)
      work = work + half * select_lanes(onset.slides,
                                        (onset.start_limit - onset.limit) * (onset.start_limit + onset.limit),
                                        none);
    add(sum_lost, weight * work);
    add(sum_slid, select_lanes(onset.slides, V(T(1)), none));
  }

  [[gnu::always_inline]] Which named() const { return get(motion.named) > none; }
  /// Returns the force that the spring stores after its tip has moved by `moved`.
  [[gnu::always_inline]] V stored_after(V before, V moved, Which slides) const {
    V change = moved * unit;
    if (motion.creeps)
      change =
          change + select_lanes(moves & (length < V(T(creep))), spacing<T>(before) * get(motion.phase), none);
    return before + select_lanes(slides, change, none);
  }

  // The functions below are for limits that change with time. A tip that slides bears only the kinetic limit;
  // a tip that has stuck bears more, the longer it has stuck.

  [[gnu::always_inline]] AgeingLaw<T, V> ageing() const {
    return {static_cast<T>(law.ageing_strength), get(motion.per_length), law.ageing_form == 1};
  }
  /// Computes how long each tip has stuck at the start of the step, in ageing times. Sets `goes_on` for tips
  /// that were sliding at the end of the last step.
  [[gnu::always_inline]] void find_age(std::uint32_t i, V& age, Which& goes_on) const {
    alignas(64) T ages[E::size], stuck[E::size];
    for (std::uint32_t k = 0; k < E::size; ++k) {
      const double start = input.start[first + k];
      const double since = since_of(i, first + k);
      ages[k] = static_cast<T>(least(most((start - since) * law.ageing_rate, 0.0), oldest));
      stuck[k] = since < start - 0x1p-51 * (start + input.duration) ? T(1) : T(0);
    }
    age = E::get(ages);
    goes_on = E::get(stuck) == none;
  }
  /// Returns the time at which a spring last slid. For a new contact this is just long enough ago for the
  /// spring to count as sticking.
  [[gnu::always_inline]] double since_of(std::uint32_t i, std::uint32_t lane) const {
    if (columns.state->stiffness.lane[lane] > 0.0) return columns.since[i].lane[lane];
    return input.start[lane] - 0x1p-49 * input.start[lane] - 1e-12;
  }
  [[gnu::always_inline]] void note_time(std::uint32_t i, Which goes_on, Which taken_back) const {
    alignas(64) T slid_on[E::size], taken[E::size];
    E::put(slid_on, select_lanes(goes_on, V(T(1)), none));
    E::put(taken, select_lanes(taken_back, V(T(1)), none));
    for (std::uint32_t k = 0; k < E::size; ++k) {
      if ((input.named >> (first + k) & 1u) == 0) continue;
      double& since = columns.since[i].lane[first + k];
      since = since_of(i, first + k);
      if (taken[k] != T(0)) since = input.start[first + k];
      if (slid_on[k] != T(0)) since = input.start[first + k] + input.duration;
    }
  }
};

/// Steps those contacts of a block that the step names, from motions to forces and state.
template <class T, int axes, bool all, bool timed>
void slide_lanes(const SlideLaw<T>& law, const SlideColumns<T>& columns, const LaneInput& in,
                 const LaneOutput& out) {
  using E = Engine<T>;
  LaneMotion<T> motion(law, *columns.state, in, axes);
  LanePieces pieces;
  const auto run = [&](const LaneInput& input, std::uint32_t lanes, LaneSums<T>& sums) {
    for (std::uint32_t first = 0; first < lane_count; first += E::size)
      if ((lanes >> first & ((1u << E::size) - 1)) != 0)
        LaneSlider<E, T, axes, all, timed>::run(law, columns, input, motion, first, sums);
  };
  if (motion.any_softens) soften_lanes<T, axes, all>(law, columns, in, motion, pieces, run);
  LaneSums<T> sums;
  if (!motion.all_named) sums = {};
  run(in, in.named, sums);
  finish_lanes<T, axes, all>(law, columns, in, out, motion, pieces, sums);
}

}  // namespace
}  // namespace bristle::detail
