// The tangent axes of a contact in space: 3-D motions in, 3-D forces out.
// Header-only, over Eigen: link bristle::eigen. Not part of bristle.hpp.
//
// A patch works with two tangential numbers; its frame gives their directions in space. The normal points
// from the other body (B) to the moving one (A), on which the patch's force acts; displacements are those of
// A relative to B. In every step, carry the frame to the new normal, set the displacement, step the patch,
// and read the force.
//
//   frame.carry(normal, turn_a, turn_b);                              // rad: angular velocity times dt
//   frame.set_displacement(dt * (velocity_a - velocity_b), motion);   // m, both at the contact point
//   batch.step(dt, {&motion, 1}, {&response, 1});
//   wrench_on_a += frame.wrench(frame.force(response.end), contact_point - centre_of_a);
//
// Velocities times dt are not the slip of bodies that turn: an engine moves them along tangents, and what
// rests on a turntable would drift outwards by w^2 r dt / 2. Take the slip from poses (SlipByPoses):
//
//   slip.record(a, b, contact_point);                 // before the engine moves the bodies
//   frame.set_displacement(slip.find(a, b), motion)  // once it has moved them
//
// Motion of the axes:
// - The normal changes: the axes follow by the smallest rotation that takes the old normal to the new one
//   (parallel transport). On a curved surface they return turned by the solid angle that the normal
//   encircled; that is geometry, not an error.
// - The bodies turn about the normal: a bristle has its root on one and its tip on the other, so the axes
//   turn by the mean of both. With tip t and root r, d(t - r)/dt = slip + (spin_a + spin_b)/2 x (t - r),
//   where the slip is taken half-way between them; so the mean is not a convention. If everything turns
//   together, nothing changes.
// - Deflections never change: they are two numbers in these axes, so their lengths, the stored energy and
//   the magnitude of the force stay the same to the bit under any motion of the frame.
// A single patch has no resistance to spin (a moment about the normal). An extended patch has
// (extended_patches.hpp). Its axes ride on body B, whose surface they describe, and its outline turns with A:
//
//   frame.carry_with_surface(normal, turn_b);
//   frame.set_displacement(dt * (velocity_a - velocity_b), turn_a - turn_b, motion);  // an ExtendedMotion
//   patches.step(dt, {&motion, 1}, {&response, 1});
//   wrench_on_a += frame.spin_wrench(response.end, centre_of_outline - centre_of_a);
//
// Order of error. Displacements are taken in the axes half-way through the last carry. Compared with the
// integral of the velocity along a smooth path this gives an error of order dt^2 over a given time: an arc of
// angle a, given by its chord, is a^2/24 too short. (Motion along the normal does not contribute.) In the
// axes at either end the error would be of order dt. Rolling without slip gives no error, for velocities as
// engines provide them.
//
// Thread rule: plain data, no locks. Nothing here but making or copying ContactFrames allocates or throws, or
// calls libm beyond sqrt.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "bristle/config.hpp"
#include "bristle/keyed_patches.hpp"
#include "bristle/patch.hpp"
#if BRISTLE_WITH_OUTLINES
#include "bristle/extended_patches.hpp"
#endif

