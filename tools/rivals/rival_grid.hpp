// Any rival in every cell of a contact area: what slides and spins feels the sum of its cells.
//
// Cell i is a rival of its own under its share of the load, with its share of stiffness, damper and
// lubricant; it goes its own way, v_i = v + omega x r_i, and F = sum F_i, T = sum r_i x F_i. The cells turn
// with the body, deflections keep the axes of the surface. `LuGreGrid` is the same for LuGre, without the
// variant's cost.
#pragma once

#include <vector>

#include "tools/rivals/pressed_cells.hpp"
#include "tools/rivals/rival.hpp"

namespace rivals {

class RivalGrid {
 public:
  /// `rival` is of the whole contact, at rest.
  RivalGrid(const Rival& rival, PressedCells cells);

  /// Moves the centre by `displacement` (m) and turns the body by `angle` (rad) in dt_s > 0, both at constant
  /// speed, under load_n >= 0 (N). Never allocates or throws.
  SpinForce step(Pair displacement, double angle, double dt_s, double load_n) noexcept;

  std::size_t cells() const noexcept { return cells_.size(); }

 private:
  PressedCells cells_;
  std::vector<Rival> rivals_;
  double turned_ = 0.0;  // rad
};

}  // namespace rivals
