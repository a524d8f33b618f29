// A step of sixteen contacts whose springs slide at their limit (SnapRule::slide), one contact in each lane
// (core/MODEL.md, section 30, has the formulas). One source for vectors and for plain numbers.
//
// A spring's state is its force, so a load that rises at rest changes only the stiffness and the limits.
// Within a step forces are divided by the stiffness that belongs to the present load. In these units, scaled
// lengths, a spring slides at its limit l under every load, and a contact that is stiffer than its load
// (after a fall) moves by a longer path. A spring that sticks is not written: its force grows with `base`,
// which is in double. A slide adds the path of the tip to a stored force, never the difference of two forces,
// and its rounding is spread evenly. Therefore slow sliding turns and dissipates as it should.
#pragma once

#include <limits>

#include "lane_contact.hpp"
#include "slide.hpp"

namespace bristle::detail {
namespace {

/// Path per step, scaled, below which the rounding of stored forces is spread.
constexpr double creep = 0x1p-6;

/// Part of a step in which a spring's tip sticks, and the lengths at which it slides then.
template <class V, class Which>
struct LaneStart {
  Which slides;
  V path;   ///< path over which the tip sticks
  V holds;  ///< |z| at which the tip begins to slide
  V limit;  ///< |z| at which the tip slides
};

/// A step of one vector of contacts, lanes from `first` on.
template <class E, class T, int axes, bool all, bool timed>
class LaneSlider {
  using V = typename E::V;
  using Which = decltype(V() < V());

 public:
  LaneSlider(const SlideLaw<T>& the_law, const SlideColumns<T>& the_columns, const LaneInput& the_input,
             const LaneMotion<T>& the_motion, std::uint32_t the_first)
      : law(the_law),
        columns(the_columns),
        input(the_input),
        motion(the_motion),
        first(the_first),
        ex(E::get(motion.ex + first)),
        ey(E::get(motion.ey + first)),
        length(E::get(motion.length + first)),
        base_x(E::get(motion.base_x + first)),
        base_y(E::get(motion.base_y + first)),
        per_unit(E::get(motion.per_unit + first)),
        unit(E::get(motion.unit + first)),
        phase(E::get(motion.phase + first)),
        named(E::get(motion.named + first) > V(T(0))),
        rebases(E::get(motion.rebases + first) > V(T(0))),
        per_kinetic(T(1) / static_cast<T>(law.kinetic * (1.0 - 6 * eps))),
        softens(all || any_lane(E::get(motion.softens + first) > V(T(0)))),
        creeps(sizeof(T) == 4 && any_lane((length > V(T(0))) & (length < V(T(creep))))) {}

  void run(LaneSums<T>& sums) {
    // Sums over sixteen springs at a time, then over these sums, which loses fewer digits.
    V total[count];
    for (V& x : total) x = none;
    for (std::uint32_t i = 0; i < law.springs;) {
      for (V& x : part) x = none;
      for (const std::uint32_t end = least_index(i + 16, law.springs); i < end; ++i) step(i);
      for (std::uint32_t c = 0; c < count; ++c) total[c] = total[c] + part[c];
    }
    for (std::uint32_t c = 0; c < count; ++c) E::put(sums.of[c] + first, total[c]);
  }

 private:
  static constexpr T eps = std::numeric_limits<T>::epsilon();
  const V none = V(T(0));

  const SlideLaw<T>& law;
  const SlideColumns<T>& columns;
  const LaneInput& input;
  const LaneMotion<T>& motion;
  const std::uint32_t first;
  const V ex, ey, length, base_x, base_y, per_unit, unit, phase;
  const Which named, rebases;
  const T per_kinetic;
  const bool softens, creeps;
  static constexpr std::uint32_t count = all ? lane_sums : lane_sums_of_end;
  V part[count];

  static std::uint32_t least_index(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }
  void add(LaneSum to, V x) { part[to] = part[to] + x; }

