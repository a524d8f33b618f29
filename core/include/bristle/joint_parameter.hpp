// The order of the numbers of a JointMaterial (joint_friction.hpp), which gradients and fits use as row
// indices.
#pragma once

namespace bristle {

/// The numbers of a JointMaterial: rows of JointOutput::gradient.
enum JointParameter : unsigned {
  joint_stiffness,
  joint_viscous,
  joint_base,
  joint_motor_driving,
  joint_motor_driven,
  joint_outside_driving,
  joint_outside_driven,
  joint_static_base,
  joint_static_motor_driving,
  joint_static_motor_driven,
  joint_static_outside_driving,
  joint_static_outside_driven,
  joint_stribeck_speed,
  joint_parameters
};

}  // namespace bristle
