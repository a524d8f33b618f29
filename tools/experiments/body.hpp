// Moves a block on one friction model by implicit steps of its equation of motion, so that stiff models are
// stable at 1 kHz.
#pragma once

#include "tools/experiments/subject.hpp"

namespace cli {

/// Pull on the block, averaged over a step in which the block moves by d: force_n - stiffness d, with force_n
/// the mean pull on a block that stays.
struct Pull {
  double force_n = 0.0;
  double stiffness = 0.0;  ///< N/m, stiffness of the pull; for a spring whose other end moves by itself, half
                           ///< the spring's stiffness
};

/// Block that solves m (v1 - v0) = T (F_pull + F_mean(d)) with d = T (v0 + v1) / 2 for d (midpoint rule).
class SlidingBlock {
 public:
  explicit SlidingBlock(double mass_kg, double velocity = 0.0) : mass_(mass_kg), velocity_(velocity) {}

  /// Advances a step. Returns the friction force on the block, mean over the step, N.
  double advance(Subject& subject, const Pull& pull, double dt_s, double load_n);

  double position() const noexcept { return position_; }
  double velocity() const noexcept { return velocity_; }
  /// Returns the largest residual of all steps over the largest force in the equation. It is not small where
  /// the friction of a finite brush jumps with d (one more bristle snaps).
  double worst_residual() const noexcept { return worst_residual_; }
  int worst_evaluations() const noexcept { return worst_evaluations_; }

 private:
  double mass_;
  double position_ = 0.0, velocity_;
  double worst_residual_ = 0.0;
  int worst_evaluations_ = 0;
};

}  // namespace cli
