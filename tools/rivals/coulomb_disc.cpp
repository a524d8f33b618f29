#include "tools/rivals/coulomb_disc.hpp"

#include <algorithm>
#include <utility>

namespace rivals {

DiscFriction coulomb_disc(double eps) noexcept {
  const double e2 = eps * eps;
  // The terms of the closed forms cancel at both ends.
  if (eps < 1e-3) return {eps * (1.0 - 0.125 * e2), 2.0 / 3.0 * (1.0 - 0.75 * e2)};
  if (eps > 100.0) return {1.0 - 0.125 / e2, 0.25 / eps * (1.0 + 1.0 / (12.0 * e2))};
  if (eps == 1.0) return {8.0 / (3.0 * M_PI), 8.0 / (9.0 * M_PI)};
  const double modulus = eps < 1.0 ? eps : 1.0 / eps;
  const double k = std::comp_ellint_1(modulus), e = std::comp_ellint_2(modulus);
  if (eps < 1.0) {
    return {4.0 / (3.0 * M_PI * eps) * ((e2 + 1.0) * e + (e2 - 1.0) * k),
            4.0 / (9.0 * M_PI) * ((4.0 - 2.0 * e2) * e + (e2 - 1.0) * k)};
  }
  return {4.0 / (3.0 * M_PI) * ((e2 + 1.0) * e - (e2 - 1.0) * k),
          4.0 * eps / (9.0 * M_PI) * ((4.0 - 2.0 * e2) * e + (2.0 * e2 - 5.0 + 3.0 / e2) * k)};
}

CoulombGrid::CoulombGrid(const Surface& surface, PressedCells cells, double creep_velocity_m_per_s)
    : surface_(surface), cells_(std::move(cells)), creep_velocity_(creep_velocity_m_per_s) {}

SpinForce CoulombGrid::step(Pair displacement, double angle, double dt_s, double load_n) noexcept {
  if (!(load_n > 0.0)) return {};
  const Turn turn(turned_, angle);
  SpinForce sum;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const double x = cells_.x[i], y = cells_.y[i];
    const Pair v = (1.0 / dt_s) * (displacement + turn.way(x, y));
    const double per_speed =
        load_n * surface_.kinetic_coefficient / std::max(std::sqrt(dot(v, v)), creep_velocity_);
    const Pair force = -cells_.share[i] * (per_speed + surface_.viscous_friction) * v;
    add(sum.end, turn.end_arm(x, y), force);
    add(sum.mean, turn.mean_arm(x, y), force);
  }
  turned_ += angle;
  return sum;
}

}  // namespace rivals
