#include "tools/libraries/rivals/lugre_grid.hpp"

#include <algorithm>
#include <utility>

#include "tools/libraries/rivals/relaxation.hpp"

namespace rivals {

LuGreGrid::LuGreGrid(const Surface& surface, PressedCells cells, StepRule rule)
    : surface_(surface),
      cells_(std::move(cells)),
      rule_(rule),
      zx_(cells_.size(), 0.0),
      zy_(cells_.size(), 0.0) {}

double LuGreGrid::steady_deflection(double speed, double load_n) const noexcept {
  // Skips the exponential of the Stribeck curve if static and kinetic coefficient are equal. It takes half of
  // the time of a cell.
  const double force = surface_.static_coefficient == surface_.kinetic_coefficient
                           ? surface_.kinetic_coefficient * load_n
                           : surface_.stribeck_force(speed, load_n);
  return force / surface_.stiffness;
}

LuGreGrid::Moved LuGreGrid::move_exactly(Pair z, Pair by, double dt_s, double load_n) const noexcept {
  const double length_m = std::sqrt(dot(by, by)), speed = length_m / dt_s;
  const double zss = steady_deflection(speed, load_n);
  Relaxed r{z, z};
  if (length_m > 0.0) r = relax(z, (zss / length_m) * by, length_m / zss);
  const Pair v = (1.0 / dt_s) * by;
  const Pair end_rate = v - (speed / zss) * r.end, mean_rate = (1.0 / dt_s) * (r.end - z);
  return {r.end, {surface_.bristle_force(r.end, end_rate, v), surface_.bristle_force(r.mean, mean_rate, v)}};
}

LuGreGrid::Moved LuGreGrid::move_by_euler(Pair z, Pair by, double dt_s, double load_n) const noexcept {
  const double speed = std::sqrt(dot(by, by)) / dt_s;
  const double zss = steady_deflection(speed, load_n);
  const Pair v = (1.0 / dt_s) * by;
  const Pair rate = v - (speed / zss) * z;
  const Pair end = z + dt_s * rate;
  const Pair end_rate = v - (speed / zss) * end;
  return {end, {surface_.bristle_force(end, end_rate, v), surface_.bristle_force(0.5 * (z + end), rate, v)}};
}

template <class Move>
SpinForce LuGreGrid::step_cells(Pair displacement, double angle, const Move& move) noexcept {
  const Turn turn(turned_, angle);
  SpinForce sum;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const double x = cells_.x[i], y = cells_.y[i], share = cells_.share[i];
    const Moved moved = move(Pair{zx_[i], zy_[i]}, displacement + turn.moved(x, y));
    zx_[i] = moved.z.x;
    zy_[i] = moved.z.y;
    add(sum.end, turn.end_arm(x, y), share * moved.force.end);
    add(sum.mean, turn.mean_arm(x, y), share * moved.force.mean);
  }
  turned_ += angle;
  return sum;
}

SpinForce LuGreGrid::step(Pair displacement, double angle, double dt_s, double load_n) noexcept {
  if (!(load_n > 0.0)) {
    std::fill(zx_.begin(), zx_.end(), 0.0);
    std::fill(zy_.begin(), zy_.end(), 0.0);
    return {};
  }
  if (rule_ == StepRule::euler)
    return step_cells(displacement, angle,
                      [&](Pair z, Pair by) { return move_by_euler(z, by, dt_s, load_n); });
  return step_cells(displacement, angle, [&](Pair z, Pair by) { return move_exactly(z, by, dt_s, load_n); });
}

}  // namespace rivals
