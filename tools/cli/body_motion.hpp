// A body on friction patches: the displacement of one step from its equation of motion.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <bristle/patch_batch.hpp>

#include "tools/cli/scene.hpp"

namespace cli {

/// How hard the equation of motion was to solve, over all steps of one body.
struct SolveStatistics {
  std::uint64_t solves = 0;
  std::uint64_t iterations = 0;  ///< evaluations of the friction force
  int worst_iterations = 0;
  double worst_residual = 0.0;  ///< over the largest force in the equation
};

/// Solves m (v1 - v0) = T (F_ext + F_mean(d)) with d = T (v0 + v1) / 2 for the displacement d, F_mean being
/// the friction force on the body averaged over the step (PatchBatch::find_force): the midpoint rule, which
/// neither adds nor takes energy beside what the bristles do.
class BodyMotion {
 public:
  /// `patches` are the places of the body's patches in the batch's motion array; `stiffness` and `damping`
  /// those per newton of load (N/m, N s/m), upper bounds over its materials; `viscous` their sum, N s/m.
  BodyMotion(const SceneBody& body, std::vector<std::size_t> patches, double stiffness_per_newton,
             double damping_per_newton, double viscous_friction);

  /// Load of each patch, N.
  double load_per_patch(double t) const noexcept;

  /// Before PatchBatch::step: sets displacement and load of the body's patches in `motions`.
  void solve(bristle::PatchBatch& batch, double t, double dt, bristle::Motion* motions) noexcept;
  /// After it: takes the velocity from the friction that acted.
  void finish(double dt, const bristle::Response* responses) noexcept;

  const SceneBody& body() const noexcept { return body_; }
  const SolveStatistics& statistics() const noexcept { return statistics_; }
  const double (&position() const noexcept)[2] { return position_; }
  const double (&velocity() const noexcept)[2] { return velocity_; }
  double highest_speed() const noexcept { return highest_speed_; }
  const double (&applied() const noexcept)[2] { return applied_; }

 private:
  struct Force2 {
    double x = 0.0, y = 0.0;
  };
  Force2 residual(bristle::PatchBatch& batch, double dt, bristle::Motion* motions, const Force2& d) noexcept;
  void solve_one_axis(bristle::PatchBatch& batch, double dt, bristle::Motion* motions) noexcept;
  void solve_two_axes(bristle::PatchBatch& batch, double dt, bristle::Motion* motions) noexcept;
  void note(double residual_n) noexcept;

  const SceneBody& body_;
  std::vector<std::size_t> patches_;
  double stiffness_per_newton_, damping_per_newton_, viscous_;
  double position_[2] = {0.0, 0.0};
  double velocity_[2];
  double applied_[2] = {0.0, 0.0};
  double displacement_[2] = {0.0, 0.0};
  double slope_bound_ = 0.0;  // N/m: the residual falls at most so fast with d
  double force_scale_ = 0.0;  // N
  int evaluations_ = 0;
  double highest_speed_ = 0.0;
  SolveStatistics statistics_;
};

}  // namespace cli
