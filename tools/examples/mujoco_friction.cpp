#include "tools/examples/mujoco_friction.hpp"

#include <algorithm>
#include <cmath>

namespace mujoco_example {

using bristle::Motion;
using bristle::Response;
using Eigen::Map;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

std::uint64_t pair_of(const mjContact& contact) {
  return static_cast<std::uint64_t>(contact.geom1) << 32 | static_cast<std::uint32_t>(contact.geom2);
}
bool by_key(const BristleFriction::Contact& a, const BristleFriction::Contact& b) { return a.key < b.key; }
Eigen::Index row_of(std::size_t contact) { return 3 * static_cast<Eigen::Index>(contact); }

}  // namespace

void remove_friction(mjModel& model) {
  std::fill_n(model.geom_condim, model.ngeom, 1);
  std::fill_n(model.pair_dim, model.npair, 1);
}

BristleFriction::BristleFriction(const mjModel& model, const bristle::Coefficients& law,
                                 const FrictionOptions& options)
    : kinetic_(law.kinetic),
      patches_(batch_, bristle::Material::from_coefficients(law), options.patch,
               bristle::KeyedOptions{}.with_capacity(options.contacts)),
      matcher_(bristle::MatcherOptions{}.with_capacity(options.contacts).with_reach(options.reach)),
      other_constraints_(VectorXd::Zero(model.nv)),
      applied_(static_cast<std::size_t>(model.nv)) {
  batch_.warm_up();
  for (RowMatrix& body : point_jacobian_) body.resize(3, model.nv);
}

void BristleFriction::step(const mjModel& model, mjData& data) {
  mj_step1(&model, &data);
  match(model, data);
  mj_fwdActuation(&model, &data);
  mj_fwdAcceleration(&model, &data);
  set_jacobian(model, data);
  predict(model, data);
  find_forces(model.opt.timestep);

  Map<VectorXd> applied(data.qfrc_applied, model.nv);
  std::copy_n(data.qfrc_applied, model.nv, applied_.begin());
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    applied.noalias() += jacobian_.middleRows<2>(row_of(i)).transpose() * contacts_[i].force;
  }
  mj_step2(&model, &data);
  std::copy_n(applied_.begin(), model.nv, data.qfrc_applied);
  move_patches(model, data);
}

void BristleFriction::forget_contacts() {
  matcher_.clear();
  patches_.clear();
  contacts_.clear();
  other_constraints_.setZero();
}

/// Contacts of this step, each with what was known of it a step ago.
void BristleFriction::match(const mjModel& model, const mjData& data) {
  before_.swap(contacts_);
  std::sort(before_.begin(), before_.end(), by_key);
  contacts_.clear();
  found_.clear();
  points_.clear();
  for (const mjContact* c = data.contact; c != data.contact + data.ncon; ++c) {
    if (c->efc_address < 0) continue;
    found_.push_back(c);
    points_.push_back({pair_of(*c), {c->pos[0], c->pos[1], c->pos[2]}});
  }
  keys_.resize(points_.size());
  matcher_.match(points_, keys_);
  for (std::size_t i = 0; i < found_.size(); ++i) {
    if (keys_[i] != bristle::no_contact_key)
      contacts_.push_back(take_over(model, data, *found_[i], keys_[i]));
  }
  patches_.end_step();
}

BristleFriction::Contact BristleFriction::take_over(const mjModel& model, const mjData& data,
                                                    const mjContact& found, std::uint64_t key) {
  Contact contact;
  contact.key = key;
  const Map<const Vector3d> normal(found.frame), along(found.frame + 3);
  const auto old = std::lower_bound(before_.begin(), before_.end(), contact, by_key);
  contact.bodies[0] = model.geom_bodyid[found.geom1];
  contact.bodies[1] = model.geom_bodyid[found.geom2];
  if (old != before_.end() && old->key == key) {
    contact = *old;
    const auto turn = [&](int body) -> Vector3d {
      return model.opt.timestep * Map<const Vector3d>(data.cvel + 6 * body);
    };
    contact.frame.carry(normal, turn(contact.bodies[1]), turn(contact.bodies[0]));
  } else {
    contact.frame = bristle::ContactFrame(normal, along);
  }
  contact.patch = patches_.find_or_add(key);
  contact.point = Map<const Vector3d>(found.pos);
  contact.scale = found.friction[0] / kinetic_;
  contact.row = found.efc_address;
  return contact;
}

/// Three rows a contact: velocity of geom2's body against geom1's at the point, along the tangent axes and
/// the normal.
void BristleFriction::set_jacobian(const mjModel& model, const mjData& data) {
  jacobian_.resize(row_of(contacts_.size()), model.nv);
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const Contact& contact = contacts_[i];
    for (int k = 0; k < 2; ++k) {
      mj_jac(&model, &data, point_jacobian_[k].data(), nullptr, contact.point.data(), contact.bodies[k]);
    }
    Eigen::Matrix3d axes;
    axes << contact.frame.along().transpose(), contact.frame.aside().transpose(),
        contact.frame.normal().transpose();
    point_jacobian_[1] -= point_jacobian_[0];
    jacobian_.middleRows<3>(row_of(i)).noalias() = axes * point_jacobian_[1];
  }
}

