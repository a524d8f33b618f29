// Grid that puts any friction model of this folder into every cell of a contact area. Friction in sliding and
// spinning is the sum over the cells.
//
// Cell i at the place r_i is a model of its own under its share of the load, with its share of stiffness,
// damping and viscous friction. Its velocity is v_i = v + omega x r_i. Its force F_i adds up to the force F =
// sum F_i and the torque T = sum r_i x F_i. The cells turn with the body, deflections keep the axes of the
// surface. `LuGreGrid` does this for LuGre alone, without the cost of the variant.
#pragma once

#include <vector>

#include "tools/libraries/rivals/pressed_cells.hpp"
#include "tools/libraries/rivals/rival.hpp"

namespace rivals {

class RivalGrid {
 public:
  /// Makes the grid from `rival`, the friction model of the whole contact at rest. Each cell gets its share
  /// of that model.
  RivalGrid(const Rival& rival, PressedCells cells);

  /// Moves the centre of the contact by `displacement` (m) and turns the body by `angle` (rad) in dt_s > 0,
  /// both at constant speed, under load_n >= 0 (N). Never allocates or throws.
  SpinForce step(Pair displacement, double angle, double dt_s, double load_n) noexcept;

  std::size_t cells() const noexcept { return cells_.size(); }

 private:
  PressedCells cells_;
  std::vector<Rival> rivals_;
  double turned_ = 0.0;  // angle by which the body has turned, rad
};

}  // namespace rivals
