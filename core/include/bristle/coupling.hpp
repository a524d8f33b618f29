// Velocity update of a body that rests on contact patches: stable for any stiffness of the patches.
// Header-only, over Eigen: link bristle::eigen. Not part of bristle.hpp.
//
// A body has Dof velocities u (6 for a rigid body: linear, then angular) and a mass matrix M. Contact i sees
// the slip velocity s_i = J_i u - g_i in its tangent plane, moves by d_i = T s_i in a step, and answers with
// a force F_i on the body:
//
//   M (u1 - u0) = T (f + sum of J_i^T F_i)                                                   (momentum)
//
// There are two ways to find the displacements; the velocity always follows from the forces that acted in the
// step:
//
//   predict_displacements   F_i = F_i(now) - (K_i T + C_i) s_i, its elastic part clipped at the force limit:
//                           linear; s_i between the old velocity and the new, halfway without dampers and
//                           nearer the new with them. Cheap: it evaluates each patch once. Needs only the
//                           end force; finish with apply_end_forces. (Friction that strengthens with speed
//                           takes some more linear solves, a contact that ages and snaps in the step up to
//                           four evaluations.)
//   solve_displacements     F_i = mean force over the step at d_i = T s_i((u0 + u1) / 2), solved by
//                           PatchBatch::find_force: the midpoint rule, which itself neither adds nor takes
//                           energy. Needs Outputs::mean; without it the report's residual is
//                           infinite. Finish with apply_mean_forces.
//
// Equations, limits and measurements: core/MODEL.md, section 21. Thread rule: PatchBatch's stepping thread.
// Nothing here allocates, locks or throws.
#pragma once

#include <cstddef>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "bristle/coupling_solver.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/span.hpp"

namespace bristle {

using RigidBody = MovingBody<6>;

/// Makes a free rigid body at rest. Velocities are about its centre of mass, in world axes. `inertia` is in
/// kg m^2, `mass_kg` > 0. If the body turns, update `mass` (inertia in world axes).
inline RigidBody rigid_body(double mass_kg, const Eigen::Matrix3d& inertia) noexcept {
  RigidBody body;
  body.mass.setZero();
  body.mass.diagonal().head<3>().setConstant(mass_kg);
  body.mass.bottomRightCorner<3, 3>() = inertia;
  return body;
}

/// Makes a contact of a rigid body through the flat patch at `arm` (m, from the centre of mass, world axes).
/// The orthogonal unit vectors `along` and `aside` in the tangent plane are the directions of displacement[0]
/// and [1]. `index`: index of the patch in the arrays of motions and responses.
inline BodyContact<6> rigid_contact(std::size_t index, const Eigen::Vector3d& arm,
                                    const Eigen::Vector3d& along, const Eigen::Vector3d& aside) noexcept {
  BodyContact<6> contact;
  contact.index = index;
  contact.jacobian.row(0) << along.transpose(), arm.cross(along).transpose();
  contact.jacobian.row(1) << aside.transpose(), arm.cross(aside).transpose();
  return contact;
}

/// Sets the displacements of the next step in `motions` by linear solves, in which stiffness and damping of
/// every patch are implicit. If a patch's elastic force would exceed its force limit, the patch pulls with
/// that limit instead, and the solve is repeated. `motions` contains ids and loads of the step. `external` is
/// the force on the body over the step (N, N m; including gyroscopic torque where it matters). Returns the
/// body's velocity averaged over the step, from which the displacements follow.
template <int Dof>
BodyVector<Dof> predict_displacements(PatchBatch& batch, double dt_s, const MovingBody<Dof>& body,
                                      const Given<BodyVector<Dof>>& external,
                                      Given<Span<BodyContact<Dof>>> contacts, Span<Motion> motions) noexcept {
  const Eigen::Matrix<double, Dof, 1> mean =
      detail::predict_mean_velocity<Dof>(batch, dt_s, body, external, contacts, motions);
  detail::set_displacements<Dof>(dt_s, mean, contacts, motions);
  return mean;
}

/// Sets the displacements of the next step in `motions` by the midpoint rule. `external` is the force at the
/// middle of the step (N, N m). The mean force of bristles that redraw over many snaps jumps a little with
/// the displacement. If the equation has no solution because of a jump, takes the point with the least error,
/// which the report gives as its residual.
template <int Dof>
SolveReport solve_displacements(PatchBatch& batch, double dt_s, const MovingBody<Dof>& body,
                                const Given<BodyVector<Dof>>& external,
                                Given<Span<BodyContact<Dof>>> contacts, Span<Motion> motions) noexcept {
  Eigen::Matrix<double, Dof, 1> midpoint;
  return detail::MidpointSolver<Dof>(batch, dt_s, body, external, contacts, motions).solve(midpoint);
}

/// Sets the body's velocity after the step from the forces that acted in it, so that momentum is conserved to
/// rounding. Call it after PatchBatch::step.
template <int Dof>
void apply_end_forces(double dt_s, MovingBody<Dof>& body, const Given<BodyVector<Dof>>& external,
                      Given<Span<const BodyContact<Dof>>> contacts, Span<const Response> responses) noexcept {
  detail::apply_forces<Dof>(dt_s, body, external, contacts, responses, &Response::end);
}
template <int Dof>
void apply_mean_forces(double dt_s, MovingBody<Dof>& body, const Given<BodyVector<Dof>>& external,
                       Given<Span<const BodyContact<Dof>>> contacts,
                       Span<const Response> responses) noexcept {
  detail::apply_forces<Dof>(dt_s, body, external, contacts, responses, &Response::mean);
}

}  // namespace bristle
