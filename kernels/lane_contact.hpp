// Parts of a step of sixteen contacts in lanes that are computed once for each contact. Before its springs
// (lane_slide.hpp): directions, scales and the place of `base`. After them: forces, energies and state. In
// between: the path (`way`) of a contact that sliding softens.
#pragma once

#include "ageing.hpp"
#include "core/lane_table.hpp"
#include "engine.hpp"

namespace bristle::detail {
namespace {

/// Longest step, scaled, that is computed directly. After it every spring lies along the motion.
constexpr double longest_slide = 1048576.0;  // 2^20

/// Force of `base`, in scaled lengths, above which all springs are written and `base` becomes 0.
constexpr double farthest_base = 0.25;

/// Numbers of the contacts in a step, computed in double. Columns of T are read by the springs.
template <class T>
struct LaneMotion {
  alignas(64) T ex[lane_count], ey[lane_count], length[lane_count], base_x[lane_count], base_y[lane_count],
      base_after_x[lane_count], base_after_y[lane_count];
  alignas(64) T per_unit[lane_count], unit[lane_count], rebases[lane_count], phase[lane_count];
  alignas(64) T named[lane_count], softens[lane_count];
  alignas(64) T per_length[lane_count];  ///< age that a spring gains per length of path, in ageing times
  bool any_softens = false;
  alignas(64) double direction[2][lane_count], base_after[2][lane_count];
  alignas(64) double way[lane_count];    ///< length of the step's path in scaled lengths at the present load,
                                         ///< for the contact's stiffness
  alignas(64) double moved[lane_count];  ///< as `way`, for the stiffness that belongs to the load
  alignas(64) double stiffness[lane_count];  ///< stiffness before sliding softens the contact, N per scaled
                                             ///< length
  alignas(64) double of_load[lane_count];    ///< stiffness that belongs to the load; 0 = no contact
  alignas(64) double used[lane_count];       ///< force of one scaled length of deflection in this step, N

  LaneMotion(const SlideLaw<T>& law, const LaneState& state, const LaneInput& in, int axes) {
    constexpr double least_stiffness = sizeof(T) == 4 ? 1e-36 : 1e-290;
    constexpr double longest = 1e150;  // longest displacement whose square stays finite
    for (std::uint32_t i = 0; i < lane_count; ++i) {
      const double dx = in.displacement[0][i], dy = axes == 2 ? in.displacement[1][i] : 0.0;
      const double x = least(most(law.to[0][0] * dx + law.to[0][1] * dy, -longest), longest);
      const double y = least(most(law.to[1][0] * dx + law.to[1][1] * dy, -longest), longest);
      const double h = root(x * x + y * y);
      const double per = h > 0.0 ? 1.0 / most(h, 1e-300) : 0.0;
      const double asked = in.load[i] * law.stiffness_per_newton, before = state.stiffness.lane[i];
      of_load[i] = asked > least_stiffness ? asked : 0.0;
      stiffness[i] = most(of_load[i], before);
      used[i] = of_load[i] > 0.0 ? of_load[i] : before;
      const double inverse = used[i] > 0.0 ? 1.0 / most(used[i], least_stiffness) : 0.0;
      softens[i] = stiffness[i] > of_load[i] ? T(1) : T(0);
      moved[i] = h;
      direction[0][i] = h > 0.0 ? x * per : 1.0;
      direction[1][i] = y * per;
      ex[i] = static_cast<T>(direction[0][i]);
      ey[i] = static_cast<T>(direction[1][i]);
      unit[i] = static_cast<T>(used[i]);
      per_unit[i] = static_cast<T>(inverse);
      phase[i] = static_cast<T>(state.phase.lane[i] - 0.5);
      named[i] = (in.named >> i & 1u) != 0 ? T(1) : T(0);
      base_x[i] = static_cast<T>(state.base[0].lane[i] * inverse);
      base_y[i] = static_cast<T>(state.base[1].lane[i] * inverse);
      set_way(state, i, h * (stiffness[i] * inverse), stiffness[i] * x, stiffness[i] * y);
    }
    for (std::uint32_t i = 0; i < lane_count; ++i) any_softens |= softens[i] > T(0);
    if (law.ageing_strength == 0.0) return;
    for (std::uint32_t i = 0; i < lane_count; ++i) {
      const double aged = least(in.duration * law.ageing_rate, oldest);
      per_length[i] = static_cast<T>(way[i] > 0.0 ? least(aged / most(way[i], 1e-300), oldest) : 0.0);
    }
  }

