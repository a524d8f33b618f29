#include "tools/libraries/rivals/rival_grid.hpp"

namespace rivals {
namespace {

template <class Model>
void take_share(Model& model, double share) {
  model.surface.stiffness *= share;
  model.surface.damping *= share;
  model.surface.viscous_friction *= share;
}
void take_share(Rival& rival, double share) {
  std::visit([&](auto& model) { take_share(model, share); }, rival);
}

Force step_cell(LuGre& model, Pair displacement, double dt_s, double load_n) noexcept {
  return model.step(displacement, dt_s, load_n);
}
Force step_cell(Rival& model, Pair displacement, double dt_s, double load_n) noexcept {
  return step(model, displacement, dt_s, load_n);
}

}  // namespace

template <class Model>
CellGrid<Model>::CellGrid(const Model& whole, PressedCells cells)
    : cells_(std::move(cells)), models_(cells_.size(), whole) {
  for (std::size_t i = 0; i < cells_.size(); ++i) take_share(models_[i], cells_.share[i]);
}

template <class Model>
SpinForce CellGrid<Model>::step(Pair displacement, double angle, double dt_s, double load_n) noexcept {
  const Turn turn(turned_, angle);
  SpinForce sum;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const double x = cells_.x[i], y = cells_.y[i];
    const Force force =
        step_cell(models_[i], displacement + turn.moved(x, y), dt_s, cells_.share[i] * load_n);
    add(sum.end, turn.end_arm(x, y), force.end);
    add(sum.mean, turn.mean_arm(x, y), force.mean);
  }
  turned_ += angle;
  return sum;
}

template class CellGrid<Rival>;
template class CellGrid<LuGre>;

}  // namespace rivals
