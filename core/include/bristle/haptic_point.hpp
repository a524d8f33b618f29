// From positions of a haptic device to the force on the hand: one point on one patch.
// Header-only, over Eigen: link bristle::eigen. Not part of bristle.hpp.
//
//   point.prepare(dt, position, normal, wall_force, motion);   // every tick, in contact or not
//   batch.step(dt, {&motion, 1}, {&response, 1});
//   send_to_device(point.finish(response));
//
// Displacements come from positions. The displacement of a tick is the difference of two positions, so
// bristles bend by the path of the hand at any level of noise, and sticking does not creep.
//
// The damper's velocity. displacement/dt has no lag and can never add energy, but with an encoder of 20 um at
// 1 kHz it is a multiple of 20 mm/s. With `resolution` set, the velocity is the slope over the longest
// stretch of past positions that lie within a resolution of a straight line (Janabi-Sharifi, Hayward and Chen
// 2000, "end-fit first-order adaptive windowing"). The stretch is short when the hand accelerates and long
// when it moves evenly, without a time constant to choose. Where the velocity opposes the displacement it is
// set to 0, so the damper never adds energy to the hand.
//
// The device's limit. Scaling down a force that is too large adds energy: the user presses in while friction
// makes the scale small, stops the friction, and comes out with the full normal force. Therefore the limit is
// part of the model. Wall force and load are capped at force_limit / sqrt(1 + peak^2), so wall and elastic
// friction together stay within the limit, in the right proportion. The wall's force then still depends on
// the wall alone, and the patch's own energy balance closes. Dampers and lubricant, which store no energy,
// may be scaled. If the scatter of a patch with few bristles exceeds its material's peak, the excess is cut
// off.
//
// The mean of the tick. With `mean` set the hand feels the force averaged over the tick instead of that at
// its end: less ripple from a patch of few representatives, half a tick later. A linear loop of stiffness K
// then needs a device damping of K T instead of K T / 2 (core/MODEL.md, section 22). The infinite brush has
// no ripple and no use for it.
//
// Thread rule: plain data, for the servo thread. Nothing here allocates, locks or throws.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "bristle/contact_frame.hpp"
#include "bristle/patch.hpp"
#include "bristle/set_field.hpp"

namespace bristle {

/// Velocity from positions, by a window that adapts its length. Constant memory, no allocation.
class WindowedVelocity {
 public:
  static constexpr int longest = 32;  ///< ticks, longest window of positions

  WindowedVelocity() noexcept {
    for (Eigen::Vector3d& position : positions_) position.setZero();
  }

  /// Adds the position (m) at the end of a tick of dt_s (s). `resolution_m`: half the width of the noise
  /// band, one count of an encoder. Returns the velocity, m/s.
  Eigen::Vector3d update(double dt_s, const Eigen::Vector3d& position, double resolution_m) noexcept {
    time_ += dt_s;
    newest_ = (newest_ + 1) % (longest + 1);
    positions_[newest_] = position;
    times_[newest_] = time_;
    count_ = std::min(count_ + 1, longest + 1);
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    window_ = 0;
    for (int n = 1; n < count_ && fits(n, velocity, resolution_m); ++n) window_ = n;
    return velocity;
  }
  void restart() noexcept { count_ = 0; }
  int window() const noexcept { return window_; }  ///< number of ticks in the window of the last velocity

 private:
  int back(int n) const noexcept { return (newest_ - n + longest + 1) % (longest + 1); }

  /// Looks for a straight run of the last n ticks: if all their positions lie within resolution_m of the
  /// straight line from the first to the last, returns true and sets `velocity` to the line's slope.
  bool fits(int n, Eigen::Vector3d& velocity, double resolution_m) const noexcept {
    const Eigen::Vector3d slope = (positions_[newest_] - positions_[back(n)]) / (time_ - times_[back(n)]);
    for (int i = 1; i < n; ++i) {
      const Eigen::Vector3d off =
          positions_[newest_] - (time_ - times_[back(i)]) * slope - positions_[back(i)];
      if (!(off.squaredNorm() <= resolution_m * resolution_m)) return false;
    }
    velocity = slope;
    return true;
  }

  Eigen::Vector3d positions_[longest + 1];
  double times_[longest + 1] = {};
  double time_ = 0.0;
  int newest_ = 0, count_ = 0, window_ = 0;
};

struct HapticOptions {
  /// Largest force that the device may be sent, N, > 0. Wall force and friction share it.
  double force_limit = std::numeric_limits<double>::infinity();
  /// Material::peak_coefficient of the patch, by which force_limit is divided between wall and friction. A
  /// value that is too large costs wall force, one that is too small makes finish() cut friction.
  double peak_coefficient = 1.0;
  /// Resolution of the device's positions, m (one count of its encoder), by which the damper's velocity is
  /// smoothed. 0: the damper uses displacement / dt.
  double resolution = 0.0;
  /// Whether to render the force averaged over the tick, which ripples less and comes half a tick late. The
  /// patch then needs Outputs::mean (see lacks_mean).
  bool mean = false;

  HapticOptions& with_force_limit(double newtons) { return detail::set(*this, force_limit, newtons); }
  HapticOptions& with_peak_coefficient(double value) { return detail::set(*this, peak_coefficient, value); }
  HapticOptions& with_resolution(double metres) { return detail::set(*this, resolution, metres); }
  HapticOptions& with_mean(bool value) { return detail::set(*this, mean, value); }
};

class HapticPoint {
 public:
  explicit HapticPoint(const HapticOptions& options = {}) noexcept
      : options_(options),
        highest_wall_(options.force_limit /
                      std::sqrt(1.0 + options.peak_coefficient * options.peak_coefficient)) {}

