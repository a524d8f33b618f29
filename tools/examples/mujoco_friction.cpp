#include "mujoco_friction.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

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

/// Refuses what bristles cannot do.
ContactDims checked(const mjModel& model, const ContactDims& dims, bool leave_out_rolling) {
  if (leave_out_rolling) return dims;
  const auto refuse = [&](int object, const char* kind, int id) {
    const char* name = mj_id2name(&model, object, id);
    throw bristle::Error(
        std::string(kind) + " " + std::to_string(id) +
        (name != nullptr && *name != 0 ? " (\"" + std::string(name) + "\")" : "") +
        " has condim 6: bristles resist slip and spin (condim 3 and 4), not rolling. Give it "
        "condim 4, or set FrictionOptions::leave_out_rolling");
  };
  for (std::size_t i = 0; i < dims.geom.size(); ++i)
    if (dims.geom[i] > 4) refuse(mjOBJ_GEOM, "geom", static_cast<int>(i));
  for (std::size_t i = 0; i < dims.pair.size(); ++i)
    if (dims.pair[i] > 4) refuse(mjOBJ_UNKNOWN, "contact pair", static_cast<int>(i));
  return dims;
}
Motion point_motion(const BristleFriction::Contact& contact, const Vector2d& moved) {
  return Motion{contact.patch, {moved[0], moved[1]}, contact.normal_load};
}
bristle::ExtendedMotion disc_motion(const BristleFriction::Contact& contact, const Vector3d& moved) {
  return {contact.patch, {moved[0], moved[1], moved[2]}, contact.normal_load};
}
/// Adds weight * a' b of two rows, of matrices stored by rows, to the lower triangle.
template <class Rows, class Square>
void add_product(double weight, const Rows& a, const Rows& b, Eigen::Index row, Square& to) {
  const double* const left = a.data() + row * a.cols();
  const double* const right = b.data() + row * b.cols();
  for (Eigen::Index i = 0; i < a.cols(); ++i) {
    const double share = weight * left[i];
    double* const line = &to(i, 0);
    for (Eigen::Index j = 0; j <= i; ++j) line[j] += share * right[j];
  }
}

/// Where a contact is, m, in a frame that it hardly moves in however fast the bodies are: at the centre of
/// the smaller geom, with the axes of that geom or, where it is round and may roll, of the world.
Vector3d place_of(const mjModel& model, const mjData& data, const mjContact& contact) {
  const auto radius = [&](int geom) {  // a plane has none
    const double bound = model.geom_rbound[geom];
    return bound > 0.0 ? bound : HUGE_VAL;
  };
  const int geom = radius(contact.geom2) <= radius(contact.geom1) ? contact.geom2 : contact.geom1;
  const Vector3d arm = Map<const Vector3d>(contact.pos) - Map<const Vector3d>(data.geom_xpos + 3 * geom);
  switch (model.geom_type[geom]) {
    case mjGEOM_SPHERE:
    case mjGEOM_CAPSULE:
    case mjGEOM_ELLIPSOID:
    case mjGEOM_CYLINDER:
      return arm;
    default:
      return Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.geom_xmat + 9 * geom).transpose() *
             arm;
  }
}

bool has_spin(const ContactDims& dims) {
  const auto spins = [](int dim) { return dim >= 4; };
  return std::any_of(dims.geom.begin(), dims.geom.end(), spins) ||
         std::any_of(dims.pair.begin(), dims.pair.end(), spins);
}

}  // namespace

ContactDims remove_friction(mjModel& model) {
  ContactDims dims{{model.geom_condim, model.geom_condim + model.ngeom},
                   {model.pair_dim, model.pair_dim + model.npair}};
  std::fill_n(model.geom_condim, model.ngeom, 1);
  std::fill_n(model.pair_dim, model.npair, 1);
  return dims;
}

BristleFriction::BristleFriction(const mjModel& model, const ContactDims& dims,
                                 const bristle::Coefficients& law, const FrictionOptions& options)
    : kinetic_(law.kinetic),
      presliding_length_(law.presliding_length),
      dims_(checked(model, dims, options.leave_out_rolling)),
      points_(batch_, bristle::Material::from_coefficients(law), options.patch,
              bristle::KeyedOptions{}.with_capacity(options.contacts)),
      patches_(batch_),
      matcher_(bristle::MatcherOptions{}.with_capacity(options.contacts).with_reach(options.reach)),
      other_constraints_(VectorXd::Zero(model.nv)),
      applied_(static_cast<std::size_t>(model.nv)) {
  if (has_spin(dims_)) {
    discs_.emplace(patches_, bristle::Material::from_coefficients(law), options.patch,
                   bristle::Outline::disc(1.0, bristle::Pressure::uniform, options.rings),
                   bristle::KeyedOptions{}.with_capacity(options.contacts));
  }
  batch_.warm_up();
}