  V square_of(V x, V y, V centre) const {
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
    const V stored_x = E::get(at_x);
    const V stored_y = axes == 2 ? E::get(at_y) : none;
    V x = stored_x * per_unit + base_x - centre;
    V y = axes == 2 ? stored_y * per_unit + base_y : none;
    if constexpr (all) add(sum_squares_before, weight * square_of(x, y, centre));

    // Lets tips beyond their limits slide, although the contact does not move, after a fall of the load has
    // lowered the limits. All springs stay within their limit by a few roundings.
    V kinetic = full * V(T(1) - 6 * eps);
    V most_held = full * V(T(1) - 2 * eps);
    V held = kinetic, age = none;
    Which goes_on = none > none;  // tips that slid up to the start of the step
    if constexpr (timed) {
      find_age(i, age, goes_on);
      const V static_limit = law.ageing_strength != 0.0 ? full * growth<T>(ageing(), age) : full;
      held = static_limit * V(T(1) - 4 * eps);
      kinetic = kinetic * V(static_cast<T>(law.kinetic));
      most_held =
          select_lanes(goes_on, full * V(static_cast<T>(law.kinetic)), static_limit) * V(T(1) - 2 * eps);
    }
    V bent2 = axes == 2 ? x * x + y * y : x * x;
    const Which beyond = bent2 > most_held * most_held;
    if (any_lane(beyond)) {
      const V keep = select_lanes(beyond, divide(kinetic, most(root(bent2), V(T(1e-30)))), V(T(1)));
      x = keep * x;
      y = keep * y;
      bent2 = select_lanes(beyond, kinetic * kinetic, bent2);
    }
    if constexpr (all) add(sum_squares_start, weight * square_of(x, y, centre));

    const SlideStart<V> start = slide_start<T, axes>(x, y, ex, ey);
    if constexpr (timed) goes_on = (goes_on | beyond) & (start.along >= none) & (length > none);
    const LaneStart<V, Which> way = start_of(start, bent2, full, kinetic, goes_on, held, age);
    // Changes of the deflection by sliding, along the motion and across it, apart from the path over which
    // the tip sticks; integrals of the deflection over the path of the slide, along and across.
    V along = none, aside = none, work = none, turned = none;
    V slide = none;
    if (any_lane(way.slides)) {
      slide = select_lanes(way.slides, length - way.path, none);
      V a = start.along + way.path, b = start.aside;  // deflection at which the tip begins to slide
      if constexpr (timed) {
        const V share = select_lanes(way.slides, divide(way.limit, most(way.holds, V(T(1e-30)))), V(T(1)));
        along = (share - V(T(1))) * a;
        aside = (share - V(T(1))) * b;
        a = share * a;
        b = share * b;
      }
      work = select_lanes(way.slides, way.limit * slide, none);
      if constexpr (axes == 2) {
        // Takes an angle up to 4 eps s / l, at most 4 eps, as 0.
        const V rounds = least(slide, way.limit) * V(4 * eps);
        const Which turns = way.slides & (b * b > rounds * rounds);
        if (any_lane(turns))
          turn(turns, a, b, slide, way.limit, V(law.per_limit[i] * per_kinetic), along, aside, work, turned);
      }
    }
    if (softens) add(sum_work, weight * work);
    const V gain = way.path + along;
    const V now_x = axes == 2 ? x + (gain * ex + aside * ey) : x + gain * ex;
    const V now_y = axes == 2 ? y + (gain * ey - aside * ex) : none;
    add(sum_end_x, weight * now_x);
    if constexpr (axes == 2) add(sum_end_y, weight * now_y);
    if (softens) add(sum_squares_end, weight * square_of(now_x, now_y, centre));
    if constexpr (all) add_integrals(weight, start, way, work, turned);
    if (!input.stores) return;
    // Computes the tip's path: `slide` less what the turn added to the deflection, backwards in these units.
    const V tip = along - slide;
    const Which rewrites = rebases | beyond;
    store(at_x, stored_x, axes == 2 ? tip * ex + aside * ey : tip * ex,
          (now_x + centre) * unit - E::get(motion.base_after_x + first), way.slides, rewrites);
    if constexpr (axes == 2)
      store(at_y, stored_y, tip * ey - aside * ex, now_y * unit - E::get(motion.base_after_y + first),
            way.slides, rewrites);
    if constexpr (timed) note_time(i, way.slides | goes_on, beyond);
  }

  /// Turns the tips that slide over the path `slide` towards the motion, from the deflection (a, b) along and
  /// across it (MODEL.md: the tangent of half the angle shrinks by the factor exp(-slide / limit)). Adds the
  /// changes of the deflection. Sets `work`, the integral of the deflection along the motion, and `turned`,
  /// that across it.
  void turn(Which turns, V a, V b, V slide, V limit, V per_limit, V& along, V& aside, V& work,
            V& turned) const {
    const Tractrix<V> tip(b, most(limit + a, V(T(1e-30))), decay<T>(slide * per_limit));
    along = along + select_lanes(turns, tip.template gained_along<T>(), none);
    aside = aside - select_lanes(turns, tip.lost_aside(), none);
    if (all || softens)
      work = select_lanes(turns, limit * (slide - limit * tip.template log_of_turn<T>()), work);
    if constexpr (all) turned = select_lanes(turns, (limit * limit) * tip.template angle<T>(), none);
  }

