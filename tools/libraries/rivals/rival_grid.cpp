#include "tools/libraries/rivals/rival_grid.hpp"

#include <utility>

namespace rivals {
namespace {

Rival share_of(Rival rival, double share) {
  std::visit(
      [&](auto& model) {
        model.surface.stiffness *= share;
        model.surface.damping *= share;
        model.surface.viscous_friction *= share;
      },
      rival);
  return rival;
}

}  // namespace

RivalGrid::RivalGrid(const Rival& rival, PressedCells cells) : cells_(std::move(cells)) {
  for (const double share : cells_.share) rivals_.push_back(share_of(rival, share));
}

SpinForce RivalGrid::step(Pair displacement, double angle, double dt_s, double load_n) noexcept {
  const Turn turn(turned_, angle);
  SpinForce sum;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const double x = cells_.x[i], y = cells_.y[i];
    const Force force =
        rivals::step(rivals_[i], displacement + turn.moved(x, y), dt_s, cells_.share[i] * load_n);
    add(sum.end, turn.end_arm(x, y), force.end);
    add(sum.mean, turn.mean_arm(x, y), force.mean);
  }
  turned_ += angle;
  return sum;
}

}  // namespace rivals