void BristleFriction::step(const mjModel& model, mjData& data) {
  mj_step1(&model, &data);
  match(model, data);
  mj_fwdActuation(&model, &data);
  mj_fwdAcceleration(&model, &data);
  find_islands(model);
  for (std::size_t i = 0; i < island_count_; ++i) set_jacobian(model, data, islands_[i]);
  begin_new_contacts(model, data);
  for (std::size_t i = 0; i < island_count_; ++i) {
    set_equation(model, data, islands_[i]);
    predict(model.opt.timestep, islands_[i]);
  }
  find_forces(model.opt.timestep);

  std::copy_n(data.qfrc_applied, model.nv, applied_.begin());
  apply_forces(data);
  mj_step2(&model, &data);
  std::copy_n(applied_.begin(), model.nv, data.qfrc_applied);
  move_patches(model, data);
}

void BristleFriction::forget_contacts() {
  matcher_.clear();
  points_.clear();
  if (discs_) discs_->clear();
  contacts_.clear();
  cells_.clear();
  other_constraints_.setZero();
}

/// By MuJoCo's rules: that of the pair if the model lists it, else that of the geom with the higher priority,
/// else the larger one.
int BristleFriction::dim_of(const mjModel& model, const mjContact& contact) const {
  const int a = contact.geom1, b = contact.geom2;
  for (int p = 0; p < model.npair; ++p) {
    const int of[2] = {model.pair_geom1[p], model.pair_geom2[p]};
    if ((of[0] == a && of[1] == b) || (of[0] == b && of[1] == a))
      return dims_.pair[static_cast<std::size_t>(p)];
  }
  const int dim_a = dims_.geom[static_cast<std::size_t>(a)], dim_b = dims_.geom[static_cast<std::size_t>(b)];
  const int priority = model.geom_priority[a] - model.geom_priority[b];
  return priority > 0 ? dim_a : priority < 0 ? dim_b : std::max(dim_a, dim_b);
}

/// Contacts of this step, each with what was known of it a step ago.
void BristleFriction::match(const mjModel& model, const mjData& data) {
  before_.swap(contacts_);
  cells_before_.swap(cells_);
  next_before_ = 0;
  by_key_.clear();
  contacts_.clear();
  cells_.clear();
  found_.clear();
  found_points_.clear();
  for (const mjContact* c = data.contact; c != data.contact + data.ncon; ++c) {
    if (c->efc_address < 0) continue;
    found_.push_back(c);
    const Vector3d place = place_of(model, data, *c);
    found_points_.push_back({pair_of(*c), {place[0], place[1], place[2]}});
  }
  keys_.resize(found_points_.size());
  matcher_.match(found_points_, keys_);
  for (std::size_t i = 0; i < found_.size(); ++i) {
    if (keys_[i] != bristle::no_contact_key)
      take_over(model, data, *found_[i], keys_[i], dim_of(model, *found_[i]));
  }
  points_.end_step();
  if (discs_) discs_->end_step();
}

/// Finds a contact of the previous step by its key, or null. MuJoCo lists contacts mostly in the order of the
/// step before.
const BristleFriction::Contact* BristleFriction::find_before(std::uint64_t key) {
  if (next_before_ < before_.size() && before_[next_before_].key == key) return &before_[next_before_++];
  if (by_key_.empty()) {
    for (std::size_t i = 0; i < before_.size(); ++i) by_key_.emplace_back(before_[i].key, i);
    std::sort(by_key_.begin(), by_key_.end());
  }
  const auto found = std::lower_bound(by_key_.begin(), by_key_.end(), std::make_pair(key, std::size_t{0}));
  if (found == by_key_.end() || found->first != key) return nullptr;
  next_before_ = found->second + 1;
  return &before_[found->second];
}

