// Moves a body that slides on friction patches, by solving its equation of motion for the displacement of
// each step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <bristle/coupling_solver.hpp>
#include <bristle/patch_batch.hpp>

#include "tools/libraries/scene/scene.hpp"

namespace cli {

/// Effort of solving a body's equation of motion, summed over all its steps.
struct SolveStatistics {
  std::uint64_t iterations = 0;  ///< number of times the friction force was evaluated
  int worst_iterations = 0;
  double worst_residual = 0.0;  ///< largest residual of the equation over its largest force
};

/// Motion of a body of mass m under an external force F_ext and friction. Solves m (v1 - v0) = T (F_ext +
/// F_mean(d)) with d = T (v0 + v1) / 2 for the displacement d in a step of time T, where v0 and v1 are the
/// velocities before and after it, and F_mean is the mean friction over the step
/// (bristle::solve_displacements). This midpoint rule neither adds nor removes energy. A spring of stiffness
/// k and damping c to a hand at X is part of it: its force at the middle of the step is k (X - x0 - T (v0 +
/// v1) / 4) + c (V - (v0 + v1) / 2), whose part in v1 - v0 adds k T^2 / 4 + c T / 2 to the mass.
class BodyMotion {
 public:
  /// Makes the motion of a body. `patches` are the indices of its patches in the batch's motions.
  BodyMotion(const SceneBody& body, std::vector<std::size_t> patches);

  /// Returns the normal load (N) on each of the body's patches at time t.
  double load_per_patch(double t) const noexcept;

  /// Solves the equation of motion of a step, and sets displacement and load of the body's patches in
  /// `motions`. Must be called before PatchBatch::step.
  void solve(bristle::PatchBatch& batch, double t, double dt,
             bristle::Span<bristle::Motion> motions) noexcept;
  /// Updates the velocity of the body by the friction of the step. Must be called after PatchBatch::step.
  void finish(double dt, bristle::Span<const bristle::Response> responses) noexcept;

  /// Sets position (m) and velocity (m/s) of the body, as when a saved run is restored.
  void set_motion(const double (&position)[2], const double (&velocity)[2]) noexcept {
    for (int axis = 0; axis < 2; ++axis) {
      position_[axis] = position[axis];
      velocity_[axis] = velocity[axis];
    }
  }

  /// Computes the force (N) on the body at time t without friction: the prescribed one, and that of the
  /// spring if the body were at rest where it is.
  void applied_force(double t, double (&force_n)[2]) const noexcept;

  const SolveStatistics& statistics() const noexcept { return statistics_; }
  const double (&position() const noexcept)[2] { return position_; }
  const double (&velocity() const noexcept)[2] { return velocity_; }
  double highest_speed() const noexcept { return highest_speed_; }

 private:
  void add_spring(double t, double dt) noexcept;

  /// Solver for a body of one degree of freedom (on a rail) or two (in the plane). A body has one of the two.
  template <int Dof>
  struct Coupled {
    bristle::MovingBody<Dof> body;
    std::vector<bristle::BodyContact<Dof>> contacts;
  };
  template <int Dof>
  void solve(Coupled<Dof>& coupled, bristle::PatchBatch& batch, double dt,
             bristle::Span<bristle::Motion> motions) noexcept;
  template <int Dof>
  void finish(Coupled<Dof>& coupled, double dt, bristle::Span<const bristle::Response> responses) noexcept;

  const SceneBody& body_;
  std::vector<std::size_t> patches_;
  Coupled<1> rail_;
  Coupled<2> plane_;
  double position_[2] = {0.0, 0.0};
  double velocity_[2];
  double applied_[2] = {0.0, 0.0};
  double displacement_[2] = {0.0, 0.0};
  double highest_speed_ = 0.0;
  SolveStatistics statistics_;
};

}  // namespace cli
