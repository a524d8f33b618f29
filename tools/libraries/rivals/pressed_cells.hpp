// A contact area that is cut into a grid of cells, and force and torque of the friction on it, for those
// rivals of the bristle model whose contact has an extent.
#pragma once

#include <cstddef>
#include <vector>

#include "tools/libraries/rivals/pair.hpp"

namespace rivals {

enum class Pressure { uniform, hertz };

/// Positions of the cells from the centre, m, and their shares of the load, which sum to one.
struct PressedCells {
  std::vector<double> x, y, share;

  std::size_t size() const noexcept { return x.size(); }
};

/// Cuts a disc into squares, `across` along a diameter, and keeps those whose centre lies in the disc. Their
/// shares of the load follow the pressure at their centres. Throws std::invalid_argument unless across >= 1
/// and radius > 0.
PressedCells disc_cells(int across, double radius_m, Pressure pressure = Pressure::uniform);

/// Force, N, and torque about the centre, N m, both acting on the moving body.
struct Wrench {
  Pair force;
  double torque = 0.0;
};

/// Force and torque at the end of the step, and averaged over it. The averages give the work of the step as
/// force . displacement + torque angle.
struct SpinForce {
  Wrench end, mean;
};

/// Turn of a body by `angle` while its centre moves straight. Gives the position of each cell in the
/// surface's axes at both ends of the step, and the arm of the cell's mean force.
class Turn {
 public:
  /// Makes the turn by `angle` (rad) of a body whose angle was `before` (rad).
  Turn(double before, double angle) noexcept
      : begin_{std::cos(before), std::sin(before)},
        end_{std::cos(before + angle), std::sin(before + angle)},
        middle_{std::cos(before + 0.5 * angle), std::sin(before + 0.5 * angle)},
        // Scales the arm to the chord along which a cell moves, so that the torque does the right work: per
        // angle it is the force times chord over angle.
        chord_(angle != 0.0 ? 2.0 * std::sin(0.5 * angle) / angle : 1.0) {}

  /// Returns how far a cell moves relative to the centre, m.
  Pair moved(double x, double y) const noexcept { return turned(end_, x, y) - turned(begin_, x, y); }
  Pair end_arm(double x, double y) const noexcept { return turned(end_, x, y); }
  Pair mean_arm(double x, double y) const noexcept { return chord_ * turned(middle_, x, y); }

 private:
  static Pair turned(Pair c, double x, double y) noexcept { return {c.x * x - c.y * y, c.y * x + c.x * y}; }

  // Cosine and sine of the body's angle at the beginning, end and middle of the step.
  Pair begin_, end_, middle_;
  double chord_;
};

constexpr double cross(Pair a, Pair b) noexcept { return a.x * b.y - a.y * b.x; }

inline void add(Wrench& wrench, Pair arm, Pair force) noexcept {
  wrench.force = wrench.force + force;
  wrench.torque += cross(arm, force);
}

}  // namespace rivals
