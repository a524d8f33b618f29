// Follows the axis along which a place of the block moves on the floor, so that forces can be shown along it.
#pragma once

#include <cmath>

namespace room {

/// Axis of a motion in the plane. It points from a place that is dragged behind to the moving place. The sign
/// of the axis does not follow the motion, so a stroke back along the axis counts as negative.
class MotionAxis {
 public:
  /// Turns the axis after a displacement (m). The place behind is dragged at most `length` (m) away, the
  /// length over which bristles turn with the motion.
  void move(double dx, double dy, double length) noexcept {
    lag_[0] += dx;
    lag_[1] += dy;
    double far = std::hypot(lag_[0], lag_[1]);
    if (far > length) {
      for (double& component : lag_) component *= length / far;
      far = length;
    }
    if (!(far > least_share * length)) return;
    // Points the axis to the right, or away from the eye. Its sign changes only if the motion crosses the
    // skew direction (-0.3, 1), along which people hardly ever push.
    const double sign = lag_[0] + 0.3 * lag_[1] < 0.0 ? -1.0 : 1.0;
    for (int i = 0; i < 2; ++i) axis_[i] = sign * lag_[i] / far;
  }
  /// Returns the component of a vector along the axis of the motion.
  double along(double x, double y) const noexcept { return x * axis_[0] + y * axis_[1]; }

 private:
  /// Least distance, as a share of `length`, to the dragged place for which the axis follows it. Below, the
  /// axis keeps its direction, so that trembling does not turn it.
  static constexpr double least_share = 0.02;
  double lag_[2] = {0.0, 0.0}, axis_[2] = {1.0, 0.0};
};

}  // namespace room