namespace bristle {

namespace detail {

/// Returns the rotation by the vector `turn` (rad) of any length, by halving and a series, without libm.
inline Eigen::Quaternion<double, Eigen::DontAlign> rotation_by(const Eigen::Vector3d& turn) noexcept {
  using Quaternion = Eigen::Quaternion<double, Eigen::DontAlign>;
  Eigen::Vector3d half = 0.5 * turn;
  int doublings = 0;
  for (; half.squaredNorm() > 0.0625 && doublings < 64; ++doublings) half *= 0.5;
  const double x = half.squaredNorm();
  // Computes cos(a) and sin(a)/a to 1e-17, for an angle a <= 1/4 rad.
  const double c =
      1.0 -
      x * 0.5 *
          (1.0 - x * (1.0 / 12) * (1.0 - x * (1.0 / 30) * (1.0 - x * (1.0 / 56) * (1.0 - x * (1.0 / 90)))));
  const double s =
      1.0 -
      x * (1.0 / 6) *
          (1.0 - x * (1.0 / 20) * (1.0 - x * (1.0 / 42) * (1.0 - x * (1.0 / 72) * (1.0 - x * (1.0 / 110)))));
  Quaternion q(c, s * half[0], s * half[1], s * half[2]);
  if (doublings == 0) return q;  // unit quaternion to rounding, by the series
  for (; doublings > 0; --doublings) q = q * q;
  q.normalize();
  return q;
}

/// Returns `v`, which is at a right angle to the unit vector `from`, rotated by the smallest rotation that
/// takes `from` to `to`. If they are opposite there are many such rotations; the one about `v` leaves it.
inline Eigen::Vector3d carry_along(const Eigen::Vector3d& v, const Eigen::Vector3d& from,
                                   const Eigen::Vector3d& to) noexcept {
  const Eigen::Vector3d w = from.cross(to);
  const double cosine = from.dot(to);
  const double sine_squared = w.squaredNorm();
  if (cosine > 0.0) return v + w.cross(v) + w.cross(w.cross(v)) / (1.0 + cosine);
  if (sine_squared > 1e-24) return v + w.cross(v) + w.cross(w.cross(v)) * ((1.0 - cosine) / sine_squared);
  return v;
}

}  // namespace detail

class ContactFrame {
 public:
  /// Wrench: force (N), then moment (N m), as coupling.hpp orders velocities.
  using Wrench = Eigen::Matrix<double, 6, 1, Eigen::DontAlign>;
  using Quaternion = Eigen::Quaternion<double, Eigen::DontAlign>;

  /// Makes a frame with the normal z and the axes x and y.
  ContactFrame() noexcept = default;
  /// Makes a frame with any axes about `normal`, which need not have length 1. The axes depend on the normal
  /// alone. A normal that is zero or not finite gives z.
  explicit ContactFrame(const Eigen::Vector3d& normal) noexcept { begin(normal, least_axis(normal)); }
  /// Makes a frame about `normal` whose first axis is as near to `along` as the normal allows.
  ContactFrame(const Eigen::Vector3d& normal, const Eigen::Vector3d& along) noexcept { begin(normal, along); }

  /// Right-handed unit vectors: displacement[0] runs along, displacement[1] aside.
  const Eigen::Vector3d& along() const noexcept { return now_.along; }
  const Eigen::Vector3d& aside() const noexcept { return now_.aside; }
  const Eigen::Vector3d& normal() const noexcept { return now_.normal; }
  /// Axes half-way through the last carry, between those before and after the step. displacement() and
  /// mean_force() use them, because motion and mean force belong to the whole step.
  const Eigen::Vector3d& midway_along() const noexcept { return midway_.along; }
  const Eigen::Vector3d& midway_aside() const noexcept { return midway_.aside; }
  const Eigen::Vector3d& midway_normal() const noexcept { return midway_.normal; }

