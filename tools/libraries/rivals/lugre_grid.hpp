// Planar LuGre as a grid of cells, each with a LuGre bristle in the plane under its share of the load.
//
//   v_i = v + omega x r_i,   dz_i/dt = v_i - |v_i| z_i / zss(|v_i|)
//   F_i = p_i (sigma0 z_i + sigma1 dz_i/dt + sigma2 v_i)
//   F = sum F_i,   T = sum r_i x F_i
//
// v and omega are velocity and rate of turn of the body, F and T force and torque; cell i has place r_i,
// velocity v_i, deflection z_i and the share p_i of the load. The other letters are those of lugre.hpp.
//
// Source: Arslan Waltersson and Karayiannidis, Planar friction modelling with LuGre dynamics and limit
// surfaces, IEEE Transactions on Robotics (arXiv 2308.01123), and their code,
// github.com/Gabrieleenx/FrictionModelling: 21 x 21 cells, explicit Euler, deflections and stiffness per unit
// of load, with their switch `elasto_plastic` off. Here the cells turn with the body and z_i keeps the axes
// of the surface; there the cells do not turn, which is equal for small angles. The stiffness of the whole
// contact is that of `Surface` at any load (as in lugre.hpp), and cell i has the share p_i of it.
//
// `StepRule::exact`: exact exponentials at constant velocity, stable at every step length, with an exact mean
// over the step. `StepRule::euler`: as published, cheaper by an exponential per cell, unstable where |v_i| dt
// >= 2 zss; the mean is that of both ends.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/libraries/rivals/pressed_cells.hpp"

namespace rivals {

class LuGreGrid {
 public:
  enum class StepRule : std::uint8_t { exact, euler };

  LuGreGrid(const Surface& surface, PressedCells cells, StepRule rule = StepRule::exact);

  /// Moves the centre of the contact by `displacement` (m) and turns the body by `angle` (rad) in dt_s > 0,
  /// both at constant speed, under load_n >= 0 (N). Without load there is no force, and the state is reset.
  /// Never allocates or throws.
  SpinForce step(Pair displacement, double angle, double dt_s, double load_n) noexcept;

  std::size_t cells() const noexcept { return cells_.size(); }

 private:
  /// Deflection of a cell's bristle after the step, and the cell's force per share of the load.
  struct Moved {
    Pair z;
    Force force;
  };
  double steady_deflection(double speed, double load_n) const noexcept;
  Moved move_exactly(Pair z, Pair by, double dt_s, double load_n) const noexcept;
  Moved move_by_euler(Pair z, Pair by, double dt_s, double load_n) const noexcept;
  template <class Move>
  SpinForce step_cells(Pair displacement, double angle, const Move& move) noexcept;

  Surface surface_;
  PressedCells cells_;
  StepRule rule_;
  std::vector<double> zx_, zy_;  // deflection of each cell's bristle, m
  double turned_ = 0.0;          // angle by which the body has turned, rad
};

}  // namespace rivals
