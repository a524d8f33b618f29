#include "mujoco_joints.hpp"

#include <Eigen/LU>
#include <bristle/error.hpp>
#include <limits>

namespace mujoco_example {

using Eigen::Index;
using Eigen::VectorXd;

BristleJoints::BristleJoints(const mjModel& model, const std::vector<int>& joints,
                             bristle::Span<const bristle::JointMaterial> materials,
                             const bristle::JointOptions& options)
    : batch_(joints.size(), materials, options) {
  for (const int joint : joints) {
    if (joint < 0 || joint >= model.njnt ||
        (model.jnt_type[joint] != mjJNT_HINGE && model.jnt_type[joint] != mjJNT_SLIDE))
      throw bristle::Error("BristleJoints: every joint must be a hinge or a slide of the model");
    dofs_.push_back(model.jnt_dofadr[joint]);
    addresses_.push_back(model.jnt_qposadr[joint]);
  }
  const auto n = static_cast<Index>(joints.size());
  for (VectorXd* x : {&angle_, &speed_, &motor_, &outside_, &torque_, &by_angle_, &by_speed_}) x->setZero(n);
  inverse_inertia_.resize(n, n);
  unit_.resize(static_cast<std::size_t>(model.nv));
  column_ = unit_;
}

void BristleJoints::step(const mjModel& model, mjData& data) {
  mj_step1(&model, &data);
  mj_fwdActuation(&model, &data);
  mj_fwdAcceleration(&model, &data);
  const double dt = model.opt.timestep;
  const auto n = static_cast<Index>(dofs_.size());
  VectorXd angle(n), speed(n), acceleration(n);
  for (Index i = 0; i < n; ++i) {
    const int dof = dofs_[static_cast<std::size_t>(i)];
    angle[i] = data.qpos[addresses_[static_cast<std::size_t>(i)]];
    speed[i] = data.qvel[dof];
    acceleration[i] = data.qacc_smooth[dof];
    motor_[i] = data.qfrc_actuator[dof];
    outside_[i] = data.qfrc_passive[dof] + data.qfrc_applied[dof] - data.qfrc_bias[dof];
    unit_[static_cast<std::size_t>(dof)] = 1.0;
    mj_solveM(&model, &data, column_.data(), unit_.data(), 1);
    unit_[static_cast<std::size_t>(dof)] = 0.0;
    for (Index k = 0; k < n; ++k)
      inverse_inertia_(k, i) = column_[static_cast<std::size_t>(dofs_[static_cast<std::size_t>(k)])];
  }
  const bristle::JointInput in{angle_, speed_, motor_, outside_};
  const bristle::JointOutput out{torque_, {}, by_angle_, by_speed_};
  angle_ = angle;
  speed_ = speed;
  if (!begun_) batch_.step(in, out);  // makes the bristles straight at the joint's first angle
  begun_ = true;
  // Solves by Newton's method, and halves a change of speed that makes the error larger: the torque of a
  // stiff joint changes from one limit to the other within a small angle, which a full step may jump over.
  double least = std::numeric_limits<double>::infinity();
  VectorXd change = VectorXd::Zero(n);
  for (int round = 0; round < 60; ++round) {
    angle_ = angle + dt * speed_;
    batch_.find_torque(in, out);
    const VectorXd left = speed_ - speed - dt * (acceleration + inverse_inertia_ * torque_);
    const double error = left.cwiseAbs().maxCoeff();
    if (error < 1e-15) break;
    if (error > least) {
      change *= 0.5;
      speed_ += change;
      continue;
    }
    least = error;
    // Takes only friction that rises with speed into Newton's matrix. Friction that falls with speed could
    // make the matrix singular.
    const VectorXd slope = dt * by_angle_ + by_speed_.cwiseMin(0.0);
    const Eigen::MatrixXd matrix =
        Eigen::MatrixXd::Identity(n, n) - dt * inverse_inertia_ * slope.asDiagonal().toDenseMatrix();
    change = matrix.partialPivLu().solve(left);
    speed_ -= change;
  }
  for (Index i = 0; i < n; ++i) data.qfrc_applied[dofs_[static_cast<std::size_t>(i)]] += torque_[i];
  mj_step2(&model, &data);
  for (Index i = 0; i < n; ++i) {
    const int dof = dofs_[static_cast<std::size_t>(i)];
    data.qfrc_applied[dof] -= torque_[i];
    angle_[i] = data.qpos[addresses_[static_cast<std::size_t>(i)]];
    speed_[i] = data.qvel[dof];
  }
  batch_.step(in, {});
}

}  // namespace mujoco_example
