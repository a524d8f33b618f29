// Moves a block under friction by implicit steps of its equation of motion, so that stiff friction models are
// stable at 1 kHz.
#pragma once

#include "tools/libraries/experiments/subject.hpp"

namespace cli {

/// Pull of a spring or a force on a block that moves by d during a step, averaged over the step: force_n -
/// stiffness d. The number force_n is the mean pull on a block that does not move.
struct Pull {
  double force_n = 0.0;
  /// Stiffness of the pull, N/m: half that of a spring, because the mean over a step sees half of d.
  double stiffness = 0.0;
};

/// Block that slides on a friction model. A step solves m (v1 - v0) = T (F_pull + F_mean(d)), d = T (v0 + v1)
/// / 2.
class SlidingBlock {
 public:
  explicit SlidingBlock(double mass_kg, double velocity = 0.0) : mass_(mass_kg), velocity_(velocity) {}

  /// Advances the block by a step. Returns the friction force on it, averaged over the step, N.
  double advance(Subject& subject, const Pull& pull, double dt_s, double load_n);

  double position() const noexcept { return position_; }
  double velocity() const noexcept { return velocity_; }
  /// Returns the largest residual of the equation of motion in any step, relative to its largest force. Where
  /// one more snap of a finite brush makes friction jump, it is not small.
  double worst_residual() const noexcept { return worst_residual_; }
  int worst_evaluations() const noexcept { return worst_evaluations_; }

 private:
  double mass_;
  double position_ = 0.0, velocity_;
  double worst_residual_ = 0.0;
  int worst_evaluations_ = 0;
};

}  // namespace cli
