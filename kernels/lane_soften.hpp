// The path of a contact in a lane whose load has fallen. The contact stays stiffer than its load until
// sliding softens it, so its springs move by a longer path than the displacement (core/MODEL.md, section 30).
// A step finds this path by trials.
#pragma once

#include "lane_motion.hpp"

namespace bristle::detail {
namespace {

/// Path (`path`) of a contact that sliding softens, at the start of the last piece of a step. `ease` is the
/// stiffness that belongs to the load over the contact's stiffness. It grows towards 1 as sliding dissipates
/// (core/MODEL.md, section 30), so the path exceeds the displacement by less and less. Springs depend on the
/// path alone.
struct LanePiece {
  bool cut = false;    ///< whether the step has pieces; if not, its first ease applies throughout
  double path = 0.0;   ///< path from the start of the step, scaled lengths
  double moved = 0.0;  ///< displacement so far, scaled lengths
  double ease = 1.0;
  double squares = 0.0, work = 0.0;  ///< sum_squares_end, sum_work
  double integral[2] = {0.0, 0.0};   ///< LaneSums::integral
  double impulse[2] = {0.0, 0.0};    ///< integral of the deflection over the displacement

  /// Returns the ease (stiffness for the load over the contact's stiffness) at the end of a piece, at most 1.
  /// It conserves energy: half the change of ease x the mean of `squares` equals the mean ease x
  /// `least_lost`, the least energy that sliding dissipates.
  double ease_after(double squares_after, double least_lost) const {
    const double mean = 0.5 * (squares + squares_after);
    if (!(least_lost > 0.0)) return ease;
    return mean > least_lost ? least(ease * ((mean + least_lost) / (mean - least_lost)), 1.0) : 1.0;
  }
};

/// Contacts that sliding softens in a step, with the pieces into which their paths are cut.
struct LanePieces {
  LanePiece of[lane_count];
  bool any_cut = false;
  // Numbers at the end of the step, of contacts whose path has pieces:
  Lane16<double> cut;        ///< 1 for a contact with pieces, else 0
  Lane16<double> stiffness;  ///< N per scaled length
  Lane16<double> mean[2];    ///< mean force of the springs, N
};

/// Length of a piece of the path, scaled, and the largest number of pieces; the remainder of a longer step
/// is one more piece.
constexpr double soft_piece = 0.125;
constexpr int most_soft_pieces = 128;
/// Largest excess of the path over the displacement, path x (1 - ease), for which a step is taken as one
/// piece. The error of the path is then below this length.
constexpr double least_cut = 0x1p-7;

/// Computes stiffness and mean force of contacts whose path has pieces, from the last piece.
template <class T>
void finish_pieces(const SlideLaw<T>& law, const LaneMotion<T>& m, const LaneSums<T>& sums, bool all,
                   LanePieces& pieces) {
  for (std::uint32_t i = 0; i < lane_count; ++i) {
    const LanePiece& last = pieces.of[i];
    pieces.cut.lane[i] = last.cut ? 1.0 : 0.0;
    if (!last.cut) continue;
    const double path = m.scaled_path.lane[i], used = m.used.lane[i], squares = sums.at(sum_squares_end, i);
    const double force[2] = {sums.force(law, m, 0, i), sums.force(law, m, 1, i)};
    const double beyond = most(path - longest_slide, 0.0) / used *
                          (force[0] * m.direction[0].lane[i] + force[1] * m.direction[1].lane[i]);
    const double freed = law.least_loss * (sums.at(sum_work, i) + beyond - last.work);
    // Takes the mean ease of the last piece from its displacement, and the ease at its end from the energy.
    const double mean_ease = (m.moved.lane[i] - last.moved) / (path - last.path);
    const double energy = last.squares * last.ease + mean_ease * (squares - last.squares + 2.0 * freed);
    pieces.stiffness.lane[i] = used / (squares > 0.0 ? least(energy / squares, 1.0) : last.ease);
    for (int axis = 0; axis < 2 && all; ++axis) {
      const double more = sums.integral(law, m, axis, i) - last.integral[axis];
      pieces.mean[axis].lane[i] = (last.impulse[axis] + mean_ease * more) / m.moved.lane[i] * used;
    }
  }
}

/// Finds the paths of contacts that sliding softens, by trial steps from the start to the ends of pieces.
/// Sets the paths in `motion`, and the start of each contact's last piece in `pieces`. run(input, lanes,
/// sums) steps the springs of some contacts.
template <class T, int axes, bool all, class Run>
void soften_lanes(const SlideLaw<T>& law, const SlideColumns<T>& columns, const LaneInput& in,
                  LaneMotion<T>& motion, LanePieces& pieces, const Run& run) {
  std::uint32_t open = 0;
  for (std::uint32_t i = 0; i < lane_count; ++i) {
    LanePiece& at = pieces.of[i];
    const double load = motion.of_load.lane[i];
    if (!(motion.stiffness.lane[i] > load && load > 0.0)) continue;
    at.ease = load / motion.stiffness.lane[i];
    at.cut = (in.named >> i & 1u) != 0 && motion.scaled_path.lane[i] * (1.0 - at.ease) > least_cut;
    if (at.cut) open |= 1u << i;
  }
  pieces.any_cut = open != 0;
  if (open == 0) return;
  LaneInput trial = in;
  trial.stores = false;
  motion.widen_direction();
  LaneSums<T> sums{};
  double step[lane_count] = {};
  const auto set_path = [&motion](std::uint32_t i, double path) {
    motion.scaled_path.lane[i] = path;
    for (int axis = 0; axis < axes; ++axis)
      motion.gain[axis].lane[i] = motion.used.lane[i] * path * motion.direction[axis].lane[i];
  };
  for (int n = 0; n <= most_soft_pieces && open != 0; ++n) {
    for (std::uint32_t i = 0; i < lane_count; ++i) {
      if ((open >> i & 1u) == 0) continue;
      const LanePiece& at = pieces.of[i];
      step[i] = n == 0 ? 0.0 : least(soft_piece, (motion.moved.lane[i] - at.moved) / at.ease);
      set_path(i, at.path + step[i]);
    }
    motion.update_base(*columns.state);
    run(trial, open, sums);
    for (std::uint32_t i = 0; i < lane_count; ++i) {
      if ((open >> i & 1u) == 0) continue;
      LanePiece& at = pieces.of[i];
      const double squares = sums.at(sum_squares_end, i), work = sums.at(sum_work, i);
      const double ease = n == 0 ? at.ease : at.ease_after(squares, law.least_loss * (work - at.work));
      const double mean_ease = 0.5 * (at.ease + ease), left = motion.moved.lane[i] - at.moved;
      double last = 0.0;  // path of the last piece
      if (mean_ease * step[i] >= left * (1.0 - 1e-12)) {
        // Takes the displacement as quadratic in the path, because the ease grows in proportion to the path
        // within a piece.
        const double grown = (ease - at.ease) / step[i];
        last = 2.0 * left / (at.ease + root(at.ease * at.ease + 2.0 * grown * left));
      } else {
        for (int axis = 0; axis < axes && all; ++axis) {
          const double integral = sums.integral(law, motion, axis, i);
          at.impulse[axis] += mean_ease * (integral - at.integral[axis]);
          at.integral[axis] = integral;
        }
        at.path += step[i];
        at.moved += mean_ease * step[i];
        at.ease = ease;
        at.squares = squares;
        at.work = work;
        if (ease < 1.0 && n < most_soft_pieces) continue;
        last = motion.moved.lane[i] - at.moved;
      }
      open &= ~(1u << i);
      set_path(i, at.path + last);
    }
  }
  motion.update_base(*columns.state);
}

}  // namespace
}  // namespace bristle::detail