  /// Carries the axes to the normal of this step, for bodies that do not turn or whose spin about the normal
  /// does not matter. Opposite normals give half a turn about `along`. If the normal is zero or not finite,
  /// returns false and leaves the axes, in which the motion of this step is then read.
  bool carry(const Eigen::Vector3d& normal) noexcept {
    return carry(normal, Quaternion::Identity(), Quaternion::Identity());
  }
  /// Carries the axes for bodies that turned by the vectors `turn_a` and `turn_b` (rad, world axes) in this
  /// step. Returns false, and keeps the axes, if the normal is zero or an argument is not finite.
  bool carry(const Eigen::Vector3d& normal, const Eigen::Vector3d& turn_a,
             const Eigen::Vector3d& turn_b) noexcept {
    return carry(normal, detail::rotation_by(turn_a), detail::rotation_by(turn_b));
  }
  /// Carries the axes for bodies whose rotations in this step are given as unit quaternions: new orientation
  /// times inverse of the old one.
  bool carry(const Eigen::Vector3d& normal, const Quaternion& turn_a, const Quaternion& turn_b) noexcept {
    midway_ = now_;
    Eigen::Vector3d n;
    if (!normalized(normal, n) || !turn_a.coeffs().allFinite() || !turn_b.coeffs().allFinite()) return false;
    // Averages two directions for the first axis: `along` turned with body A and `along` turned with body B,
    // each then taken to the new normal by the smallest rotation.
    Eigen::Vector3d along = carried_by(turn_a, n) + carried_by(turn_b, n);
    if (!(along.squaredNorm() > 1e-24))
      along = carried_by(turn_b, n);  // axes that the two bodies carry are half a turn apart and have no mean
    const Axes before = now_;
    now_ = make_axes(n, along);
    midway_ = half_way(before, now_);
    return true;
  }

  /// Carries the axes of an extended patch, which are fixed to body B. `turn_b` (rad) is the rotation of B in
  /// this step.
  bool carry_with_surface(const Eigen::Vector3d& normal, const Eigen::Vector3d& turn_b) noexcept {
    return carry(normal, turn_b, turn_b);
  }

  /// Returns the tangential part, in the frame's axes, of a displacement of A relative to B at the contact
  /// point (m, in space); works for velocities too. Call it after carry(), whose half-way axes it uses.
  Eigen::Vector2d displacement(const Eigen::Vector3d& relative) const noexcept {
    return {midway_.along.dot(relative), midway_.aside.dot(relative)};
  }
  void set_displacement(const Eigen::Vector3d& relative, Motion& motion) const noexcept {
    motion.displacement[0] = midway_.along.dot(relative);
    motion.displacement[1] = midway_.aside.dot(relative);
  }
#if BRISTLE_WITH_OUTLINES
  /// Sets displacement and spin in the motion of an extended patch; `turn` is the rotation of A relative to B
  /// in this step (rad).
  void set_displacement(const Eigen::Vector3d& relative, const Eigen::Vector3d& turn,
                        ExtendedMotion& motion) const noexcept {
    motion.displacement[0] = midway_.along.dot(relative);
    motion.displacement[1] = midway_.aside.dot(relative);
    motion.displacement[2] = midway_.normal.dot(turn);
  }
#endif
  /// Sets a velocity of its own for the damper (m/s, of A relative to B), instead of displacement / dt.
  void set_velocity(const Eigen::Vector3d& relative, Motion& motion) const noexcept {
    motion.has_velocity = true;
    motion.velocity[0] = midway_.along.dot(relative);
    motion.velocity[1] = midway_.aside.dot(relative);
  }

  /// Turns a force of the patch at the end of the step (Response::end, elastic or damper) into a force in
  /// space, N, on A. The force on B is its opposite.
  Eigen::Vector3d force(const double (&tangential)[2]) const noexcept {
    return tangential[0] * now_.along + tangential[1] * now_.aside;
  }
  /// Turns Response::mean into a force in space, N. Its product with the displacement in space is the work of
  /// the step.
  Eigen::Vector3d mean_force(const double (&tangential)[2]) const noexcept {
    return tangential[0] * midway_.along + tangential[1] * midway_.aside;
  }

  /// Turns ExtendedResponse::end, elastic or damper into force and moment on A. `arm` (m) leads from the
  /// point about which moments are taken to the centre of the outline. B gets the opposite.
  Wrench spin_wrench(const double (&in_plane)[3], const Eigen::Vector3d& arm) const noexcept {
    Wrench w = wrench(in_plane[0] * now_.along + in_plane[1] * now_.aside, arm);
    w.tail<3>() += in_plane[2] * now_.normal;
    return w;
  }
  /// Turns the mean force and torque of a step (ExtendedResponse::mean) into force and moment on A, like
  /// spin_wrench().
  Wrench mean_spin_wrench(const double (&in_plane)[3], const Eigen::Vector3d& arm) const noexcept {
    Wrench w = wrench(in_plane[0] * midway_.along + in_plane[1] * midway_.aside, arm);
    w.tail<3>() += in_plane[2] * midway_.normal;
    return w;
  }

