// The interface between core and kernels for joints: the layout of the numbers of 16 joints, and the input of
// a step. core/joints/JOINTS.md has the equations.
#pragma once

#include <cstdint>

#include "core/include/bristle/joint_parameter.hpp"
#include "core/kernel_table.hpp"

namespace bristle::detail {

/// Bits of an index into JointKernels::step.
enum JointVariant : std::uint32_t {
  joint_loaded = 1,  ///< set if friction depends on the motor's torque or on the outside torque
  joint_drops = 2,   ///< set if the material has a static part of friction
  joint_all_outputs = 4,
  joint_gradients = 8,
  joint_variants = 16
};

/// Indices of the first column of each quantity of a block of 16 joints. A kernel variant has no columns for
/// quantities that it does not use.
struct JointLayout {
  // Columns of constants, which blocks of joints with equal materials share: first those of the material's
  // parameters, with the inverse square of the Stribeck speed, or 0, instead.
  std::uint32_t parameter[joint_parameters] = {};
  /// Column of the least exponent (speed / Stribeck speed)^2, usually 0. For a Stribeck speed of 0 it is 80,
  /// so that the exponential, and with it the static part, vanishes in sliding.
  std::uint32_t least_decay = 0;
  std::uint32_t constants = 0;  ///< number of columns of constants

  // Columns of state, 16 joints each.
  std::uint32_t before = 0;  ///< column of the last angle, rad; NaN = none since reset
  std::uint32_t tips = 1;    ///< columns of the angles at which each bristle would be straight, rad
  /// Columns of flags, one for each bristle: 1 if it slid in the last step and keeps the kinetic limit, 0 if
  /// the static limit is for it.
  std::uint32_t slid = 0;
  std::uint32_t gradients = 0;  ///< columns of the derivatives of each bristle's tip angle by each parameter
  std::uint32_t columns = 0;    ///< number of columns of state

  // Returns whether a variant needs the parameter p. Always inlined, because objects of different instruction
  // sets must not share a function.
  [[gnu::always_inline]] static constexpr bool uses(std::uint32_t p, std::uint32_t variant) {
    const bool of_static = p >= joint_static_base;
    const bool of_load = p != joint_stiffness && p != joint_viscous && p != joint_base &&
                         p != joint_static_base && p != joint_stribeck_speed;
    return (!of_static || (variant & joint_drops) != 0) && (!of_load || (variant & joint_loaded) != 0);
  }
  [[gnu::always_inline]] constexpr JointLayout(std::uint32_t variant, std::uint32_t bristles) {
    for (std::uint32_t p = 0; p < joint_parameters; ++p)
      if (uses(p, variant)) parameter[p] = constants++;
    if ((variant & joint_drops) != 0) least_decay = constants++;
    slid = tips + bristles;
    gradients = slid + ((variant & joint_drops) != 0 ? bristles : 0);
    columns = gradients + ((variant & joint_gradients) != 0 ? bristles * joint_parameters : 0);
  }
};

/// Rows of JointStep::in and out.
enum JointInputRow : std::uint32_t { in_angle, in_speed, in_motor, in_outside, in_writes, joint_inputs };
enum JointOutputRow : std::uint32_t {
  out_torque,
  out_mean,
  out_by_angle,
  out_by_speed,
  out_by_motor,
  out_by_outside,
  out_gradient,
  joint_outputs = out_gradient + joint_parameters
};

/// Input and output of a step of 16 joints. All rows are aligned to 64 bytes.
struct JointStep {
  std::uint32_t bristles;
  const double* share;   ///< share of each bristle in the joint's stiffness
  const double* length;  ///< friction limit of each bristle, relative to the mean limit
  /// Rows of input, joint_inputs of them. The row in_writes is 1 for joints whose state may change and 0 for
  /// the others.
  const double* in;
  double* out;  ///< joint_outputs rows; only kernels with gradients fill those from out_gradient on
  const double* constants;
  double* columns;
};

struct JointKernels {
  void (*step[joint_variants])(const JointStep&);
};

}  // namespace bristle::detail
