// Grid that puts a friction model of this folder into every cell of a contact area. Friction in sliding and
// spinning is the sum over the cells.
//
// Cell i at the position r_i is a model of its own under its share of the load, with its share of stiffness,
// damping and viscous friction. Its velocity is v_i = v + omega x r_i. Its force F_i adds up to the force F =
// sum F_i and the torque T = sum r_i x F_i. The cells turn with the body, deflections keep the axes of the
// surface.
//
// With LuGre in each cell the grid is planar LuGre: Arslan Waltersson and Karayiannidis, Planar friction
// modelling with LuGre dynamics and limit surfaces, IEEE Transactions on Robotics (arXiv 2308.01123), and
// their code, github.com/Gabrieleenx/FrictionModelling: 21 x 21 cells, explicit Euler, deflections and
// stiffness per unit of load, with their switch `elasto_plastic` off. There the cells do not turn, which is
// equal for small angles.
#pragma once

#include <utility>
#include <vector>

#include "tools/libraries/rivals/pressed_cells.hpp"
#include "tools/libraries/rivals/rival.hpp"

namespace rivals {

template <class Model>
class CellGrid {
 public:
  /// Makes the grid from the friction model of the whole contact at rest. Each cell gets its share of that
  /// model.
  CellGrid(const Model& whole, PressedCells cells);

  /// Moves the centre of the contact by `displacement` (m) and turns the body by `angle` (rad) in dt_s > 0,
  /// both at constant speed, under load_n >= 0 (N). Never allocates or throws.
  SpinForce step(Pair displacement, double angle, double dt_s, double load_n) noexcept;

  std::size_t cells() const noexcept { return cells_.size(); }

 private:
  PressedCells cells_;
  std::vector<Model> models_;
  double turned_ = 0.0;  // angle by which the body has turned, rad
};

using RivalGrid = CellGrid<Rival>;

class LuGreGrid : public CellGrid<LuGre> {
 public:
  using StepRule = LuGre::StepRule;
  LuGreGrid(const Surface& surface, PressedCells cells, StepRule rule = StepRule::exact)
      : CellGrid(LuGre{surface, {}, rule}, std::move(cells)) {}
};

}  // namespace rivals
