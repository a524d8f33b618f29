// Prescribed motion: position of the moving body and normal load, as functions of time.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "tools/files/motion_file.hpp"

namespace cli {

struct Position {
  double x = 0.0, y = 0.0;  ///< m
};

/// Normal load from time t on, until the next load step.
struct LoadStep {
  double t = 0.0;     ///< s
  double load = 0.0;  ///< N
};

enum class MotionType { hold, ramp, sine, keyframes, trace };

struct PrescribedMotion {
  MotionType type = MotionType::hold;
  double velocity[2] = {0.0, 0.0};  ///< m/s, velocity of a ramp between the times `from` and `until`
  double from = 0.0;                ///< s, start of a ramp
  double until = std::numeric_limits<double>::infinity();
  double amplitude[2] = {0.0, 0.0};  ///< m, of a sine
  double frequency = 1.0;            ///< Hz, of a sine
  double phase = 0.0;                ///< turns, phase of a sine at t = 0
  std::vector<MotionRow> keyframes;
  std::shared_ptr<const MotionFile> trace;  ///< rows of a motion file, moved so that they start at t = 0;
                                            ///< several motions may share them
  std::vector<LoadStep> load_steps;         ///< normal loads over time; empty: the rows have the loads
  double turn_per_copy = 0.0;               ///< turns; copy i moves in directions rotated by i times this
  double delay_per_copy = 0.0;              ///< s; copy i moves later by i times this

  /// Returns the rows of keyframes or motion file; none in other motions. Linear between rows; the last row
  /// holds on.
  const std::vector<MotionRow>& rows() const noexcept { return trace ? trace->rows : keyframes; }
  /// Returns the position of copy 0 at time t >= 0, m.
  Position at(double t) const noexcept;
  /// Returns the load of copy 0 in the step from t to t + dt, N. From rows it is the load at the end of the
  /// step, since a control loop reads position and load together at each tick. From load steps it is the load
  /// at the middle, where rounding of times cannot matter.
  double load_over(double t, double dt) const noexcept;
  /// Returns whether the motion needs patches with two axes.
  bool moves_along_y() const noexcept;
  /// Returns whether copy 0 moves only along one straight line, and sets the line's direction, a unit vector.
  bool stays_on_line(double (&direction)[2]) const noexcept;
};

/// Returns the normal load at time t, N; 0 before the first load step.
double load_at(const std::vector<LoadStep>& steps, double t) noexcept;

}  // namespace cli