  /// Sets the path of contact i, on which a spring that sticks gains the force `gain`, N.
  void set_way(const LaneState& state, std::uint32_t i, double the_way, double gain_x, double gain_y) {
    way[i] = the_way;
    length[i] = static_cast<T>(least(the_way, longest_slide));
    const double inverse = used[i] > 0.0 ? 1.0 / used[i] : 0.0;
    const double after[2] = {state.base[0].lane[i] + gain_x, state.base[1].lane[i] + gain_y};
    const double ax = after[0] * inverse, ay = after[1] * inverse;
    const bool far = ax * ax + ay * ay > farthest_base * farthest_base;
    rebases[i] = far ? T(1) : T(0);
    for (int axis = 0; axis < 2; ++axis) base_after[axis][i] = far ? 0.0 : after[axis];
    base_after_x[i] = static_cast<T>(base_after[0][i]);
    base_after_y[i] = static_cast<T>(base_after[1][i]);
  }
};

/// Sums of weight x a quantity over the springs of a contact, in scaled lengths. Steps that ask for force and
/// stiffness alone fill only those before lane_sums_of_end.
enum LaneSum : std::uint32_t {
  sum_end_x,
  sum_end_y,
  sum_work,         ///< work done by sliding, drops not included
  sum_squares_end,  ///< squared deflection at the end, after the change of load and before it
  lane_sums_of_end,
  sum_squares_start = lane_sums_of_end,
  sum_squares_before,
  sum_integral_x,  ///< integral of the deflection along the path of the step
  sum_integral_y,
  sum_lost,  ///< energy that sliding dissipates
  sum_slid,  ///< number of springs that slid
  lane_sums
};
template <class T>
struct LaneSums {
  alignas(64) T of[lane_sums][lane_count];
};

/// Path (`way`) of a contact that sliding softens, at the start of the last piece of a step. `ease` is the
/// stiffness that belongs to the load over the contact's stiffness. It grows towards 1 as sliding dissipates
/// (core/MODEL.md, section 30), so the path exceeds the displacement by less and less. Springs depend on the
/// path alone.
struct LanePiece {
  bool cut = false;    ///< whether the step has pieces; if not, the ease at its start holds throughout
  double way = 0.0;    ///< path from the start of the step, scaled lengths
  double moved = 0.0;  ///< displacement so far, scaled lengths
  double ease = 1.0;
  double squares = 0.0, work = 0.0;  ///< sum_squares_end, sum_work
  double integral[2] = {0.0, 0.0};   ///< sum_integral_x, _y
  double impulse[2] = {0.0, 0.0};    ///< integral of the deflection over the displacement