void BristleFriction::take_over(const mjModel& model, const mjData& data, const mjContact& found,
                                std::uint64_t key, int dim) {
  const Contact* const old = find_before(key);
  const bool known = old != nullptr;
  Contact& contact = known ? contacts_.emplace_back(*old) : contacts_.emplace_back();
  contact.key = key;
  contact.is_new = !known;
  const bool disc = dim >= 4;
  const Map<const Vector3d> normal(found.frame), along(found.frame + 3);
  contact.bodies[0] = model.geom_bodyid[found.geom1];
  contact.bodies[1] = model.geom_bodyid[found.geom2];
  if (known) {
    carry_frame(model, data, normal, disc, contact);
  } else {
    contact.frame = bristle::ContactFrame(normal, along);
  }
  contact.point = Map<const Vector3d>(found.pos);
  contact.scale = found.friction[0] / kinetic_;
  contact.row = found.efc_address;
  contact.patch = {};
  contact.rows = disc ? 3 : 2;
  contact.cells = 0;
  if (disc) {
    const double mu = found.friction[0], torsional = found.friction[2];
    contact.patch = discs_->find_or_add(key);
    contact.cells = patches_.cell_count(contact.patch);
    contact.radius = mu > 0.0 ? 1.5 * torsional / mu : 0.0;
    patches_.set_scale(contact.patch, contact.radius);
  } else if (dim == 3) {
    contact.patch = points_.find_or_add(key);
    contact.cells = contact.patch ? 1 : 0;
  }
  contact.first_cell = cells_.size();
  for (std::size_t k = 0; k < contact.cells; ++k)
    cells_.push_back(known && k < old->cells ? cells_before_[old->first_cell + k] : Cell{});
}