  /// Calls visit(field) for each field of a frame, so that a program can save and restore it.
  template <class Frame, class Visit>
  static void visit_fields(Frame& frame, Visit&& visit) {
    for (auto* axes : {&frame.now_, &frame.midway_}) {
      visit(axes->along);
      visit(axes->aside);
      visit(axes->normal);
    }
  }

  /// Returns force and moment of a force that acts at `arm` (m, from the point about which moments are
  /// taken).
  static Wrench wrench(const Eigen::Vector3d& force, const Eigen::Vector3d& arm) noexcept {
    Wrench w;
    w << force, arm.cross(force);
    return w;
  }

 private:
  struct Axes {
    Eigen::Vector3d along = Eigen::Vector3d::UnitX();
    Eigen::Vector3d aside = Eigen::Vector3d::UnitY();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  };

  static bool normalized(const Eigen::Vector3d& v, Eigen::Vector3d& unit) noexcept {
    const double square = v.squaredNorm();
    if (square > 1e-4 && square < 1e4) {
      unit = v / std::sqrt(square);
      return true;
    }
    const double largest = v.cwiseAbs().maxCoeff();  // scales first, because the square of 1e-200 m is zero
    if (!v.allFinite() || !(largest > 0.0)) return false;
    unit = v / largest;
    unit /= std::sqrt(unit.squaredNorm());
    return true;
  }
  static Eigen::Vector3d least_axis(const Eigen::Vector3d& normal) noexcept {
    Eigen::Index least = 0;
    normal.cwiseAbs().minCoeff(&least);
    return Eigen::Vector3d::Unit(least);
  }
  /// Builds right-handed, orthogonal unit axes from a unit normal and a direction `along`, which must not be
  /// parallel to it.
  static Axes make_axes(const Eigen::Vector3d& normal, const Eigen::Vector3d& along) noexcept {
    Axes axes;
    axes.normal = normal;
    normalized(along - normal.dot(along) * normal, axes.along);
    // Repeats the projection once: the first pass leaves a cancellation error of first order when `along` is
    // nearly normal.
    axes.along -= normal.dot(axes.along) * normal;
    axes.along *= 1.5 - 0.5 * axes.along.squaredNorm();
    axes.aside = normal.cross(axes.along);
    return axes;
  }

  void begin(const Eigen::Vector3d& normal, const Eigen::Vector3d& along) noexcept {
    Eigen::Vector3d n, a;
    if (!normalized(normal, n)) return;
    const bool usable = normalized(along, a) && n.cross(a).squaredNorm() > 1e-16;
    midway_ = now_ = make_axes(n, usable ? a : least_axis(n));
  }

  Eigen::Vector3d carried_by(const Quaternion& turn, const Eigen::Vector3d& to) const noexcept {
    if (turn.vec().isZero(0.0))  // body that does not turn, such as the ground
      return detail::carry_along(now_.along, now_.normal, to);
    const Eigen::Vector3d along = turn * now_.along;
    const Eigen::Vector3d from = turn * now_.normal;
    return detail::carry_along(along, from, to);
  }

