// Velocity update of a body that rests on extended patches: coupling.hpp with spin.
// Header-only, over Eigen: link bristle::eigen. Not part of bristle.hpp.
//
//   bristle::CellContacts<6> cells;                       // working memory
//   bristle::ExtendedContact<6> pad = bristle::rigid_contact_with_spin(0, arm, along, aside);
//   bristle::predict_displacements(patches, cells, dt, body, force, {&pad, 1}, {&motion, 1});
//   patches.step(dt, {&motion, 1}, {&response, 1});
//   bristle::apply_end_forces(dt, body, force, {&pad, 1}, {&response, 1});
//
// Every cell of every outline is a contact in the solves of coupling.hpp. A cell has its own stiffness and
// force limit, so the rim may slip while the middle sticks. A solve finds one displacement and one spin for
// each patch, and the patch steps by these, so a body that returns to its pose without slip has not crept.
// The midpoint rule takes each cell where the outline stands half-way through the turn, at any trial
// velocity, which keeps its energy balance however fast the body spins. The predictor takes each cell where
// the mean spin of the step brings it.
//
// A body may rest on points as well: an extended patch whose only cell is its centre is a point.
//
// Equations, limits and measurements: core/MODEL.md, section 29. Thread rule: PatchBatch's stepping thread.
// Nothing here locks. CellContacts allocates when a call has more cells than it has room for: reserve it at
// set-up.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "bristle/contact_frame.hpp"
#include "bristle/coupling.hpp"
#include "bristle/extended_patches.hpp"
#include "bristle/span.hpp"

namespace bristle {

/// An extended patch (it has two axes) under a body, for the solves of this file.
template <int Dof>
struct ExtendedContact {
  std::size_t index = 0;  ///< index of the contact's patch in the arrays of motions and responses

  /// Matrix J that gives (slip of the outline's centre, spin) as J u - ground_velocity from the body's
  /// velocity u; m/s, m/s, rad/s
  Eigen::Matrix<double, 3, Dof, Eigen::DontAlign> jacobian = Eigen::Matrix<double, 3, Dof>::Identity();
  /// Velocity of the other surface at the outline's centre, in the tangent plane, and its spin; m/s, m/s,
  /// rad/s.
  Eigen::Matrix<double, 3, 1, Eigen::DontAlign> ground_velocity = Eigen::Vector3d::Zero();
};

/// Makes a contact of a rigid body through an outline centred at `arm` (m, from the centre of mass, world
/// axes). `along` and `aside` are orthogonal unit vectors, the axes of the surface in which displacement[0]
/// and [1] are given. The spin is about their cross product.
inline ExtendedContact<6> rigid_contact_with_spin(std::size_t index, const Eigen::Vector3d& arm,
                                                  const Eigen::Vector3d& along,
                                                  const Eigen::Vector3d& aside) noexcept {
  ExtendedContact<6> contact;
  contact.index = index;
  contact.jacobian.row(0) << along.transpose(), arm.cross(along).transpose();
  contact.jacobian.row(1) << aside.transpose(), arm.cross(aside).transpose();
  contact.jacobian.row(2) << Eigen::RowVector3d::Zero(), along.cross(aside).transpose();
  return contact;
}

/// Working memory of predict_displacements and solve_displacements. Keep one and pass it to every call, so
/// that calls do not allocate; its contents do not matter between calls.
template <int Dof>
struct CellContacts {
  std::vector<BodyContact<Dof>> contacts;
  std::vector<Motion> motions;
  std::vector<PatchCell> positions;  ///< positions of the cells at the beginning of the step

  void reserve(std::size_t cells) {
    contacts.reserve(cells);
    motions.reserve(cells);
    positions.reserve(cells);
  }
};

namespace detail {

/// Rotation of an outline by half of its spin in a step: it stands there when the midpoint rule takes its
/// force.
struct HalfTurn {
  double cosine, sine;
  double share;  ///< chord of the turn over its arc: 2 sin(spin / 2) / spin
};
inline HalfTurn half_turn(double spin) noexcept {
  constexpr double most = 3.141592653589793;  // largest spin of a step, which trial spins are cut to
  spin = std::clamp(spin, -most, most);
  const auto q = rotation_by({0.0, 0.0, 0.5 * spin});
  const double sine = 2.0 * q.w() * q.z();
  return {q.w() * q.w() - q.z() * q.z(), sine, std::abs(spin) <= 0.0 ? 1.0 : 2.0 * sine / spin};
}

/// Fills in the working memory: ids, loads and positions of all cells, one contact after the other.
template <int Dof>
void lay_out_cells(const ExtendedPatches& patches, Span<const ExtendedContact<Dof>> contacts,
                   Span<const ExtendedMotion> motions, CellContacts<Dof>& cells) {
  std::size_t count = 0;
  for (const ExtendedContact<Dof>& c : contacts) count += patches.cell_count(motions[c.index].id);
  cells.contacts.assign(count, BodyContact<Dof>{});
  cells.motions.resize(count);
  cells.positions.resize(count);
  std::size_t at = 0;
  for (const ExtendedContact<Dof>& c : contacts) {
    ExtendedMotion rest;
    rest.id = motions[c.index].id;
    rest.normal_load = motions[c.index].normal_load;
    patches.write_motions({&rest, 1}, Span<Motion>(cells.motions.data() + at, count - at));
    at += patches.read_cells(rest.id, 0.0, rest.normal_load,
                             Span<PatchCell>(cells.positions.data() + at, count - at));
  }
  for (std::size_t k = 0; k < count; ++k) cells.contacts[k].index = k;
}

/// Sets the cells' Jacobians for a step at the velocity u. A cell's displacement is that of the centre plus
/// the chord of its turn, and its force acts where the cell is half-way. Returns whether a spin has changed
/// so much since the last call that a prediction with the old positions of the cells is unreliable.
template <int Dof>
class FollowTurn {
 public:
  FollowTurn(const ExtendedPatches& patches, double dt_s, Span<const ExtendedContact<Dof>> contacts,
             Span<ExtendedMotion> motions, CellContacts<Dof>& cells) noexcept
      : patches_(&patches), dt_s_(dt_s), contacts_(contacts), motions_(motions), cells_(&cells) {}

