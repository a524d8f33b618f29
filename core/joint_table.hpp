// The seam between core and kernels for joints: how the numbers of 16 joints lie, and what a step of them
// takes. The equations are in core/joints/JOINTS.md.
#pragma once

#include <cstdint>

#include "core/include/bristle/joint_parameter.hpp"
#include "core/kernel_table.hpp"

namespace bristle::detail {

/// Bits of the index of a variant of a step.
enum JointVariant : std::uint32_t {
  joint_loaded = 1,  ///< friction depends on a torque
  joint_drops = 2,   ///< there is a static part
  joint_all_outputs = 4,
  joint_gradients = 8,
  joint_variants = 16
};

/// Where the columns of 16 joints begin, counted in columns of 16 numbers. What the variant does not use has
/// none.
struct JointLayout {
  // Constants, which blocks of joints with the same materials share.
  std::uint32_t parameter[joint_parameters] = {};  ///< in place of a Stribeck speed its inverse square, or 0
  std::uint32_t least_decay = 0;  ///< least (speed/stribeck_speed)^2; 80 where that speed is 0
  std::uint32_t constants = 0;    ///< how many
  // Columns of state.
  std::uint32_t before = 0;     ///< last angle, rad; NaN: none since reset
  std::uint32_t tips = 1;       ///< rad, where each bristle would be straight
  std::uint32_t slid = 0;       ///< 1: slid in the last step and holds its kinetic limit only
  std::uint32_t gradients = 0;  ///< of each tip by each parameter
  std::uint32_t columns = 0;    ///< how many

  // Inlined always: objects of different instruction sets must not share a function.
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

/// A step of 16 joints. All rows are aligned to 64 bytes.
struct JointStep {
  std::uint32_t bristles;
  const double* share;   ///< of the stiffness, of each bristle
  const double* length;  ///< limit of each bristle over the mean
  const double* in;      ///< joint_inputs rows; in_writes is 1 where the state changes, else 0
  double* out;           ///< joint_outputs rows; the last ones are filled by kernels with gradients
  const double* constants;
  double* columns;
};
using JointKernel = void (*)(const JointStep&);

}  // namespace bristle::detail