/// Turns that make no difference wait until they do: most contacts rest.
void BristleFriction::carry_frame(const mjModel& model, const mjData& data, const Vector3d& normal, bool disc,
                                  Contact& contact) {
  constexpr double negligible = 1e-6;  // rad
  for (int side = 0; side < 2; ++side)
    contact.turn[side] += model.opt.timestep * Map<const Vector3d>(data.cvel + 6 * contact.bodies[side]);
  if ((normal - contact.frame.normal()).squaredNorm() + contact.turn[0].squaredNorm() +
          contact.turn[1].squaredNorm() <
      negligible * negligible)
    return;
  if (disc)
    contact.frame.carry_with_surface(normal, contact.turn[0]);
  else
    contact.frame.carry(normal, contact.turn[1], contact.turn[0]);
  contact.turn[0].setZero();
  contact.turn[1].setZero();
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

/// Velocity of geom2's body against geom1's at the contact point: rows of slip along the tangent axes and of
/// spin; and along the normal.
void BristleFriction::set_jacobian(const mjModel& model, const mjData& data, Island& island) {
  Eigen::Index rows = 0;
  island.cells = 0;
  for (const std::size_t i : island.contacts) {
    contacts_[i].first_row = rows;
    rows += contacts_[i].rows;
    island.cells += contacts_[i].cells;
  }
  const auto columns = static_cast<Eigen::Index>(island.dofs.size());
  island.jacobian.setZero(rows, columns);
  island.normal_jacobian.setZero(static_cast<Eigen::Index>(island.contacts.size()), columns);
  for (std::size_t c = 0; c < island.contacts.size(); ++c) {
    const Contact& contact = contacts_[island.contacts[c]];
    add_body(model, data, contact, contact.bodies[0], -1.0, static_cast<Eigen::Index>(c), island);
    add_body(model, data, contact, contact.bodies[1], 1.0, static_cast<Eigen::Index>(c), island);
  }
  island.velocity.resize(columns);
  for (std::size_t d = 0; d < island.dofs.size(); ++d)
    island.velocity[static_cast<Eigen::Index>(d)] = data.qvel[island.dofs[d]];
}

/// As mj_jac, without the columns that are zero.
void BristleFriction::add_body(const mjModel& model, const mjData& data, const Contact& contact, int body,
                               double sign, Eigen::Index normal_row, Island& island) {
  while (body > 0 && model.body_dofnum[body] == 0) body = model.body_parentid[body];
  if (body == 0) return;
  Eigen::Matrix<double, 2, 3> axes;
  axes << contact.frame.along().transpose(), contact.frame.aside().transpose();
  const Vector3d normal = contact.frame.normal();
  const Vector3d arm = contact.point - Map<const Vector3d>(data.subtree_com + 3 * model.body_rootid[body]);
  for (int dof = model.body_dofadr[body] + model.body_dofnum[body] - 1; dof >= 0;
       dof = model.dof_parentid[dof]) {
    const Map<const Vector3d> turn(data.cdof + 6 * dof), shift(data.cdof + 6 * dof + 3);
    const Vector3d moved = sign * (shift + turn.cross(arm));
    const Eigen::Index column = column_[static_cast<std::size_t>(dof)];
    island.jacobian.block<2, 1>(contact.first_row, column) += axes * moved;
    island.normal_jacobian(normal_row, column) += normal.dot(moved);
    if (contact.rows == 3) island.jacobian(contact.first_row + 2, column) += sign * normal.dot(turn);
  }
}

/// Gives every new contact the normal load of a step without friction and, where its bodies already slide
/// against each other, the bristles of steady sliding along their slip.
void BristleFriction::begin_new_contacts(const mjModel& model, mjData& data) {
  const auto is_new = [](const Contact& contact) { return contact.is_new && contact.patch; };
  if (std::none_of(contacts_.begin(), contacts_.end(), is_new)) return;
  mj_fwdConstraint(&model, &data);
  motions_.assign(cells_.size(), Motion{});
  responses_.resize(cells_.size());
  for (std::size_t i = 0; i < island_count_; ++i) {
    const Island& island = islands_[i];
    start_slip_.noalias() = island.jacobian * island.velocity;
    for (const std::size_t k : island.contacts) {
      Contact& contact = contacts_[k];
      if (!is_new(contact)) continue;
      contact.normal_load = data.efc_force[contact.row];
      Vector3d moved = Vector3d::Zero();
      moved.head(contact.rows) = start_slip_.segment(contact.first_row, contact.rows);
      const double speed = moved.head<2>().norm() + std::fabs(moved[2]) * contact.radius;
      // After a few lengths the bristles have forgotten how the slide began.
      const bool slides = speed * model.opt.timestep > presliding_length_;
      moved *= slides ? 32.0 * presliding_length_ / speed : 0.0;
      set_motions(contact, moved);
      for (std::size_t cell = contact.first_cell; cell < contact.first_cell + contact.cells; ++cell)
        motions_[cell].has_velocity = 1;  // of zero: dampers stay out of it
    }
  }
  constexpr double no_time = 1e-300;  // s
  batch_.step(no_time, motions_, responses_);
  for (const Contact& contact : contacts_) {
    if (!is_new(contact)) continue;
    for (std::size_t cell = contact.first_cell; cell < contact.first_cell + contact.cells; ++cell)
      cells_[cell].response = responses_[cell];
    if (contact.rows == 3) turn_disc(contact);
  }
}

/// The slip and spin of every contact at the end of the step: one linear solve for the change of velocity, in
/// which the patches' stiffness and damping G act at the end of the step,
///
///   (M + Jn' Jn / R + T Jt' G Jt) (u1 - u0) = T (f + Jn' aref / R + Jt' (E - G Jt u0))
///
/// f: all free forces, and constraints other than contacts as they were a step ago. R, aref: MuJoCo's soft
/// normal force (aref - a) / R of the contacts that carried load. Without it a held body would seem free to
/// turn under friction, which the normal forces forbid: that rings. The cells of a disc are summed up before
/// they meet the Jacobian: their number costs the solve nothing.
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
      fixed_(d, column_[static_cast<std::size_t>(above)]) = *mass++;
  }
  for (std::size_t c = 0; c < island.contacts.size(); ++c) {
    const Contact& contact = contacts_[island.contacts[c]];
    if (!(contact.normal_load > 0.0)) continue;
    const double softness = data.efc_R[contact.row];
    const auto row = static_cast<Eigen::Index>(c);
    add_product(1.0 / softness, island.normal_jacobian, island.normal_jacobian, row, fixed_);
    fixed_right_ +=
        (dt_s * data.efc_aref[contact.row] / softness) * island.normal_jacobian.row(row).transpose();
  }
}

void BristleFriction::predict(double dt_s, const Island& island) {
  const RowMatrix& jacobian = island.jacobian;
  start_slip_.noalias() = jacobian * island.velocity;
  gain_.resize(jacobian.rows(), jacobian.cols());
  pull_.resize(jacobian.rows());
  begin_prediction(dt_s, island);

  // A cell that slips in one pass slips in all later ones.
  for (std::size_t pass = 0; pass <= island.cells; ++pass) {
    if (jacobian.cols() == 6)
      solve<6>(dt_s, jacobian);
    else
      solve<Eigen::Dynamic>(dt_s, jacobian);
    if (!clip(dt_s, island)) break;
  }
  for (const std::size_t i : island.contacts) {
    Contact& c = contacts_[i];
    c.slip.head(c.rows) = slip_.segment(c.first_row, c.rows);
  }
}