  /// Returns the ease at the end of a piece that conserves energy: half the change of ease x `squares` equals
  /// the mean ease x the least energy that sliding dissipates.
  double ease_after(double squares_after, double least_lost) const {
    const double mean = 0.5 * (squares + squares_after);
    if (!(least_lost > 0.0)) return ease;
    return mean > least_lost ? least(ease * ((mean + least_lost) / (mean - least_lost)), 1.0) : 1.0;
  }
};

/// Length of a piece of path, scaled, and largest number of pieces of a step, after which the rest is one
/// piece.
constexpr double soft_piece = 0.125;
constexpr int most_soft_pieces = 128;
/// Path x (1 - ease) up to which a step is one piece. The path is then too long by less than this length.
constexpr double least_cut = 0x1p-7;

/// Makes the springs of a contact that has lost its load straight.
template <class T>
void straighten_lane(const SlideLaw<T>& law, const SlideColumns<T>& columns, std::uint32_t lane) {
  for (std::uint32_t i = 0; i < law.springs; ++i) {
    columns.x[i].lane[lane] = T(0);
    if (columns.y != nullptr) columns.y[i].lane[lane] = T(0);
  }
  for (LaneColumn<double>& base : columns.state->base) base.lane[lane] = 0.0;
}

/// Writes forces and energies of the contacts, and the state that belongs to no single spring.
template <class T>
void finish_lanes(const SlideLaw<T>& law, const SlideColumns<T>& columns, const LaneInput& in,
                  const LaneOutput& out, const LaneMotion<T>& m, const LanePiece (&pieces)[lane_count],
                  const LaneSums<T>& sums, int axes, bool all) {
  LaneState& state = *columns.state;
  const double shift = law.lean * law.mean_limit, lengths_per_metre = 1.0 / law.metres_per_length;
  for (std::uint32_t i = 0; i < lane_count; ++i) {
    const double load = m.of_load[i], k = m.stiffness[i], before = state.stiffness.lane[i];
    const auto sum = [&](LaneSum of) { return static_cast<double>(sums.of[of][i]); };
    const double end[2] = {sum(sum_end_x), sum(sum_end_y)};
    // Softens a contact that is stiffer than its load, at unchanged forces, by the least energy that sliding
    // dissipates.
    const double squares = sum(sum_squares_end);
    // Adds the path beyond the length that was computed, on which every spring slides along the motion.
    const double way = m.way[i], more = way > longest_slide ? way - longest_slide : 0.0;
    const double beyond = more * (end[0] * m.direction[0][i] + end[1] * m.direction[1][i]);
    const LanePiece& last = pieces[i];
    const double freed = law.least_loss * (sum(sum_work) + beyond - last.work);
    double soft = k, mean_ease = 1.0;
    if (last.cut) {
      // Takes the mean ease of the last piece from its displacement, and the ease at its end from the energy.
      mean_ease = (m.moved[i] - last.moved) / (way - last.way);
      const double energy = last.squares * last.ease + mean_ease * (squares - last.squares + 2.0 * freed);
      soft = m.used[i] / (squares > 0.0 ? least(energy / squares, 1.0) : last.ease);
    } else if (m.any_softens && k > load && freed > 0.0 && squares > 0.0) {
      soft = k * (squares / (squares + 2.0 * freed));
    }
    if (soft <= load * (1.0 + 1e-9)) soft = load;
    if (load == 0.0) soft = 0.0;
    // Turns forces to those on the body; subtracts from 0, so that a straight contact gives +0.
    const double force = load == 0.0 ? 0.0 : m.used[i];
    const auto write = [&](double* const(&to)[2], double along, double across) {
      along = (along + shift) * force;
      across = across * force;
      to[0][i] = 0.0 - (law.from[0][0] * along + law.from[0][1] * across);
      if (axes == 2) to[1][i] = 0.0 - (law.from[1][0] * along + law.from[1][1] * across);
    };
    write(out.end, end[0], end[1]);
    out.stiffness[i] = soft * lengths_per_metre;
    if (all) {
      double mean[2] = {end[0], end[1]};
      double lost = sum(sum_lost);
      if (m.length[i] > T(0)) {
        mean[0] = (sum(sum_integral_x) + more * end[0]) / way;
        mean[1] = (sum(sum_integral_y) + more * end[1]) / way;
        lost += beyond;
        for (int axis = 0; axis < 2 && last.cut; ++axis)
          mean[axis] =
              (last.impulse[axis] + mean_ease * (way * mean[axis] - last.integral[axis])) / m.moved[i];
      }
      write(out.mean, mean[0], mean[1]);
      // Computes energies as half a square times force per length: scaled forces of `used` over a stiffness.
      const double joules = m.used[i] * m.used[i] * law.metres_per_length;
      const double of_k = k > 0.0 ? joules / k : 0.0;
      const double stored = 0.5 * squares * (soft > 0.0 ? joules / soft : 0.0);
      const double start = load == 0.0 ? 0.0 : 0.5 * sum(sum_squares_start) * of_k;
      out.contact_loss[i] = 0.5 * sum(sum_squares_before) * (before > 0.0 ? joules / before : 0.0) - start;
      double dissipated = lost * of_k - (stored - 0.5 * squares * of_k);
      if (law.energy != 1.0 || law.lean != 0.0 || last.cut) {
        const double work = (mean[0] + shift) * m.direction[0][i] + law.energy * mean[1] * m.direction[1][i];
        dissipated =
            work * (last.cut ? m.moved[i] * m.used[i] * law.metres_per_length : way * of_k) + start - stored;
      }
      out.dissipated[i] = load == 0.0 ? 0.0 : least(most(dissipated, 0.0), 1e300);
      out.slid[i] = sum(sum_slid);
    }
    if (!in.stores || (in.named >> i & 1u) == 0) continue;
    state.stiffness.lane[i] = soft;
    for (int axis = 0; axis < axes; ++axis) state.base[axis].lane[i] = m.base_after[axis][i];
    if (m.way[i] > 0.0) {
      const double next = state.phase.lane[i] + 0.6180339887498949;
      state.phase.lane[i] = next < 1.0 ? next : next - 1.0;
    }
    if (load == 0.0) straighten_lane(law, columns, i);
  }
}

}  // namespace
}  // namespace bristle::detail