  /// Fills in the patch's motion (displacement, load, velocity) for the tick that ends at `position` (m; on a
  /// moving surface, in its frame). `normal` points out of the surface and may have any length. `wall_force`
  /// (N, >= 0) is the force with which the surface pushes back; at 0, out of contact, the normal does not
  /// matter.
  /// If the position is not finite or the wall force is not a number >= 0, step() answers the motion with
  /// Status::bad_input, and patch and frame keep their states. The next good tick then includes the missed
  /// displacement and time.
  void prepare(double dt_s, const Eigen::Vector3d& position, const Eigen::Vector3d& normal, double wall_force,
               Motion& motion) noexcept {
    const bool somewhere = position.allFinite();
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    if (started_) moved = position - position_;
    if (somewhere) taken_ -= sent_.dot(moved);
    motion.has_velocity = false;
    const double wall = std::min(wall_force, highest_wall_);
    if (!somewhere || !(wall >= 0.0) || !std::isfinite(wall)) {
      missed_s_ += dt_s;
      motion.displacement[0] = motion.displacement[1] = std::numeric_limits<double>::quiet_NaN();
      return;
    }
    if (wall_ > 0.0)
      frame_.carry(normal);
    else if (wall > 0.0)
      frame_ = ContactFrame(normal);
    motion.normal_load = wall_ = wall;
    frame_.set_displacement(moved, motion);
    if (options_.resolution > 0.0) {
      const Eigen::Vector3d velocity = velocity_.update(dt_s + missed_s_, position, options_.resolution);
      frame_.set_velocity(velocity, motion);
      if (motion.velocity[0] * motion.displacement[0] + motion.velocity[1] * motion.displacement[1] < 0.0)
        motion.velocity[0] = motion.velocity[1] = 0.0;
    } else if (missed_s_ > 0.0) {
      frame_.set_velocity(moved / (dt_s + missed_s_), motion);
    }
    missed_s_ = 0.0;
    position_ = position;
    started_ = true;
  }

  /// Returns the force on the hand, N: wall and friction, within the limit. Zero if the patch refused its
  /// motion.
  const Eigen::Vector3d& finish(const Response& response) noexcept {
    const bool refused = !was_stepped(response.status);
    limited_ = !refused && wall_ > 0.0 && wall_ >= highest_wall_;
    friction_.setZero();
    if (!refused) {
      const double room =
          std::sqrt(std::max(0.0, options_.force_limit * options_.force_limit - wall_ * wall_));
      Eigen::Vector2d damper(response.damper[0], response.damper[1]);
      Eigen::Vector2d elastic(response.elastic[0], response.elastic[1]);
      lacks_mean_ = options_.mean && bristle::lacks_mean(response);
      if (options_.mean && !lacks_mean_)
        elastic = Eigen::Vector2d(response.mean[0], response.mean[1]) - damper;
      limit(elastic, damper, room);
      const double tangential[2] = {elastic[0] + damper[0], elastic[1] + damper[1]};
      friction_ = frame_.force(tangential);
    }
    sent_ = refused ? Eigen::Vector3d::Zero().eval() : Eigen::Vector3d(wall_ * frame_.normal() + friction_);
    return sent_;
  }

  /// Forgets the last position, so that the next displacement is 0 and does not bend the bristles. Call it
  /// after a jump that the hand did not make (the device was indexed, the scene was moved).
  void restart() noexcept {
    started_ = false;
    velocity_.restart();
  }

  const Eigen::Vector3d& friction() const noexcept { return friction_; }  ///< friction force, N
  double wall_force() const noexcept { return wall_; }                    ///< last wall force, capped, N

  /// Whether the force limit has cut the last wall force, elastic friction or damper.
  bool limited() const noexcept { return limited_; }

  /// Whether the options ask for the mean force but the patch computed none, for lack of Outputs::mean. The
  /// last force was then that at the end of the tick.
  bool lacks_mean() const noexcept { return lacks_mean_; }
  const ContactFrame& frame() const noexcept { return frame_; }
  /// Returns the energy that the hand put in so far, J, with each force held until the next position, as a
  /// device holds it. A passive contact keeps it above 0 from the first touch on. A value below 0 is the
  /// energy that the delay of one tick adds (core/MODEL.md, section 22); the device's own damping must absorb
  /// it.
  double taken() const noexcept { return taken_; }

 private:
  /// Keeps the length of the friction elastic + damper within `room` (N), the part of the force limit that
  /// the wall leaves. Shrinks the damper first; if the elastic part alone exceeds `room`, sets the damper to
  /// 0 and shrinks the elastic part.
  void limit(Eigen::Vector2d& elastic, Eigen::Vector2d& damper, double room) noexcept {
    if ((elastic + damper).norm() <= room) return;
    limited_ = true;
    const double size = elastic.norm();
    if (size >= room) {
      elastic *= size > 0.0 ? room / size : 0.0;  // avoids 0/0 where there is no room and no elastic force
      damper.setZero();
      return;
    }
    // Finds the share s of the damper, 0 <= s < 1, with which |elastic + s damper| = room: the larger root of
    // a quadratic.
    const double a = damper.squaredNorm(), b = elastic.dot(damper), c = size * size - room * room;
    damper *= (std::sqrt(b * b - a * c) - b) / a;
  }

  HapticOptions options_;
  double highest_wall_;
  ContactFrame frame_;
  WindowedVelocity velocity_;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d friction_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d sent_ = Eigen::Vector3d::Zero();
  double wall_ = 0.0;
  double taken_ = 0.0;
  double missed_s_ = 0.0;  // duration of the bad ticks since the last good one, s
  bool started_ = false;
  bool limited_ = false;
  bool lacks_mean_ = false;
};

}  // namespace bristle
