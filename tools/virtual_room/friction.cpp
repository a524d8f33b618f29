#include "tools/virtual_room/friction.hpp"

#include <bit>
#include <cmath>

#include <Eigen/LU>

namespace room {
namespace {

using Vector9 = Eigen::Matrix<double, velocities, 1>;
using Matrix9 = Eigen::Matrix<double, velocities, velocities>;

void set_surface(rivals::Rival& rival, FrictionModel model, const rivals::Surface& surface, bool forget) {
  if (forget) {
    if (model == FrictionModel::lugre) {
      rival.emplace<rivals::LuGre>();
    } else {
      rival.emplace<rivals::Coulomb>();
    }
  }
  std::visit([&](auto& m) { m.surface = surface; }, rival);
}

double limit_of(const rivals::Rival& rival, double load) {
  if (const auto* coulomb = std::get_if<rivals::Coulomb>(&rival)) {
    return coulomb->surface.kinetic_coefficient * load;
  }
  return std::visit([&](const auto& m) { return m.surface.stribeck_force(0.0, load); }, rival);
}

rivals::Pair displacement_of(double dt_s, const TangentRows& rows, const Vector9& velocity) {
  const Eigen::Vector2d d = dt_s * rows * velocity;
  return {d[0], d[1]};
}

// Change of the force on the body with the displacement, by differences: the models are smooth but at
// corners, where one side serves as well as the other.
Eigen::Matrix2d stiffness_of(const rivals::Rival& rival, rivals::Pair d, rivals::Pair force, double dt_s,
                             double load) {
  constexpr double h = 1e-10;  // m: far below any presliding length, far above rounding
  const rivals::Pair fx = rivals::find_force(rival, {d.x + h, d.y}, dt_s, load).end - force;
  const rivals::Pair fy = rivals::find_force(rival, {d.x, d.y + h}, dt_s, load).end - force;
  Eigen::Matrix2d k;
  k << -fx.x / h, -fy.x / h, -fx.y / h, -fy.y / h;
  return k;
}

}  // namespace

void Friction::take(const Parameters& p) noexcept {
  const bool forget = p.new_patches || p.settings.model != model_;
  model_ = p.settings.model;
  ids_ = p.patches;
  for (rivals::Rival& rival : rivals_) set_surface(rival, model_, p.surface, forget);
}

Velocity Friction::find_motion(double dt_s, const Body& body, const Velocity& external,
                               bristle::Span<const PatchContact> contacts) noexcept {
  return model_ == FrictionModel::brush ? find_brush_motion(dt_s, body, external, contacts)
                                        : find_rival_motion(dt_s, body, external, contacts);
}

Velocity Friction::find_brush_motion(double dt_s, const Body& body, const Velocity& external,
                                     bristle::Span<const PatchContact> contacts) noexcept {
  const std::size_t n = contacts.size();
  for (std::size_t i = 0; i < n; ++i) {
    motions_[i] = {};
    motions_[i].id = ids_[contacts[i].patch];
    motions_[i].normal_load = contacts[i].load;
    feet_[i] = {};
    feet_[i].place = i;
    feet_[i].jacobian = contacts[i].rows;
  }
  for (std::size_t p = 0; p < probes; ++p) {
    motions_[n + p] = {};
    feet_[n + p] = {};
    feet_[n + p].place = n + p;
    feet_[n + p].jacobian.setZero();
    for (int row = 0; row < 2; ++row) {
      const int v = 2 * static_cast<int>(p) + row;
      if (v < velocities) feet_[n + p].jacobian(row, v) = 1.0;
    }
  }
  bristle::predict_displacements<velocities>(batch_, dt_s, body, external, {feet_.data(), n + probes},
                                             {motions_.data(), n + probes});
  Velocity mean;
  for (int v = 0; v < velocities; ++v) {
    mean[v] = motions_[n + static_cast<std::size_t>(v / 2)].displacement[v % 2] / dt_s;
  }
  return mean;
}

// Backward Euler, M (u1 - u0) = T (f + sum of J^T F(T J u1)), by Newton's method with halved steps. With
// friction at the end of the step: Coulomb's steep ramp through zero is a damper that stops the body within
// the step.
Velocity Friction::find_rival_motion(double dt_s, const Body& body, const Velocity& external,
                                     bristle::Span<const PatchContact> contacts) noexcept {
  constexpr int most_steps = 30, most_halvings = 12;
  constexpr double tolerance = 1e-12;  // of the momentum in the equation
  const Matrix9 mass = body.mass;
  const Vector9 start = body.velocity, push = dt_s * external;
  Matrix9 slope;
  double scale = push.norm();
  const auto residual = [&](const Vector9& u, bool with_slope) {
    Vector9 r = push - mass * (u - start);
    if (with_slope) slope = mass;
    for (const PatchContact& c : contacts) {
      const rivals::Rival& rival = rivals_[c.patch];
      const rivals::Pair d = displacement_of(dt_s, c.rows, u);
      const rivals::Pair force = rivals::find_force(rival, d, dt_s, c.load).end;
      const Vector9 impulse = dt_s * c.rows.transpose() * Eigen::Vector2d(force.x, force.y);
      r += impulse;
      scale = std::max(scale, impulse.norm());
      if (with_slope) {
        slope += dt_s * dt_s * c.rows.transpose() * stiffness_of(rival, d, force, dt_s, c.load) * c.rows;
      }
    }
    return r;
  };
  Vector9 u = start;
  Vector9 r = residual(u, true);
  for (int k = 0; k < most_steps && r.norm() > tolerance * scale; ++k) {
    Vector9 way = slope.partialPivLu().solve(r);
    if (!way.allFinite()) break;
    Vector9 trial = u + way, next = residual(trial, false);
    for (int h = 0; h < most_halvings && !(next.norm() < r.norm()); ++h) {
      way *= 0.5;
      trial = u + way;
      next = residual(trial, false);
    }
    if (!(next.norm() < r.norm())) break;
    u = trial;
    r = residual(u, true);
  }
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const rivals::Pair d = displacement_of(dt_s, contacts[i].rows, u);
    motions_[i].displacement[0] = d.x;
    motions_[i].displacement[1] = d.y;
  }
  return u;
}

