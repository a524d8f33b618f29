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

/// Adds weight * row' row to the lower triangle.
template <class Matrix>
void add_square(const Matrix& rows, Eigen::Index row, double weight, Matrix& to) {
  const double* const a = &rows(row, 0);
  for (Eigen::Index i = 0; i < rows.cols(); ++i) {
    const double share = weight * a[i];
    double* const line = &to(i, 0);
    for (Eigen::Index j = 0; j <= i; ++j) line[j] += share * a[j];
  }
}

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
}

void BristleFriction::step(const mjModel& model, mjData& data) {
  mj_step1(&model, &data);
  match(model, data);
  mj_fwdActuation(&model, &data);
  mj_fwdAcceleration(&model, &data);
  find_islands(model);
  for (std::size_t i = 0; i < island_count_; ++i) {
    set_jacobian(model, data, islands_[i]);
    set_equation(model, data, islands_[i]);
    predict(model, data, islands_[i]);
  }
  find_forces(model.opt.timestep);

  std::copy_n(data.qfrc_applied, model.nv, applied_.begin());
  for (std::size_t i = 0; i < island_count_; ++i) {
    const Island& island = islands_[i];
    right_.setZero(island.jacobian.cols());
    for (std::size_t c = 0; c < island.contacts.size(); ++c)
      right_.noalias() +=
          island.jacobian.middleRows<2>(row_of(c)).transpose() * contacts_[island.contacts[c]].force;
    for (std::size_t d = 0; d < island.dofs.size(); ++d)
      data.qfrc_applied[island.dofs[d]] += right_[static_cast<Eigen::Index>(d)];
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
  if (!std::is_sorted(before_.begin(), before_.end(), by_key))
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
    if (keys_[i] != bristle::no_contact_key) take_over(model, data, *found_[i], keys_[i]);
  }
  patches_.end_step();
}

void BristleFriction::take_over(const mjModel& model, const mjData& data, const mjContact& found,
                                std::uint64_t key) {
  Contact& contact = contacts_.emplace_back();
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
}

/// The tree at the top of those that touch this one.
int BristleFriction::top_of(int tree) {
  while (tree_[static_cast<std::size_t>(tree)] != tree) {
    int& above = tree_[static_cast<std::size_t>(tree)];
    above = tree_[static_cast<std::size_t>(above)];
    tree = above;
  }
  return tree;
}

void BristleFriction::find_islands(const mjModel& model) {
  const auto bodies = static_cast<std::size_t>(model.nbody);
  tree_.resize(bodies);
  for (int body = 0; body < model.nbody; ++body) tree_[static_cast<std::size_t>(body)] = body;
  const auto moves = [&](int body) { return model.body_weldid[body] != 0; };
  const auto root = [&](int body) { return model.body_rootid[body]; };
  for (const Contact& contact : contacts_) {
    const auto [a, b] = contact.bodies;
    if (moves(a) && moves(b)) tree_[static_cast<std::size_t>(top_of(root(a)))] = top_of(root(b));
  }
  island_of_.assign(bodies, -1);
  island_count_ = 0;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const auto [a, b] = contacts_[i].bodies;
    if (!moves(a) && !moves(b)) continue;
    int& island = island_of_[static_cast<std::size_t>(top_of(root(moves(a) ? a : b)))];
    if (island < 0) {
      island = static_cast<int>(island_count_++);
      if (islands_.size() < island_count_) islands_.emplace_back();
      islands_[static_cast<std::size_t>(island)].dofs.clear();
      islands_[static_cast<std::size_t>(island)].contacts.clear();
    }
    islands_[static_cast<std::size_t>(island)].contacts.push_back(i);
  }
  column_.resize(static_cast<std::size_t>(model.nv));
  for (int dof = 0; dof < model.nv; ++dof) {
    const int island = island_of_[static_cast<std::size_t>(top_of(root(model.dof_bodyid[dof])))];
    if (island < 0) continue;
    std::vector<int>& dofs = islands_[static_cast<std::size_t>(island)].dofs;
    column_[static_cast<std::size_t>(dof)] = static_cast<int>(dofs.size());
    dofs.push_back(dof);
  }
}

