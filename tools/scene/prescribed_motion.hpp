// Prescribed motion: where the moving body is, and how hard it presses, at any time.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "tools/files/motion_file.hpp"

namespace cli {

struct Position {
  double x = 0.0, y = 0.0;  ///< m
};

/// Load that holds from time t on.
struct LoadStep {
  double t = 0.0;     ///< s
  double load = 0.0;  ///< N
};

enum class MotionType { hold, ramp, sine, keyframes, trace };

struct PrescribedMotion {
  MotionType type = MotionType::hold;
  double velocity[2] = {0.0, 0.0};  ///< ramp: m/s, between the times `from` and `until`
  double from = 0.0;                ///< ramp: s
  double until = std::numeric_limits<double>::infinity();
  double amplitude[2] = {0.0, 0.0};  ///< sine: m
  double frequency = 1.0;            ///< sine: Hz
  double phase = 0.0;                ///< sine: turns
  std::vector<MotionRow> keyframes;
  std::shared_ptr<const MotionFile> trace;  ///< motion file, shared because it may be large; begins at t = 0
  std::vector<LoadStep> load_steps;         ///< steps of the load; empty: the rows have it
  double turn_per_copy = 0.0;               ///< turns; copy i moves along directions turned by i times this
  double delay_per_copy = 0.0;              ///< s; copy i is delayed by i times this

  /// Returns the rows of keyframes or trace, else none; linear in between, and the last one holds.
  const std::vector<MotionRow>& rows() const noexcept { return trace ? trace->rows : keyframes; }
  /// Returns the position of copy 0 at time t >= 0, m.
  Position at(double t) const noexcept;
  /// Returns the load of copy 0 over the step from t to t + dt, N. From rows it is the load at the step's
  /// end, since a control loop reads position and load together at each tick; from load steps that in the
  /// middle, away from rounding at the edges.
  double load_over(double t, double dt) const noexcept;
  /// Returns whether the second axis is needed.
  bool moves_along_y() const noexcept;
  /// Returns whether copy 0 moves to and fro on one straight line, and its direction, a unit vector.
  bool stays_on_line(double (&direction)[2]) const noexcept;
};

/// Returns the value of load steps at time t; 0 before the first.
double load_at(const std::vector<LoadStep>& steps, double t) noexcept;

}  // namespace cli
