#include "tools/libraries/scene/body_motion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/libraries/scene/couplings.hpp"

namespace cli {
namespace {

template <int Dof>
bristle::BodyVector<Dof> vector_of(const double (&values)[2]) noexcept {
  bristle::BodyVector<Dof> vector;
  for (int a = 0; a < Dof; ++a) vector[a] = values[a];
  return vector;
}

}  // namespace

BodyMotion::BodyMotion(const SceneBody& body, std::vector<std::size_t> patches)
    : body_(body), patches_(std::move(patches)), velocity_{body.velocity[0], body.velocity[1]} {
  const auto set_up = [&](auto& coupled) {
    coupled.body.mass *= body_.mass;
    coupled.contacts.resize(patches_.size());
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      coupled.contacts[i].index = patches_[i];
      coupled.contacts[i].axes = body_.axes;
    }
  };
  if (body_.axes == 1) {
    set_up(rail_);
  } else {
    set_up(plane_);
  }
}

double BodyMotion::load_per_patch(double t) const noexcept {
  return (body_.mass * body_.gravity + load_at(body_.extra_load, t)) / static_cast<double>(patches_.size());
}

template <int Dof>
void BodyMotion::solve(Coupled<Dof>& coupled, bristle::PatchBatch& batch, double dt,
                       bristle::Span<bristle::Motion> motions) noexcept {
  coupled.body.velocity = vector_of<Dof>(velocity_);
  const bristle::SolveReport report = bristle::solve_displacements<Dof>(
      batch, dt, coupled.body, vector_of<Dof>(applied_), coupled.contacts, motions);
  statistics_.iterations += static_cast<std::uint64_t>(report.evaluations);
  statistics_.worst_iterations = std::max(statistics_.worst_iterations, report.evaluations);
  statistics_.worst_residual = std::max(statistics_.worst_residual, report.residual);
}

template <int Dof>
void BodyMotion::finish(Coupled<Dof>& coupled, double dt,
                        bristle::Span<const bristle::Response> responses) noexcept {
  bristle::apply_mean_forces<Dof>(dt, coupled.body, vector_of<Dof>(applied_), coupled.contacts, responses);
  for (int a = 0; a < Dof; ++a) velocity_[a] = coupled.body.velocity[a];
}

void BodyMotion::applied_force(double t, double (&force_n)[2]) const noexcept {
  body_.applied_force(t, force_n);
  if (!body_.spring) return;
  const Position hand = body_.spring->hand.at(t);
  force_n[0] += body_.spring->stiffness * (hand.x - position_[0]);
  force_n[1] += body_.spring->stiffness * (hand.y - position_[1]);
}

// Adds the spring's force at the middle of the step to the equation of motion. The part for an unchanged
// velocity is added to the applied force, the part that changes with the velocity to the mass.
void BodyMotion::add_spring(double t, double dt) noexcept {
  const SceneSpring& spring = *body_.spring;
  const Position begin = spring.hand.at(t), middle = spring.hand.at(t + 0.5 * dt),
                 end = spring.hand.at(t + dt);
  const double hand[2] = {middle.x, middle.y};
  const double speed[2] = {(end.x - begin.x) / dt, (end.y - begin.y) / dt};
  for (int a = 0; a < body_.axes; ++a)
    applied_[a] += spring.stiffness * (hand[a] - position_[a] - 0.5 * dt * velocity_[a]) +
                   spring.damping * (speed[a] - velocity_[a]);
  const double mass = body_.mass + 0.25 * spring.stiffness * dt * dt + 0.5 * spring.damping * dt;
  rail_.body.mass.setIdentity() *= mass;
  plane_.body.mass.setIdentity() *= mass;
}

void BodyMotion::solve(bristle::PatchBatch& batch, double t, double dt,
                       bristle::Span<bristle::Motion> motions) noexcept {
  body_.applied_force(t + 0.5 * dt, applied_);
  if (body_.spring) add_spring(t, dt);
  const double load = load_per_patch(t + 0.5 * dt);
  for (const std::size_t p : patches_) motions[p].normal_load = load;
  if (body_.axes == 1) {
    solve(rail_, batch, dt, motions);
  } else {
    solve(plane_, batch, dt, motions);
  }
  for (int a = 0; a < body_.axes; ++a) displacement_[a] = motions[patches_.front()].displacement[a];
}

void BodyMotion::finish(double dt, bristle::Span<const bristle::Response> responses) noexcept {
  if (body_.axes == 1) {
    finish(rail_, dt, responses);
  } else {
    finish(plane_, dt, responses);
  }
  for (int a = 0; a < body_.axes; ++a) position_[a] += displacement_[a];
  highest_speed_ =
      std::max(highest_speed_, std::sqrt(velocity_[0] * velocity_[0] + velocity_[1] * velocity_[1]));
}

}  // namespace cli