  bool operator()(const Eigen::Matrix<double, Dof, 1>& u) const noexcept {
    constexpr double much = 1e-3;  // rad
    bool changed = false;
    std::size_t k = 0;
    for (const ExtendedContact<Dof>& c : contacts_) {
      const double spin = dt_s_ * (c.jacobian.row(2).dot(u) - c.ground_velocity[2]);
      ExtendedMotion& motion = motions_[c.index];
      changed = changed || std::fabs(spin - motion.displacement[2]) > much;
      motion.displacement[2] = spin;
      const HalfTurn turn = half_turn(spin);
      const std::size_t end = k + patches_->cell_count(motions_[c.index].id);
      for (; k < end; ++k) {
        const double(&at)[2] = cells_->positions[k].position;
        const Eigen::Vector2d per_spin(-turn.share * (turn.sine * at[0] + turn.cosine * at[1]),
                                       turn.share * (turn.cosine * at[0] - turn.sine * at[1]));
        BodyContact<Dof>& cell = cells_->contacts[k];
        cell.jacobian = c.jacobian.template topRows<2>() + per_spin * c.jacobian.row(2);
        cell.ground_velocity = c.ground_velocity.template head<2>() + per_spin * c.ground_velocity[2];
      }
    }
    return changed;
  }

 private:
  const ExtendedPatches* patches_;
  double dt_s_;
  Span<const ExtendedContact<Dof>> contacts_;
  Span<ExtendedMotion> motions_;
  CellContacts<Dof>* cells_;
};

template <int Dof>
void set_displacements(double dt_s, const Eigen::Matrix<double, Dof, 1>& u,
                       Span<const ExtendedContact<Dof>> contacts, Span<ExtendedMotion> motions) noexcept {
  for (const ExtendedContact<Dof>& c : contacts) {
    const Eigen::Vector3d slip = c.jacobian * u - c.ground_velocity;
    ExtendedMotion& motion = motions[c.index];
    for (int a = 0; a < 3; ++a) motion.displacement[a] = dt_s * slip[a];
    motion.has_velocity = false;
  }
}

}  // namespace detail

/// Sets the displacements of the next step as predict_displacements of coupling.hpp, by linear solves with a
/// force limit for each cell. Finish with ExtendedPatches::step and apply_end_forces. The patches refuse a
/// spin of more than half a turn in a step: split such a step.
template <int Dof>
void predict_displacements(ExtendedPatches& patches, CellContacts<Dof>& cells, double dt_s,
                           const MovingBody<Dof>& body, const Given<BodyVector<Dof>>& external,
                           Given<Span<const ExtendedContact<Dof>>> contacts, Span<ExtendedMotion> motions) {
  detail::lay_out_cells<Dof>(patches, contacts, motions, cells);
  using Follow = detail::FollowTurn<Dof>;
  const Eigen::Matrix<double, Dof, 1> mean = detail::predict_mean_velocity<Dof, Follow>(
      patches.batch(), dt_s, body, external, cells.contacts, cells.motions,
      Follow(patches, dt_s, contacts, motions, cells));
  detail::set_displacements<Dof>(dt_s, mean, contacts, motions);
}

/// Sets the displacements of the next step as solve_displacements of coupling.hpp, by the midpoint rule;
/// needs Outputs::mean. Finish with ExtendedPatches::step and apply_mean_forces.
template <int Dof>
SolveReport solve_displacements(ExtendedPatches& patches, CellContacts<Dof>& cells, double dt_s,
                                const MovingBody<Dof>& body, const Given<BodyVector<Dof>>& external,
                                Given<Span<const ExtendedContact<Dof>>> contacts,
                                Span<ExtendedMotion> motions) {
  detail::lay_out_cells<Dof>(patches, contacts, motions, cells);
  using Follow = detail::FollowTurn<Dof>;
  Eigen::Matrix<double, Dof, 1> midpoint;
  const SolveReport report =
      detail::MidpointSolver<Dof, Follow>(patches.batch(), dt_s, body, external, cells.contacts,
                                          cells.motions, Follow(patches, dt_s, contacts, motions, cells))
          .solve(midpoint);
  detail::set_displacements<Dof>(dt_s, midpoint, contacts, motions);
  return report;
}

/// Sets the body's velocity after the step from the forces and torques that acted in it. Call it after
/// ExtendedPatches::step.
template <int Dof>
void apply_end_forces(double dt_s, MovingBody<Dof>& body, const Given<BodyVector<Dof>>& external,
                      Given<Span<const ExtendedContact<Dof>>> contacts,
                      Span<const ExtendedResponse> responses) noexcept {
  detail::apply_forces<Dof>(dt_s, body, external, contacts, responses, &ExtendedResponse::end);
}
template <int Dof>
void apply_mean_forces(double dt_s, MovingBody<Dof>& body, const Given<BodyVector<Dof>>& external,
                       Given<Span<const ExtendedContact<Dof>>> contacts,
                       Span<const ExtendedResponse> responses) noexcept {
  detail::apply_forces<Dof>(dt_s, body, external, contacts, responses, &ExtendedResponse::mean);
}

}  // namespace bristle