/// One free body, the island that there is most of, has its number of unknowns known to the compiler: half
/// the time.
template <int size>
void BristleFriction::solve(double dt_s, const RowMatrix& jacobian) {
  using Square = Eigen::Matrix<double, size, size, Eigen::RowMajor>;
  using Rows = Map<const Eigen::Matrix<double, Eigen::Dynamic, size, Eigen::RowMajor>>;
  const Eigen::Index n = jacobian.cols();
  const Rows along(jacobian.data(), jacobian.rows(), n), gain(gain_.data(), gain_.rows(), n);
  Square system = Map<const Square>(fixed_.data(), n, n);
  Eigen::Matrix<double, size, 1> change = fixed_right_;
  for (Eigen::Index row = 0; row < jacobian.rows(); ++row) {
    add_product(dt_s, along, gain, row, system);
    change += (dt_s * pull_[row]) * along.row(row).transpose();
  }
  Eigen::LLT<Eigen::Ref<Square>>(system).solveInPlace(change);
  slip_ = start_slip_;
  slip_.noalias() += along * change;
}

/// Every cell with the force, stiffness and damping that it has now.
void BristleFriction::begin_prediction(double dt_s, const Island& island) {
  for (const std::size_t i : island.contacts) {
    const Contact& contact = contacts_[i];
    for (std::size_t k = contact.first_cell; k < contact.first_cell + contact.cells; ++k) {
      Cell& cell = cells_[k];
      cell.stiffness = contact.scale * cell.response.stiffness;
      cell.gain = dt_s * cell.stiffness + contact.scale * cell.response.damping;
      cell.elastic = contact.scale * Vector2d(cell.response.elastic[0], cell.response.elastic[1]);
    }
    sum_cells(contact, island);
  }
}

/// Sets a contact's rows of G Jt and of E - G Jt u0.
void BristleFriction::sum_cells(const Contact& contact, const Island& island) {
  const Eigen::Index row = contact.first_row;
  if (contact.rows == 2) {
    const Cell none, &cell = contact.cells == 1 ? cells_[contact.first_cell] : none;
    gain_.middleRows<2>(row) = cell.gain * island.jacobian.middleRows<2>(row);
    pull_.segment<2>(row) = cell.elastic - cell.gain * start_slip_.segment<2>(row);
    return;
  }
  Eigen::Matrix3d gain = Eigen::Matrix3d::Zero();
  Vector3d pull = Vector3d::Zero();
  for (std::size_t k = contact.first_cell; k < contact.first_cell + contact.cells; ++k) {
    const Cell& cell = cells_[k];
    gain(0, 0) += cell.gain;
    gain(2, 2) += cell.gain * cell.at.squaredNorm();
    gain(0, 2) -= cell.gain * cell.at[1];
    gain(1, 2) += cell.gain * cell.at[0];
    pull.head<2>() += cell.elastic;
    pull[2] += cell.at[0] * cell.elastic[1] - cell.at[1] * cell.elastic[0];
  }
  gain(1, 1) = gain(0, 0);
  gain(2, 0) = gain(0, 2);
  gain(2, 1) = gain(1, 2);
  gain_.middleRows<3>(row).noalias() = gain.lazyProduct(island.jacobian.middleRows<3>(row));
  pull_.segment<3>(row) = pull - gain * start_slip_.segment<3>(row);
}

/// Cells beyond their limit pull with the limit instead, and without stiffness. False when there is none.
bool BristleFriction::clip(double dt_s, const Island& island) {
  bool clipped = false;
  for (const std::size_t i : island.contacts) {
    const Contact& contact = contacts_[i];
    const Vector2d slip = slip_.segment<2>(contact.first_row);
    const double spin = contact.rows == 3 ? slip_[contact.first_row + 2] : 0.0;
    bool here = false;
    for (std::size_t k = contact.first_cell; k < contact.first_cell + contact.cells; ++k) {
      Cell& cell = cells_[k];
      if (cell.stiffness == 0.0) continue;
      const Vector2d of_cell = slip + spin * Vector2d(-cell.at[1], cell.at[0]);
      const Vector2d force = cell.elastic - dt_s * cell.stiffness * of_cell;
      const double limit = contact.scale * cell.response.force_limit;
      if (force.norm() <= limit) continue;
      cell.elastic = limit * force.normalized();
      cell.gain = std::max(cell.gain - dt_s * cell.stiffness, 0.0);
      cell.stiffness = 0.0;
      here = true;
    }
    if (here) sum_cells(contact, island);
    clipped = clipped || here;
  }
  return clipped;
}