/// Three rows a contact: velocity of geom2's body against geom1's at the point, along the tangent axes and
/// the normal.
void BristleFriction::set_jacobian(const mjModel& model, const mjData& data, Island& island) {
  island.jacobian.setZero(row_of(island.contacts.size()), static_cast<Eigen::Index>(island.dofs.size()));
  for (std::size_t c = 0; c < island.contacts.size(); ++c) {
    const Contact& contact = contacts_[island.contacts[c]];
    Eigen::Matrix3d axes;
    axes << contact.frame.along().transpose(), contact.frame.aside().transpose(),
        contact.frame.normal().transpose();
    for (int k = 0; k < 2; ++k) {
      int body = contact.bodies[k];
      while (body > 0 && model.body_dofnum[body] == 0) body = model.body_parentid[body];
      if (body == 0) continue;
      const Vector3d arm =
          contact.point - Map<const Vector3d>(data.subtree_com + 3 * model.body_rootid[body]);
      // As mj_jac, without the columns that are zero.
      for (int dof = model.body_dofadr[body] + model.body_dofnum[body] - 1; dof >= 0;
           dof = model.dof_parentid[dof]) {
        const Map<const Vector3d> turn(data.cdof + 6 * dof), shift(data.cdof + 6 * dof + 3);
        const Vector3d moved = axes * (shift + turn.cross(arm));
        island.jacobian.block<3, 1>(row_of(c), column_[static_cast<std::size_t>(dof)]) +=
            k == 0 ? -moved : moved;
      }
    }
  }
  island.velocity.resize(static_cast<Eigen::Index>(island.dofs.size()));
  for (std::size_t d = 0; d < island.dofs.size(); ++d)
    island.velocity[static_cast<Eigen::Index>(d)] = data.qvel[island.dofs[d]];
}

/// The slip of every contact at the end of the step: one linear solve for the change of velocity, in which
/// the patches' stiffness and damping G act at the end of the step,
///
///   (M + Jn' Jn / R + T Jt' G Jt) (u1 - u0) = T (f + Jn' aref / R + Jt' (E - G Jt u0))
///
/// f: all free forces, and constraints other than contacts as they were a step ago. R, aref: MuJoCo's soft
/// normal force (aref - a) / R of the contacts that carried load. Without it a held body would seem free to
/// turn under friction, which the normal forces forbid: that rings.
void BristleFriction::set_equation(const mjModel& model, const mjData& data, const Island& island) {
  const double dt_s = model.opt.timestep;
  const auto size = static_cast<Eigen::Index>(island.dofs.size());
  fixed_.setZero(size, size);
  fixed_right_.resize(size);
  for (Eigen::Index d = 0; d < size; ++d) {
    const int dof = island.dofs[static_cast<std::size_t>(d)];
    fixed_right_[d] = dt_s * (data.qfrc_smooth[dof] + other_constraints_[dof]);
    const double* mass = data.qM + model.dof_Madr[dof];
    for (int above = dof; above >= 0; above = model.dof_parentid[above])
      fixed_(d, column_[static_cast<std::size_t>(above)]) = *mass++;  // the lower triangle
  }
  const Eigen::Index rows = row_of(island.contacts.size());
  gain_.setZero(rows);
  elastic_.setZero(rows);
  stiffness_.resize(island.contacts.size());
  for (std::size_t c = 0; c < island.contacts.size(); ++c) {
    const Contact& contact = contacts_[island.contacts[c]];
    const Response& now = contact.response;
    stiffness_[c] = contact.scale * now.stiffness;
    gain_.segment<2>(row_of(c)).setConstant(dt_s * stiffness_[c] + contact.scale * now.damping);
    elastic_.segment<2>(row_of(c)) << contact.scale * now.elastic[0], contact.scale * now.elastic[1];
    if (contact.normal_load > 0.0) {
      const double softness = data.efc_R[contact.row];
      const auto normal = island.jacobian.row(row_of(c) + 2);
      add_square(island.jacobian, row_of(c) + 2, 1.0 / softness, fixed_);
      fixed_right_ += (dt_s * data.efc_aref[contact.row] / softness) * normal.transpose();
    }
  }
}

