// The friction of robots' joints: gearboxes whose friction grows with the torque that they transmit, differs
// between driving and being driven, falls with speed, and sticks without creep.
//
//   bristle::JointMaterial gear;
//   gear.stiffness = 400.0;        // N m/rad
//   gear.kinetic.base = 0.05;      // N m
//   gear.kinetic.motor[bristle::joint_driving] = 0.12;
//   gear.kinetic.motor[bristle::joint_driven] = 0.30;
//   gear.static_part.base = 0.02;
//   bristle::JointFriction joints(12, {&gear, 1});
//   joints.step({angle, speed, motor, outside}, {torque});
//
// A joint is a row of springs that slide at their limits (`slide`, core/MODEL.md, section 30). `redraw` and
// `keep` are not offered: their peak ends with the first turn. Units: N m, rad. See core/joints/JOINTS.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "bristle/export.hpp"
#include "bristle/joint_parameter.hpp"
#include "bristle/patch.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/span.hpp"

namespace bristle {

/// Index of JointLosses::motor and outside. A motor drives in the direction of its torque; a joint that moves
/// against its motor's torque, or without one, is driven.
enum JointDirection : unsigned { joint_driving = 0, joint_driven = 1 };

/// Friction torque of a joint, N m: base + motor |motor torque| + outside |outside torque|.
struct JointLosses {
  double base = 0.0;               ///< constant part of the friction, N m, 0 to 1e9
  double motor[2] = {0.0, 0.0};    ///< share of the motor's torque that is lost, by JointDirection, 0 to 100
  double outside[2] = {0.0, 0.0};  ///< share of the outside torque that is lost, by JointDirection, 0 to 100
};

/// Friction and elasticity of a joint, measured at its output side. JointParameter names its numbers in their
/// order.
struct JointMaterial {
  double stiffness = 0.0;   ///< stiffness of the joint while it sticks, N m/rad, 1e-9 to 1e12
  double viscous = 0.0;     ///< viscous friction, N m s/rad, 0 to 1e9
  JointLosses kinetic;      ///< torque that a sliding joint bears at high speed
  JointLosses static_part;  ///< additional torque that a joint bears while it sticks
  /// Speed, rad/s, 0 or 1e-9 to 1e9, over which the static part fades. In sliding the share
  /// exp(-(speed/stribeck_speed)^2) of the static part is left; with a stribeck_speed of 0 nothing is left.
  double stribeck_speed = 0.0;
};

static_assert(sizeof(JointMaterial) == joint_parameters * sizeof(double), "one number a parameter");

struct JointOptions {
  /// Number of bristles of each joint, 1 to 64. Against infinitely many, the error of first loading falls
  /// with the square of the number: 0.21 % of the friction at 8, 0.013 % at 32; after a reversal it is twice
  /// that (test_joints).
  int bristles = 8;
  double spread = 0.4;     ///< coefficient of variation of the bristles' limits (lognormal), 0 to 3
  bool gradients = false;  ///< Whether JointOutput::gradient may be asked for: more memory, slower steps.
};

/// Input of a step: arrays of the caller with one number for each joint. An empty `speed`, `motor` or
/// `outside` counts as zeros.
struct JointInput {
  Span<const double> angle = {};    ///< angle of the joint, rad, -1e6 to 1e6, not wrapped
  Span<const double> speed = {};    ///< speed of the joint, rad/s, -1e9 to 1e9
  Span<const double> motor = {};    ///< torque of the motor at the output, N m, -1e12 to 1e12
  Span<const double> outside = {};  ///< torque of gravity and contacts, N m, -1e12 to 1e12
};

/// Output of a step: arrays of the caller with one number for each joint. An empty array is not computed.
/// Derivatives are those of `torque` as a function of this step's input; they jump where a bristle begins or
/// ends to slide.
struct JointOutput {
  Span<double> torque = {};  ///< torque of friction ON the joint, at the end of the step, N m
  /// Torque averaged over the step, N m. The energy that the joint takes is -mean x (angle - last angle).
  Span<double> mean = {};
  Span<double> by_angle = {};  ///< derivative of the torque by the angle, N m/rad, 0 or negative
  /// Derivative of the torque by the speed, N m s/rad; positive where friction falls with speed.
  Span<double> by_speed = {};
  Span<double> by_motor = {};    ///< derivative by the motor torque, N m per N m
  Span<double> by_outside = {};  ///< derivative by the outside torque, N m per N m
  Span<Status> status = {};      ///< Status::ok or Status::bad_input for each joint

  /// Derivatives of `torque` by the numbers of the material, for fits: joint_parameters rows, each with one
  /// number per joint. They include the effect on all steps since reset. Needs JointOptions::gradients.
  Span<double> gradient = {};
};

/// Joints, stepped together. A joint's bits do not depend on the number of threads, the instruction set, or
/// the other joints.
///
/// Thread rule: one side (PatchBatch). Nothing allocates but the constructor. A step never throws
/// or locks, and waits for its own workers only.
class BRISTLE_API JointFriction {
 public:
  /// Makes joints, all with straight bristles; joint i is of materials[i % materials.size()]. Throws
  /// bristle::Error for values out of range.
  JointFriction(std::size_t joints, Span<const JointMaterial> materials, const JointOptions& options = {},
                const BatchOptions& batch = {});
  ~JointFriction();
  JointFriction(JointFriction&&) noexcept;
  JointFriction& operator=(JointFriction&&) noexcept;

  /// Moves all joints to their angles. At the angle of a joint's first step after reset its bristles are
  /// straight. A joint whose input is NaN or out of range keeps its state, and all its outputs are 0.
  /// The whole step is refused with Status::bad_input if an array has another length than joint_count()
  /// (gradient: joint_parameters times that), or if a gradient is asked for that the options do not allow: no
  /// joint moves, and nothing but `status` is written.
  StepReport step(const JointInput& in, const JointOutput& out) noexcept;
  /// Computes the output of step() without changing the state. For implicit solvers.
  StepReport find_torque(const JointInput& in, const JointOutput& out) noexcept;

  void reset() noexcept;                   ///< straightens the bristles of all joints at their next angles
  bool reset(std::size_t joint) noexcept;  ///< resets one joint; false if there is no such joint

  /// Returns a hash of one joint's state, 0 if there is no such joint.
  std::uint64_t state_hash(std::size_t joint) const noexcept;
  std::uint64_t state_hash() const noexcept;
  std::size_t state_size() const noexcept;
  /// Writes the state of all joints. Returns the bytes written, 0 if `to` is too small.
  std::size_t save_state(Span<std::byte> to) const noexcept;
  /// Restores a saved state into a batch with the same joints and options. Throws bristle::Error if the state
  /// does not fit or is damaged, and leaves the joints unchanged; does not compare materials.
  void restore_state(Span<const std::byte> from);

  std::size_t joint_count() const noexcept;
  std::size_t memory_bytes() const noexcept;
  int threads() const noexcept;
  const char* isa() const noexcept;

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace bristle
