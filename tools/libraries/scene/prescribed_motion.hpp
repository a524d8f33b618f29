// The prescribed motion of a patch in a scene: position of the moving body and normal load, as functions of
// time.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "tools/libraries/files/motion_file.hpp"

namespace cli {

struct Position {
  double x = 0.0, y = 0.0;  ///< position of the body, m
};

/// Normal load from a time t on, until the next load step begins.
struct LoadStep {
  double t = 0.0;     ///< beginning of the load step, s
  double load = 0.0;  ///< normal load, N
};

enum class MotionType { hold, ramp, sine, keyframes, trace };

struct PrescribedMotion {
  MotionType type = MotionType::hold;
  double velocity[2] = {0.0, 0.0};  ///< velocity of a ramp between the times `from` and `until`, m/s
  double from = 0.0;                ///< time at which a ramp begins, s
  double until = std::numeric_limits<double>::infinity();
  double amplitude[2] = {0.0, 0.0};  ///< amplitude of a sine, m
  double frequency = 1.0;            ///< frequency of a sine, Hz
  double phase = 0.0;                ///< phase of a sine at t = 0, in turns
  std::vector<MotionRow> keyframes;
  /// Rows of a motion file, shifted to start at t = 0. Several motions may share them, so that a long file is
  /// read once.
  std::shared_ptr<const MotionFile> trace;
  std::vector<LoadStep> load_steps;  ///< normal loads over time; empty: rows hold the loads
  double turn_per_copy = 0.0;        ///< turns by which copy i's directions differ from copy i - 1's
  double delay_per_copy = 0.0;       ///< time by which copy i moves later than copy i - 1, s

  /// Returns the rows of keyframes or of a motion file; empty for other motions. Between rows the motion is
  /// linear; after the last row it stays constant.
  const std::vector<MotionRow>& rows() const noexcept { return trace ? trace->rows : keyframes; }
  /// Returns the position (m) of the first copy at a time t >= 0.
  Position at(double t) const noexcept;
  /// Returns the normal load (N) of the first copy in the step from t to t + dt. Rows give the load at the
  /// end of the step, because a control loop reads position and load together at each tick. Load steps give
  /// the load at the middle of the step, where rounding of times does no harm.
  double load_over(double t, double dt) const noexcept;
  /// Returns whether the motion, copies included, needs patches with two axes.
  bool moves_along_y() const noexcept;
  /// Returns whether the first copy moves on one straight line, so that one axis is enough; if so, sets
  /// `direction` to its unit vector.
  bool stays_on_line(double (&direction)[2]) const noexcept;
};

/// Returns the normal load (N) at time t; 0 before the first load step.
double load_at(const std::vector<LoadStep>& steps, double t) noexcept;

}  // namespace cli