void BristleFriction::predict(const mjModel& model, const mjData&, const Island& island) {
  const double dt_s = model.opt.timestep;
  const RowMatrix& jacobian = island.jacobian;
  // What lets go in a pass stays so.
  for (std::size_t pass = 0; pass <= island.contacts.size(); ++pass) {
    system_ = fixed_;
    right_ = fixed_right_;
    slip_.noalias() = jacobian * island.velocity;
    for (Eigen::Index row = 0; row < jacobian.rows(); ++row) {
      if (row % 3 == 2) continue;  // normals are in fixed_
      const auto along = jacobian.row(row);
      add_square(jacobian, row, dt_s * gain_[row], system_);
      right_ += (dt_s * (elastic_[row] - gain_[row] * slip_[row])) * along.transpose();
    }
    factor_.compute(system_);
    factor_.solveInPlace(right_);
    slip_.noalias() += jacobian * right_;
    if (!clip(dt_s, island)) break;
  }
  for (std::size_t c = 0; c < island.contacts.size(); ++c)
    contacts_[island.contacts[c]].slip = slip_.segment<2>(row_of(c));
}

/// Patches beyond their limit pull with the limit instead, and without stiffness. False when there is none.
bool BristleFriction::clip(double dt_s, const Island& island) {
  bool clipped = false;
  for (std::size_t c = 0; c < island.contacts.size(); ++c) {
    if (stiffness_[c] == 0.0) continue;
    const Contact& contact = contacts_[island.contacts[c]];
    const Vector2d force =
        elastic_.segment<2>(row_of(c)) - dt_s * stiffness_[c] * slip_.segment<2>(row_of(c));
    const double limit = contact.scale * contact.response.force_limit;
    if (force.norm() <= limit) continue;
    elastic_.segment<2>(row_of(c)) = limit * force.normalized();
    gain_.segment<2>(row_of(c)).array() -= dt_s * stiffness_[c];
    gain_.segment<2>(row_of(c)) = gain_.segment<2>(row_of(c)).cwiseMax(0.0);
    stiffness_[c] = 0.0;
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
  other_constraints_ = Map<const VectorXd>(data.qfrc_constraint, model.nv);
  motions_.resize(contacts_.size());
  for (std::size_t k = 0; k < contacts_.size(); ++k)
    motions_[k] = Motion{contacts_[k].patch, {0.0, 0.0}, 0.0};
  for (std::size_t i = 0; i < island_count_; ++i) {
    Island& island = islands_[i];
    for (std::size_t d = 0; d < island.dofs.size(); ++d)
      island.velocity[static_cast<Eigen::Index>(d)] = data.qvel[island.dofs[d]];
    for (std::size_t c = 0; c < island.contacts.size(); ++c) {
      Contact& contact = contacts_[island.contacts[c]];
      const double load = data.efc_force[contact.row];
      for (std::size_t d = 0; d < island.dofs.size(); ++d)
        other_constraints_[island.dofs[d]] -=
            load * island.jacobian(row_of(c) + 2, static_cast<Eigen::Index>(d));
      // The solver's last digits flicker: a load that is the same but for these lets a patch at rest rest.
      if (std::fabs(load - contact.normal_load) > 1e-6 * load) contact.normal_load = load;
      const Vector2d d = dt_s * island.jacobian.middleRows<2>(row_of(c)) * island.velocity;
      motions_[island.contacts[c]] = Motion{contact.patch, {d[0], d[1]}, contact.normal_load};
    }
  }
  responses_.resize(motions_.size());
  batch_.step(dt_s, motions_, responses_);
  for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_[i].response = responses_[i];
}

}  // namespace mujoco_example
