#include "tools/products/virtual_room/friction.hpp"

#include <bit>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "tools/libraries/files/force_file.hpp"

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
  if (const auto* coulomb = std::get_if<rivals::Coulomb>(&rival))
    return coulomb->surface.kinetic_coefficient * load;
  return std::visit([&](const auto& m) { return m.surface.stribeck_force(0.0, load); }, rival);
}

rivals::Pair displacement_of(double dt_s, const TangentRows& rows, const Vector9& velocity) {
  const Eigen::Vector2d d = dt_s * rows * velocity;
  return {d[0], d[1]};
}

// Returns the derivative of a rival model's force by displacement. One-sided differences are enough: rival
// models are smooth except at corners, where either side serves.
Eigen::Matrix2d stiffness_of(const rivals::Rival& rival, rivals::Pair d, rivals::Pair force, double dt_s,
                             double load) {
  // Displacement, m, for the one-sided difference: far below any presliding length and far above rounding.
  constexpr double h = 1e-10;
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
  pad_ = p.pad;
  pad_id_ = p.pad_id;
  if (pad_ != nullptr) pad_->set_scale(pad_id_, p.settings.pad_radius);
  for (std::size_t i = 0; i < patch_count; ++i)
    set_surface(rivals_[i], model_, i == tool_patch ? p.tool_surface : p.surface, forget);
}

Velocity Friction::find_motion(double dt_s, const Body& body, const Velocity& external,
                               bristle::Span<const PatchContact> contacts) noexcept {
  return model_ == FrictionModel::brush ? find_brush_motion(dt_s, body, external, contacts)
                                        : find_rival_motion(dt_s, body, external, contacts);
}

Velocity Friction::find_brush_motion(double dt_s, const Body& body, const Velocity& external,
                                     bristle::Span<const PatchContact> contacts) noexcept {
  points_ = 0;
  const PatchContact* on_pad = nullptr;
  for (const PatchContact& c : contacts) {
    if (is_pad(c.patch)) {
      on_pad = &c;
      continue;
    }
    motions_[points_] = {};
    motions_[points_].id = ids_[c.patch];
    motions_[points_].normal_load = c.load;
    feet_[points_] = {};
    feet_[points_].index = points_;
    feet_[points_].jacobian = c.rows;
    ++points_;
  }
  cells_ = on_pad != nullptr ? add_pad_feet(*on_pad, points_) : 0;
  const std::size_t n = points_ + cells_;
  const Velocity mean = bristle::predict_displacements<velocities>(batch_, dt_s, body, external,
                                                                   {feet_.data(), n}, {motions_.data(), n});
  move_pad(dt_s, mean, contacts);
  return mean;
}

// Adds to the solver one contact for each cell of the tool's pad (a disc), so that its rim may slip while its
// middle sticks. Returns the number of cells.
std::size_t Friction::add_pad_feet(const PatchContact& contact, std::size_t first) noexcept {
  std::array<bristle::PatchCell, pad_cells> cells;
  pad_motion_ = {};
  pad_motion_.id = pad_id_;
  pad_motion_.normal_load = contact.load;
  const std::size_t count = pad_->read_cells(pad_id_, 0.0, contact.load, {cells.data(), cells.size()});
  pad_->write_motions({&pad_motion_, 1}, {motions_.data() + first, count});
  for (std::size_t k = 0; k < count; ++k) {
    const double(&at)[2] = cells[k].position;
    feet_[first + k] = {};
    feet_[first + k].index = first + k;
    feet_[first + k].jacobian = contact.rows + Eigen::Vector2d(-at[1], at[0]) * contact.spin.transpose();
  }
  return count;
}

// Moves the cells of the tool's pad along straight lines, with one displacement and one spin for all.
// Deflections then follow from the poses of block and tool, so that a pad that returns has not crept.
void Friction::move_pad(double dt_s, const Velocity& mean,
                        bristle::Span<const PatchContact> contacts) noexcept {
  if (cells_ == 0) return;
  for (const PatchContact& c : contacts) {
    if (!is_pad(c.patch)) continue;
    const Eigen::Vector2d move = dt_s * c.rows * mean;
    pad_motion_.displacement[0] = move[0];
    pad_motion_.displacement[1] = move[1];
    pad_motion_.displacement[2] = dt_s * c.spin.dot(mean);
  }
  pad_->write_motions({&pad_motion_, 1}, {motions_.data() + points_, cells_});
}