  /// Finds which tips slide in the step, from which deflection, and at which limit. `held`: largest |z| at
  /// which a tip that has stuck stays.
  LaneStart<V, Which> start_of(const SlideStart<V>& start, V bent2, V full, V kinetic, Which goes_on, V held,
                               V age) const {
    LaneStart<V, Which> way;
    way.limit = kinetic;
    way.holds = held;
    // Lets a tip that is at its limit, within rounding, slide at once, also where the path is too short to be
    // seen in the sum of deflection and path.
    const Which outward = (start.along >= none) & (length > none);
    Which at_once = outward & (bent2 >= kinetic * kinetic * V(T(1) - 32 * eps));
    if constexpr (timed) {
      at_once = at_once & goes_on;
      way.holds = select_lanes(goes_on, kinetic, held);
      way.path = way_to_slide<T, axes>(start, way.holds);
      if (law.ageing_strength != 0.0) {
        const AgeingLaw<T, V> grows = ageing();
        const V later =
            way_to_slide<T, axes>(start, full * growth<T>(grows, age + grows.per_length * length));
        const Bent<V> bent{start.along, start.aside * start.aside};
        const V met = aged_way<T, axes>(grows, bent, none, full, age, later, (later < length) & !goes_on);
        way.path = select_lanes(goes_on, way.path, met);
        const V reached = start.along + way.path;
        way.holds = select_lanes(goes_on, kinetic, root(reached * reached + start.aside * start.aside));
      }
      way.path = least(select_lanes(at_once, none, way.path), length);
      way.slides = way.path < length;
      return way;
    }
    const V ahead = start.along + length;
    way.slides = at_once | (ahead * ahead + start.aside * start.aside > kinetic * kinetic);
    way.path = select_lanes(way.slides, none, length);
    const Which sticks = (way.slides & !at_once);
    if (any_lane(sticks))
      way.path = select_lanes(sticks, least(way_to_slide<T, axes>(start, kinetic), length), way.path);
    return way;
  }

  void add_integrals(V weight, const SlideStart<V>& start, const LaneStart<V, Which>& way, V work, V turned) {
    const V half(T(0.5));
    const V stuck = half * way.path * way.path + work;
    add(sum_integral_x, weight * (start.x * way.path + stuck * ex + turned * ey));
    if constexpr (axes == 2) add(sum_integral_y, weight * (start.y * way.path + (stuck * ey - turned * ex)));
    if constexpr (timed)
      work = work + half * select_lanes(way.slides, (way.holds - way.limit) * (way.holds + way.limit), none);
    add(sum_lost, weight * work);
    add(sum_slid, select_lanes(way.slides, V(T(1)), none));
  }

  /// Writes the stored force of a spring: `now` if it `rewrites`, else `before` plus what sliding
  /// changed.
  void store(T* at, V before, V moved, V now, Which slides, Which rewrites) const {
    V change = moved * unit;
    if (creeps)
      change =
          change + select_lanes((length > none) & (length < V(T(creep))), spacing<T>(before) * phase, none);
    V after = select_lanes(slides, before + change, before);
    after = select_lanes(rewrites, now, after);
    E::put(at, select_lanes(named, after, before));
  }

  // --- Limits that change with time: a tip that slides holds only the kinetic limit, one that has stuck
  // holds more the longer it has.