  /// Returns `from` rotated by half of the rotation from `from` to `to`.
  static Axes half_way(const Axes& from, const Axes& to) noexcept {
    // Measures R, the rotation that takes each axis of `from` to that of `to`: its trace (`cosines`), and its
    // axis times twice the sine of its angle (`sines`).
    const double cosines = from.along.dot(to.along) + from.aside.dot(to.aside) + from.normal.dot(to.normal);
    const Eigen::Vector3d sines =
        from.along.cross(to.along) + from.aside.cross(to.aside) + from.normal.cross(to.normal);
    if (!(cosines > 0.0)) return half_of_large(from, to);
    // Scalar part w of the quaternion of R. The vector part is sines / (4 w).
    const double w = 0.5 * std::sqrt(1.0 + cosines);
    const Eigen::Vector3d u = sines / (4.0 * w);
    const double h = 1.0 + w,
                 // Scales (1 + w, u), the quaternion of half the rotation R, to unit length.
        share = 2.0 / (h * h + u.squaredNorm());
    const auto turned = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
      const Eigen::Vector3d across = u.cross(v);
      return v + share * (h * across + u.cross(across));
    };
    Axes half;
    half.along = turned(from.along);
    half.aside = turned(from.aside);
    half.normal = turned(from.normal);
    return half;
  }
  /// Halves a rotation by more than a right angle, for which the axis that half_way() divides by may be
  /// ill-conditioned.
  static Axes half_of_large(const Axes& from, const Axes& to) noexcept {
    Eigen::Matrix3d rotation = to.along * from.along.transpose();
    rotation += to.aside * from.aside.transpose();
    rotation += to.normal * from.normal.transpose();
    Quaternion half(rotation);
    half.w() += half.w() < 0.0 ? -1.0 : 1.0;
    half.normalize();
    return make_axes((half * from.normal).normalized(), half * from.along);
  }

  Axes now_, midway_;
};

/// Position and orientation of a body in space.
struct BodyPose {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();    ///< centre of the shape that touches, m
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< the body's axes in the world's
  /// Turn of the body in the last step, rad: angular velocity times dt.
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
};

/// Slip of a contact in space, found from where its two bodies are before and after a step. Unlike velocity
/// times dt it is exact for bodies that turn together, at any speed and step length, so a body on a turntable
/// does not drift.
class SlipByPoses {
 public:
  /// Records the bodies before the step. Let A be the round or the smaller body. `both_round` says that the
  /// bodies may roll on each other.
  void record(const BodyPose& a, const BodyPose& b, const Eigen::Vector3d& point,
              bool both_round = false) noexcept {
    apart_ = a.centre - b.centre;
    if (!both_round) apart_ = b.axes.transpose() * apart_;
    arm_a_ = point - a.centre;
    arm_b_ = point - b.centre;
    both_round_ = both_round;
  }
  /// Returns by how much (m) A's surface has slipped over B's at the contact: the displacement of A's centre
  /// as B sees it, and A's turn against B times its arm. The turn is treated as small: taken as a chord it
  /// would make a wheel slip that rolls. If both bodies are round, B turns as much as they turn together.
  Eigen::Vector3d find(const BodyPose& a, const BodyPose& b) const noexcept {
    const Eigen::Vector3d apart = a.centre - b.centre;
    if (!both_round_) return apart - b.axes * apart_ + (a.turn - b.turn).cross(arm_a_);
    const double square = b.turn.squaredNorm();
    const double share = square > 0.0 ? std::clamp(a.turn.dot(b.turn) / square, 0.0, 1.0) : 0.0;
    const Eigen::Vector3d together = share * b.turn;
    return apart - detail::rotation_by(together) * apart_ + (a.turn - together).cross(arm_a_) -
           (b.turn - together).cross(arm_b_);
  }
  /// Vector from A's centre to the contact, m.
  const Eigen::Vector3d& arm() const noexcept { return arm_a_; }
  /// Calls visit(field) for each field of `slip`, so that a program can save and restore it.
  template <class Slip, class Visit>
  static void visit_fields(Slip& slip, Visit&& visit) {
    visit(slip.apart_);
    visit(slip.arm_a_);
    visit(slip.arm_b_);
    visit(slip.both_round_);
  }

 private:
  Eigen::Vector3d apart_ = Eigen::Vector3d::Zero(), arm_a_ = Eigen::Vector3d::Zero(),
                  arm_b_ = Eigen::Vector3d::Zero();  // m
  bool both_round_ = false;
};