// Solves backward Euler for rival models, M (u1 - u0) = T (f + sum of J^T F(T J u1)), by Newton's method with
// step halving: mass M, velocities u0 and u1 before and after the step of duration T, outside force f, and
// each contact's friction F and rows J. Since F is the force at the end of the step, Coulomb's steep ramp
// through zero acts as a damper that stops the body within the step.
Velocity Friction::find_rival_motion(double dt_s, const Body& body, const Velocity& external,
                                     bristle::Span<const PatchContact> contacts) noexcept {
  constexpr int most_steps = 30, most_halvings = 12;
  constexpr double tolerance = 1e-12;  // accepted residual over the momentum in the equation
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
      if (with_slope)
        slope += dt_s * dt_s * c.rows.transpose() * stiffness_of(rival, d, force, dt_s, c.load) * c.rows;
    }
    return r;
  };
  Vector9 u = start;
  Vector9 r = residual(u, true);
  for (int k = 0; k < most_steps && r.norm() > tolerance * scale; ++k) {
    Vector9 move = slope.partialPivLu().solve(r);
    if (!move.allFinite()) break;
    Vector9 trial = u + move, next = residual(trial, false);
    for (int h = 0; h < most_halvings && !(next.norm() < r.norm()); ++h) {
      move *= 0.5;
      trial = u + move;
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
    step_brush(dt_s, body, external, contacts);
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

void Friction::step_brush(double dt_s, Body& body, const Velocity& external,
                          bristle::Span<PatchContact> contacts) noexcept {
  batch_.step(dt_s, {motions_.data(), points_ + cells_}, {responses_.data(), points_ + cells_});
  Velocity beside = external;
  std::size_t point = 0;
  snaps_ = 0;
  for (PatchContact& c : contacts) {
    if (is_pad(c.patch)) {
      bristle::ExtendedResponse pad;
      pad_->read_responses({&pad_motion_, 1}, {responses_.data() + points_, cells_}, {&pad, 1});
      c.force[0] = pad.end[0];
      c.force[1] = pad.end[1];
      c.torque = pad.end[2];
      c.limit = pad.force_limit;
      c.torque_limit = pad.torque_limit;
      c.status = pad.status;
      beside += c.rows.transpose() * Eigen::Vector2d(c.force[0], c.force[1]) + c.torque * c.spin;
      continue;
    }
    const bristle::Response& response = responses_[point++];
    c.force[0] = response.end[0];
    c.force[1] = response.end[1];
    c.limit = response.force_limit;
    c.status = response.status;
    snaps_ += response.snaps;
  }
  bristle::apply_end_forces<velocities>(dt_s, body, beside, {feet_.data(), points_},
                                        {responses_.data(), points_});
}

double Friction::active_bristles(std::size_t i) const noexcept {
  if (model_ != FrictionModel::brush) return 0.0;
  if (!is_pad(i)) return cli::bristles_in_contact(batch_.info(ids_[i]));
  double sum = 0.0;
  for (const bristle::PatchId cell : pad_->cell_patches(pad_id_))
    sum += cli::bristles_in_contact(batch_.info(cell));
  return sum;
}

std::uint64_t Friction::state_hash() const noexcept {
  std::uint64_t hash = 0;
  const auto mix = [&](std::uint64_t value) {
    hash = (hash ^ value) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 32;
  };
  for (std::size_t i = 0; i < patch_count; ++i) {
    if (model_ == FrictionModel::brush)
      mix(is_pad(i) ? pad_->state_hash(pad_id_) : batch_.state_hash(ids_[i]));
    if (const auto* lugre = std::get_if<rivals::LuGre>(&rivals_[i])) {
      mix(std::bit_cast<std::uint64_t>(lugre->z.x));
      mix(std::bit_cast<std::uint64_t>(lugre->z.y));
    }
  }
  return hash;
}

}  // namespace room