  AgeingLaw<T, V> ageing() const {
    return {static_cast<T>(law.ageing_strength), E::get(motion.per_length + first), law.ageing_form == 1};
  }
  /// Finds ages at the start of the step, in ageing times; sets `goes_on` for tips that slid up to it.
  void find_age(std::uint32_t i, V& age, Which& goes_on) const {
    alignas(64) T ages[E::size], held[E::size];
    for (std::uint32_t k = 0; k < E::size; ++k) {
      const double start = input.start[first + k];
      const double since = since_of(i, first + k);
      ages[k] = static_cast<T>(least(most((start - since) * law.ageing_rate, 0.0), oldest));
      held[k] = since < start - 0x1p-51 * (start + input.duration) ? T(1) : T(0);
    }
    age = E::get(ages);
    goes_on = E::get(held) == none;
  }
  /// Returns the end of a spring's last slide; for a new contact a time just long enough ago for it to have
  /// stuck.
  double since_of(std::uint32_t i, std::uint32_t lane) const {
    if (columns.state->stiffness.lane[lane] > 0.0) return columns.since[i].lane[lane];
    return input.start[lane] - 0x1p-49 * input.start[lane] - 1e-12;
  }
  void note_time(std::uint32_t i, Which goes_on, Which taken_back) const {
    alignas(64) T slid_on[E::size], taken[E::size];
    E::put(slid_on, select_lanes(named & goes_on, V(T(1)), none));
    E::put(taken, select_lanes(named & taken_back, V(T(1)), none));
    for (std::uint32_t k = 0; k < E::size; ++k) {
      if ((input.named >> (first + k) & 1u) == 0) continue;
      double& since = columns.since[i].lane[first + k];
      since = since_of(i, first + k);
      if (taken[k] != T(0)) since = input.start[first + k];
      if (slid_on[k] != T(0)) since = input.start[first + k] + input.duration;
    }
  }
};

/// Finds the paths of contacts that sliding softens in a step, by trials from its start to the ends of
/// pieces. Sets them in `motion`, and the start of each contact's last piece in `pieces`.
template <class T, int axes, bool all, bool timed>
void soften_lanes(const SlideLaw<T>& law, const SlideColumns<T>& columns, const LaneInput& in,
                  LaneMotion<T>& motion, LanePiece (&pieces)[lane_count]) {
  using E = Engine<T>;
  LaneInput trial = in;
  trial.stores = false;
  std::uint32_t open = 0;
  for (std::uint32_t i = 0; i < lane_count; ++i) {
    LanePiece& at = pieces[i];
    if (!(motion.stiffness[i] > motion.of_load[i] && motion.of_load[i] > 0.0)) continue;
    at.ease = motion.used[i] / motion.stiffness[i];
    at.cut = (in.named >> i & 1u) != 0 && motion.way[i] * (1.0 - at.ease) > least_cut;
    if (at.cut) open |= 1u << i;
  }
  LaneSums<T> sums{};
  double step[lane_count] = {};
  for (int n = 0; n <= most_soft_pieces && open != 0; ++n) {
    for (std::uint32_t i = 0; i < lane_count; ++i) {
      if ((open >> i & 1u) == 0) continue;
      const LanePiece& at = pieces[i];
      step[i] = n == 0 ? 0.0 : least(soft_piece, (motion.moved[i] - at.moved) / at.ease);
      motion.length[i] = static_cast<T>(at.way + step[i]);
    }
    for (std::uint32_t first = 0; first < lane_count; first += E::size)
      if ((open >> first & ((1u << E::size) - 1)) != 0)
        LaneSlider<E, T, axes, all, timed>(law, columns, trial, motion, first).run(sums);
    for (std::uint32_t i = 0; i < lane_count; ++i) {
      if ((open >> i & 1u) == 0) continue;
      LanePiece& at = pieces[i];
      const auto sum = [&](LaneSum of) { return static_cast<double>(sums.of[of][i]); };
      const double ease =
          n == 0 ? at.ease : at.ease_after(sum(sum_squares_end), law.least_loss * (sum(sum_work) - at.work));
      const double mean_ease = 0.5 * (at.ease + ease), left = motion.moved[i] - at.moved;
      double last = 0.0;  // path of the last piece
      if (mean_ease * step[i] >= left * (1.0 - 1e-12)) {
        // Takes the displacement as quadratic, because the ease grows in proportion to the path within a
        // piece.
        const double grown = (ease - at.ease) / step[i];
        last = 2.0 * left / (at.ease + root(at.ease * at.ease + 2.0 * grown * left));
      } else {
        for (int axis = 0; axis < axes && all; ++axis) {
          const double integral = sum(axis == 0 ? sum_integral_x : sum_integral_y);
          at.impulse[axis] += mean_ease * (integral - at.integral[axis]);
          at.integral[axis] = integral;
        }
        at.way += step[i];
        at.moved += mean_ease * step[i];
        at.ease = ease;
        at.squares = sum(sum_squares_end);
        at.work = sum(sum_work);
        if (ease < 1.0 && n < most_soft_pieces) continue;
        last = motion.moved[i] - at.moved;
      }
      open &= ~(1u << i);
      const double way = at.way + last, gain = motion.used[i] * way;
      motion.set_way(*columns.state, i, way, gain * motion.direction[0][i], gain * motion.direction[1][i]);
    }
  }
}

/// Steps the named contacts of a block.
template <class T, int axes, bool all, bool timed>
void slide_lanes(const SlideLaw<T>& law, const SlideColumns<T>& columns, const LaneInput& in,
                 const LaneOutput& out) {
  using E = Engine<T>;
  LaneMotion<T> motion(law, *columns.state, in, axes);
  LanePiece pieces[lane_count];
  if (motion.any_softens) soften_lanes<T, axes, all, timed>(law, columns, in, motion, pieces);
  LaneSums<T> sums{};
  for (std::uint32_t first = 0; first < lane_count; first += E::size) {
    const std::uint32_t lanes = (1u << E::size) - 1;
    if ((in.named >> first & lanes) != 0)
      LaneSlider<E, T, axes, all, timed>(law, columns, in, motion, first).run(sums);
  }
  finish_lanes<T>(law, columns, in, out, motion, pieces, sums, axes, all);
}

}  // namespace
}  // namespace bristle::detail