/// Normal loads of contacts that a ContactMatcher holds (set_hold()) while an engine lists other points of
/// their surfaces from step to step. Each contact keeps its share of the load of its two surfaces; within
/// some 64 steps the share approaches the load on those points that now have the contact's key.
class SurfaceLoads {
 public:
  /// Loads of all contacts of two surfaces, N, in the step before and in this one. The caller sums them.
  struct Sums {
    std::uint64_t pair = 0;  ///< ContactPoint::pair
    double before = 0.0, now = 0.0;
  };
  void clear() noexcept { sums_.clear(); }
  /// Adds the surfaces of a contact that is held or has joined another one.
  void add(std::uint64_t pair) {
    if (find(pair) < 0) sums_.push_back({pair, 0.0, 0.0});
  }
  /// Returns the index of the surfaces in this list; -1 for a pair that was not added, whose contacts bear
  /// just the load on their points.
  int find(std::uint64_t pair) const noexcept {
    for (std::size_t i = 0; i < sums_.size(); ++i)
      if (sums_[i].pair == pair) return static_cast<int>(i);
    return -1;
  }
  Sums& operator[](int index) noexcept { return sums_[static_cast<std::size_t>(index)]; }
  std::vector<Sums>& all() noexcept { return sums_; }

  /// Returns the normal load of a contact, N, from its load in the step before and the load on its points in
  /// this one. `index`: its surfaces, -1 if they are not in this list. A change in the last digits of an
  /// engine's solver is ignored, so that a patch at rest stays exactly at rest.
  double held_load(int index, double before, double on_its_points) const noexcept {
    double load = on_its_points;
    const Sums none, &of = index < 0 ? none : sums_[static_cast<std::size_t>(index)];
    if (of.before > 0.0) load = (1.0 - follows) * before / of.before * of.now + follows * on_its_points;
    return std::fabs(load - before) > 1e-6 * load ? load : before;
  }
  /// Returns whether a held contact bears more than a thousandth of the load of its surfaces (`index`: at
  /// least 0). One that does not should be released (ContactMatcher::release).
  bool presses(int index, double load) const noexcept {
    return load > 1e-3 * sums_[static_cast<std::size_t>(index)].now;
  }
  /// Returns the load of a new contact of surfaces in this list, which have other contacts already.
  static double first_load(double on_its_points) noexcept { return follows * on_its_points; }

 private:
  static constexpr double follows = 1.0 / 64.0;
  std::vector<Sums> sums_;
};

/// Frames of a pool's contacts, one for each key, kept as long as the contact lasts. Plain data: a rollback
/// restores a copy that was made with the pool's snapshot.
class ContactFrames {
 public:
  /// Makes a frame for every patch of the pool, and one more that all contacts without a patch share.
  explicit ContactFrames(const KeyedPatches& pool) : frames_(pool.capacity() + std::size_t{1}) {}

  /// Carries the frame of a contact to this step's normal (ContactFrame::carry), or makes one if the contact
  /// is new, and returns it. For an extended patch pass the turn of body B twice.
  ContactFrame& carry(const KeyedContact& contact, const Eigen::Vector3d& normal,
                      const Eigen::Vector3d& turn_a = Eigen::Vector3d::Zero(),
                      const Eigen::Vector3d& turn_b = Eigen::Vector3d::Zero()) noexcept {
    ContactFrame& frame = frames_[contact.index];
    if (contact.is_new)
      frame = ContactFrame(normal);
    else
      frame.carry(normal, turn_a, turn_b);
    return frame;
  }
  /// Returns the present frame of the contact with this index (KeyedContact::index).
  ContactFrame& operator[](std::uint32_t index) noexcept { return frames_[index]; }
  /// Adds frames for the patches that KeyedPatches::reserve() added to the pool.
  void reserve(const KeyedPatches& pool) { frames_.resize(pool.capacity() + std::size_t{1}); }
  const ContactFrame& operator[](std::uint32_t index) const noexcept { return frames_[index]; }

 private:
  std::vector<ContactFrame> frames_;
};

}  // namespace bristle
