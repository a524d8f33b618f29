// A contact area cut into a grid of cells, and the wrench of friction that acts on it: what the rivals with
// an extent share.
#pragma once

#include <cstddef>
#include <vector>

#include "tools/rivals/pair.hpp"

namespace rivals {

enum class Pressure { uniform, hertz };

/// Where the cells are, from the centre, m, and what share of the load each carries; the shares sum to one.
struct PressedCells {
  std::vector<double> x, y, share;

  std::size_t size() const noexcept { return x.size(); }
};

/// `across` squares along a diameter; those whose centre lies in the disc count. Shares by the pressure at
/// the centre. Throws std::invalid_argument unless across >= 1 and radius > 0.
PressedCells disc_cells(int across, double radius_m, Pressure pressure = Pressure::uniform);

/// across_x times across_y equal cells under uniform pressure. Throws std::invalid_argument as above.
PressedCells rectangle_cells(int across_x, int across_y, double width_m, double height_m);

/// A force, N, and its torque about the centre, N m, both on the moving body.
struct Wrench {
  Pair force;
  double torque = 0.0;
};

/// At the end of the step, and averaged over it so that force . displacement + torque angle is the work.
struct SpinForce {
  Wrench end, mean;
};

/// A body that turns by `angle` while its centre goes straight: where a cell is, in the axes of the surface,
/// at both ends of the step, and the arm on which its mean force acts.
class Turn {
 public:
  /// `before`, rad: how far the body had turned.
  Turn(double before, double angle) noexcept
      : begin_{std::cos(before), std::sin(before)},
        end_{std::cos(before + angle), std::sin(before + angle)},
        middle_{std::cos(before + 0.5 * angle), std::sin(before + 0.5 * angle)},
        // A cell goes along the chord; the work over the angle is the force times chord over angle.
        chord_(angle != 0.0 ? 2.0 * std::sin(0.5 * angle) / angle : 1.0) {}

  /// The way of a cell, m, without that of the centre.
  Pair way(double x, double y) const noexcept { return turned(end_, x, y) - turned(begin_, x, y); }
  Pair end_arm(double x, double y) const noexcept { return turned(end_, x, y); }
  Pair mean_arm(double x, double y) const noexcept { return chord_ * turned(middle_, x, y); }

 private:
  static Pair turned(Pair c, double x, double y) noexcept { return {c.x * x - c.y * y, c.y * x + c.x * y}; }

  Pair begin_, end_, middle_;  // cosine and sine
  double chord_;
};

constexpr double cross(Pair a, Pair b) noexcept { return a.x * b.y - a.y * b.x; }

inline void add(Wrench& wrench, Pair arm, Pair force) noexcept {
  wrench.force = wrench.force + force;
  wrench.torque += cross(arm, force);
}

}  // namespace rivals
