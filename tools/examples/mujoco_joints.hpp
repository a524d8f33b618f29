// The friction of bristles in MuJoCo's hinges, in place of `frictionloss`: by the torque of the motor and of
// all else, with presliding, without creep. An adapter to copy and to change; MuJoCo 2.2.
//
//   mujoco_example::BristleJoints joints(*model, {shoulder, elbow}, {&gear, 1});
//   while (...) joints.step(*model, *data);          // in place of mj_step(model, data)
//
// The order of a step. After mj_step1, mj_fwdActuation and mj_fwdAcceleration, Newton's method on J M^-1 J^T
// and JointFriction::find_torque finds the speeds at the end of the step. The torques are in qfrc_applied
// during mj_step2. Then the bristles step by the angles that the joints really have. `frictionloss` of these
// joints should be 0.
//
// The motor's torque is qfrc_actuator, the outside torque what is left of the smooth forces (gravity,
// Coriolis, springs, qfrc_applied). Not covered: contacts, which the prediction does not see, and RK4
// (mj_step2 has none).
#pragma once

#include <vector>

#include <mujoco/mujoco.h>
#include <Eigen/Core>
#include <bristle/joint_friction.hpp>

namespace mujoco_example {

class BristleJoints {
 public:
  /// Makes the friction of the hinges or slides with these ids. Joint i gets the material i modulo the number
  /// of materials. Throws bristle::Error.
  BristleJoints(const mjModel& model, const std::vector<int>& joints,
                bristle::Span<const bristle::JointMaterial> materials,
                const bristle::JointOptions& options = {});

  /// Makes one step of the model with friction; call it in place of mj_step. Forces that the caller put into
  /// qfrc_applied act, and stay there.
  void step(const mjModel& model, mjData& data);
  /// Makes all bristles straight at the present angles of the joints. Call it after mj_resetData or after
  /// joints were moved by hand.
  void forget() {
    batch_.reset();
    begun_ = false;
  }

  /// Returns the friction torque of each joint in the last step, N m.
  const Eigen::VectorXd& torque() const { return torque_; }

 private:
  std::vector<int> dofs_, addresses_;
  bristle::JointFriction batch_;
  Eigen::VectorXd angle_, speed_, motor_, outside_, torque_, by_angle_, by_speed_;
  /// Matrix J M^-1 J^T: change of the joints' speeds by an impulse on each joint.
  Eigen::MatrixXd inverse_inertia_;
  std::vector<double> unit_, column_;
  bool begun_ = false;
};

}  // namespace mujoco_example