/// Finds the patches' forces for the predicted slip.
void BristleFriction::find_forces(double dt_s) {
  for (Contact& contact : contacts_) {
    contact.force.setZero();
    if (!contact.patch) continue;
    const Vector3d moved = dt_s * contact.slip;
    if (contact.rows == 2) {
      const Response trial = batch_.find_force(dt_s, point_motion(contact, moved.head<2>()));
      contact.force.head<2>() = contact.scale * Vector2d(trial.end[0], trial.end[1]);
    } else {
      const bristle::ExtendedResponse trial = patches_.find_force(dt_s, disc_motion(contact, moved));
      contact.force = contact.scale * Vector3d(trial.end[0], trial.end[1], trial.end[2]);
    }
  }
}

void BristleFriction::apply_forces(mjData& data) {
  for (std::size_t i = 0; i < island_count_; ++i) {
    const Island& island = islands_[i];
    right_.setZero(island.jacobian.cols());
    for (const std::size_t k : island.contacts) {
      const Contact& c = contacts_[k];
      right_.noalias() +=
          island.jacobian.middleRows(c.first_row, c.rows).transpose().lazyProduct(c.force.head(c.rows));
    }
    for (std::size_t d = 0; d < island.dofs.size(); ++d)
      data.qfrc_applied[island.dofs[d]] += right_[static_cast<Eigen::Index>(d)];
  }
}

/// By what the contacts really slipped, under the normal loads of this step. All patches step in one call.
void BristleFriction::move_patches(const mjModel& model, const mjData& data) {
  const double dt_s = model.opt.timestep;
  other_constraints_ = Map<const VectorXd>(data.qfrc_constraint, model.nv);
  motions_.assign(cells_.size(), Motion{});
  responses_.resize(cells_.size());
  for (std::size_t i = 0; i < island_count_; ++i) {
    Island& island = islands_[i];
    for (std::size_t d = 0; d < island.dofs.size(); ++d)
      island.velocity[static_cast<Eigen::Index>(d)] = data.qvel[island.dofs[d]];
    slip_.noalias() = dt_s * island.jacobian * island.velocity;
    for (std::size_t c = 0; c < island.contacts.size(); ++c) {
      Contact& contact = contacts_[island.contacts[c]];
      const double load = data.efc_force[contact.row];
      for (std::size_t d = 0; d < island.dofs.size(); ++d)
        other_constraints_[island.dofs[d]] -=
            load * island.normal_jacobian(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(d));
      // The solver's last digits flicker: a load that is the same but for these lets a patch at rest rest.
      if (std::fabs(load - contact.normal_load) > 1e-6 * load) contact.normal_load = load;
      Vector3d moved = Vector3d::Zero();
      moved.head(contact.rows) = slip_.segment(contact.first_row, contact.rows);
      if (contact.patch) set_motions(contact, moved);
    }
  }
  batch_.step(dt_s, motions_, responses_);
  for (std::size_t k = 0; k < cells_.size(); ++k) cells_[k].response = responses_[k];
  for (const Contact& contact : contacts_)
    if (contact.rows == 3 && contact.patch) turn_disc(contact);
}

/// Writes the motions of a contact's cells.
void BristleFriction::set_motions(Contact& contact, const Vector3d& moved) {
  if (contact.rows == 2) {
    motions_[contact.first_cell] = point_motion(contact, moved.head<2>());
  } else {
    contact.moved = disc_motion(contact, moved);
    patches_.write_motions({&contact.moved, 1}, {&motions_[contact.first_cell], contact.cells});
  }
}

void BristleFriction::turn_disc(const Contact& contact) {
  bristle::ExtendedResponse sum;
  patches_.read_responses({&contact.moved, 1}, {&responses_[contact.first_cell], contact.cells}, {&sum, 1});
  places_.resize(contact.cells);
  patches_.read_cells(contact.patch, 0.0, contact.normal_load, places_);
  for (std::size_t k = 0; k < contact.cells; ++k)
    cells_[contact.first_cell + k].at = Vector2d(places_[k].position[0], places_[k].position[1]);
}

}  // namespace mujoco_example