void Friction::step(double dt_s, Body& body, const Velocity& external,
                    bristle::Span<PatchContact> contacts) noexcept {
  const std::size_t n = contacts.size();
  if (model_ == FrictionModel::brush) {
    batch_.step(dt_s, {motions_.data(), n}, {responses_.data(), n});
    bristle::apply_end_forces<velocities>(dt_s, body, external, {feet_.data(), n}, {responses_.data(), n});
    for (std::size_t i = 0; i < n; ++i) {
      contacts[i].force[0] = responses_[i].end[0];
      contacts[i].force[1] = responses_[i].end[1];
      contacts[i].limit = responses_[i].force_limit;
      contacts[i].status = responses_[i].status;
    }
    return;
  }
  Vector9 impulse = dt_s * external;
  for (std::size_t i = 0; i < n; ++i) {
    PatchContact& c = contacts[i];
    const rivals::Pair d{motions_[i].displacement[0], motions_[i].displacement[1]};
    const rivals::Pair force = rivals::step(rivals_[c.patch], d, dt_s, c.load).end;
    c.force[0] = force.x;
    c.force[1] = force.y;
    c.limit = limit_of(rivals_[c.patch], c.load);
    impulse += dt_s * c.rows.transpose() * Eigen::Vector2d(force.x, force.y);
  }
  const Matrix9 mass = body.mass;
  body.velocity += mass.llt().solve(impulse);
}

std::uint64_t Friction::state_hash() const noexcept {
  std::uint64_t hash = 0;
  const auto mix = [&](std::uint64_t value) {
    hash = (hash ^ value) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 32;
  };
  for (std::size_t i = 0; i < patch_count; ++i) {
    if (model_ == FrictionModel::brush) mix(batch_.state_hash(ids_[i]));
    if (const auto* lugre = std::get_if<rivals::LuGre>(&rivals_[i])) {
      mix(std::bit_cast<std::uint64_t>(lugre->z.x));
      mix(std::bit_cast<std::uint64_t>(lugre->z.y));
    }
  }
  return hash;
}

}  // namespace room