/// The slip of every contact at the end of the step: one linear solve for the change of velocity, in which
/// the patches' stiffness and damping G act at the end of the step,
///
///   (M + Jn' Jn / R + T Jt' G Jt) (u1 - u0) = T (f + Jn' aref / R + Jt' (E - G Jt u0))
///
/// f: all free forces, and constraints other than contacts as they were a step ago. R, aref: MuJoCo's soft
/// normal force (aref - a) / R of the contacts that carried load. Without it a held body would seem free to
/// turn under friction, which the normal forces forbid: that rings.
void BristleFriction::predict(const mjModel& model, mjData& data) {
  const double dt_s = model.opt.timestep;
  const Map<const VectorXd> velocity(data.qvel, model.nv), smooth(data.qfrc_smooth, model.nv);
  fixed_.resize(model.nv, model.nv);
  mj_fullM(&model, fixed_.data(), data.qM);
  fixed_right_ = dt_s * (smooth + other_constraints_);
  gain_.setZero(jacobian_.rows());
  elastic_.setZero(jacobian_.rows());
  stiffness_.resize(contacts_.size());
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const Contact& contact = contacts_[i];
    const Response& now = contact.response;
    stiffness_[i] = contact.scale * now.stiffness;
    gain_.segment<2>(row_of(i)).setConstant(dt_s * stiffness_[i] + contact.scale * now.damping);
    elastic_.segment<2>(row_of(i)) << contact.scale * now.elastic[0], contact.scale * now.elastic[1];
    if (contact.normal_load > 0.0) {
      const double softness = data.efc_R[contact.row];
      fixed_gain_ = jacobian_.row(row_of(i) + 2).transpose();
      fixed_.noalias() += (1.0 / softness) * fixed_gain_ * fixed_gain_.transpose();
      fixed_right_ += (dt_s * data.efc_aref[contact.row] / softness) * fixed_gain_;
    }
  }

  // What lets go in a pass stays so.
  for (std::size_t pass = 0; pass <= contacts_.size(); ++pass) {
    system_ = fixed_;
    system_.noalias() += dt_s * jacobian_.transpose() * gain_.asDiagonal() * jacobian_;
    slip_.noalias() = jacobian_ * velocity;
    right_ = fixed_right_;
    right_.noalias() += dt_s * jacobian_.transpose() * (elastic_ - gain_.cwiseProduct(slip_));
    factor_.compute(system_);
    right_ = factor_.solve(right_);
    slip_.noalias() += jacobian_ * right_;
    if (!clip(dt_s)) break;
  }
  for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_[i].slip = slip_.segment<2>(row_of(i));
}

/// Patches beyond their limit pull with the limit instead, and without stiffness. False when there is none.
bool BristleFriction::clip(double dt_s) {
  bool clipped = false;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (stiffness_[i] == 0.0) continue;
    const Vector2d force =
        elastic_.segment<2>(row_of(i)) - dt_s * stiffness_[i] * slip_.segment<2>(row_of(i));
    const double limit = contacts_[i].scale * contacts_[i].response.force_limit;
    if (force.norm() <= limit) continue;
    elastic_.segment<2>(row_of(i)) = limit * force.normalized();
    gain_.segment<2>(row_of(i)).array() -= dt_s * stiffness_[i];
    gain_.segment<2>(row_of(i)) = gain_.segment<2>(row_of(i)).cwiseMax(0.0);
    stiffness_[i] = 0.0;
    clipped = true;
  }
  return clipped;
}

/// What the patches will answer to the slip predicted.
void BristleFriction::find_forces(double dt_s) {
  for (Contact& contact : contacts_) {
    const Vector2d d = dt_s * contact.slip;
    const Response trial = batch_.find_force(dt_s, Motion{contact.patch, {d[0], d[1]}, contact.normal_load});
    contact.force = contact.scale * Vector2d(trial.end[0], trial.end[1]);
  }
}

/// By what the contacts really slipped, under the normal loads of this step.
void BristleFriction::move_patches(const mjModel& model, const mjData& data) {
  const double dt_s = model.opt.timestep;
  const Map<const VectorXd> velocity(data.qvel, model.nv);
  other_constraints_ = Map<const VectorXd>(data.qfrc_constraint, model.nv);
  motions_.clear();
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    Contact& contact = contacts_[i];
    const double load = data.efc_force[contact.row];
    other_constraints_ -= load * jacobian_.row(row_of(i) + 2).transpose();
    // The solver's last digits flicker: a load that is the same but for these lets a patch at rest rest.
    if (std::fabs(load - contact.normal_load) > 1e-6 * load) contact.normal_load = load;
    const Vector2d d = dt_s * jacobian_.middleRows<2>(row_of(i)) * velocity;
    motions_.push_back(Motion{contact.patch, {d[0], d[1]}, contact.normal_load});
  }
  responses_.resize(motions_.size());
  batch_.step(dt_s, motions_, responses_);
  for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_[i].response = responses_[i];
}

}  // namespace mujoco_example
