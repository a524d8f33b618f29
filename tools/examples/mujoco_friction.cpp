#include "mujoco_friction.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <thread>
#include <utility>

namespace mujoco_example {

using bristle::Motion;
using bristle::Response;
using Eigen::Map;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr std::uint32_t held_contacts = 4;  // largest number of contacts kept for each pair of surfaces
// Values of Contact::joined that are no indices: for a contact with a patch of its own, and for one without
// friction, because its surfaces have parted where their patch was.
constexpr int own_patch = -1, no_friction = -2;

std::uint64_t pair_of(const mjContact& contact) {
  return static_cast<std::uint64_t>(contact.geom1) << 32 | static_cast<std::uint32_t>(contact.geom2);
}

/// Returns the condims of all contacts. Throws if bristles cannot give one of them, or if the integrator is
/// RK4, for which MuJoCo has no step in two halves.
ContactDims checked(const mjModel& model, const ContactDims& dims, bool leave_out_rolling) {
  if (model.opt.integrator == mjINT_RK4)
    throw bristle::Error("the integrator is RK4, which bristles lack: choose Euler or implicit");
  const auto check = [&](int dim, int object, const char* kind, int id) {
    if (dim == 1 || dim == 3 || dim == 4 || (dim == 6 && leave_out_rolling)) return;
    const char* name = mj_id2name(&model, object, id);
    throw bristle::Error(std::string(kind) + " " + std::to_string(id) +
                         (name != nullptr && *name != 0 ? " (\"" + std::string(name) + "\")" : "") +
                         " has condim " + std::to_string(dim) +
                         ": bristles resist slip and spin (condim 3 and 4), not rolling. Give it "
                         "condim 4, or set FrictionOptions::leave_out_rolling for 6");
  };
  for (std::size_t i = 0; i < dims.geom.size(); ++i)
    check(dims.geom[i], mjOBJ_GEOM, "geom", static_cast<int>(i));
  for (std::size_t i = 0; i < dims.pair.size(); ++i)
    check(dims.pair[i], mjOBJ_UNKNOWN, "contact pair", static_cast<int>(i));
  return dims;
}
Motion point_motion(const BristleFriction::Contact& contact, const Vector2d& moved) {
  return Motion{contact.patch, {moved[0], moved[1]}, contact.normal_load};
}
bristle::ExtendedMotion disc_motion(const BristleFriction::Contact& contact, const Vector3d& moved) {
  return {contact.patch, {moved[0], moved[1], moved[2]}, contact.normal_load};
}
/// Calls visit(other, mass) for each entry of the inertia matrix in the row of a degree of freedom, up to the
/// diagonal.
template <class Visit>
void visit_masses(const mjModel& model, const mjData& data, int dof, const Visit& visit) {
#if mjVERSION_HEADER < 3011000
  const double* mass = data.qM + model.dof_Madr[dof];
  for (int above = dof; above >= 0; above = model.dof_parentid[above]) visit(above, *mass++);
#else
  const int first = model.M_rowadr[dof];
  for (int k = first; k < first + model.M_rownnz[dof]; ++k) visit(model.M_colind[k], data.M[k]);
#endif
}

/// Returns the smaller of two geoms; a plane counts as the larger one.
int smaller_geom(const mjModel& model, int geom1, int geom2) {
  const auto radius = [&](int geom) {  // m; a plane has none and counts as larger
    const double bound = model.geom_rbound[geom];
    return bound > 0.0 ? bound : HUGE_VAL;
  };
  return radius(geom2) <= radius(geom1) ? geom2 : geom1;
}
int smaller_geom(const mjModel& model, const mjContact& contact) {
  return smaller_geom(model, contact.geom1, contact.geom2);
}
bool is_round(const mjModel& model, int geom) {
  const int type = model.geom_type[geom];
  return type == mjGEOM_SPHERE || type == mjGEOM_CAPSULE || type == mjGEOM_ELLIPSOID ||
         type == mjGEOM_CYLINDER;
}

/// Returns axes, at the centre of a geom, in which the contacts of the geom hardly move even if it is fast:
/// its own axes, or the world's if it is round and may roll. Contact points are matched in them from step to
/// step.
Eigen::Matrix3d axes_of(const mjModel& model, const mjData& data, int geom) {
  if (is_round(model, geom)) return Eigen::Matrix3d::Identity();
  return Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.geom_xmat + 9 * geom);
}
Map<const Vector3d> centre_of(const mjData& data, int geom) {
  return Map<const Vector3d>(data.geom_xpos + 3 * geom);
}
Map<const Vector3d> spin_of(const mjData& data, int body) {  // rad/s
  return Map<const Vector3d>(data.cvel + 6 * body);
}
/// Returns the last degree of freedom that moves a body; -1 for a body that cannot move.
int last_dof(const mjModel& model, int body) {
  while (body > 0 && model.body_dofnum[body] == 0) body = model.body_parentid[body];
  return body > 0 ? model.body_dofadr[body] + model.body_dofnum[body] - 1 : -1;
}
/// Returns whether a degree of freedom moves a free body along an axis of the world.
bool shifts(const mjModel& model, int dof) {
  const int joint = model.dof_jntid[dof];
  return model.jnt_type[joint] == mjJNT_FREE && dof < model.jnt_dofadr[joint] + 3;
}
std::size_t tree_of(const mjModel& model, int dof) {
  return static_cast<std::size_t>(model.body_rootid[model.dof_bodyid[dof]]);
}
bool reads_forces(int sensor_type) { return sensor_type == mjSENS_FORCE || sensor_type == mjSENS_TORQUE; }
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
      tree_start_(static_cast<std::size_t>(model.nbody)),
      friction_(VectorXd::Zero(model.nv)),
      other_constraints_(friction_) {
  surface_velocity_ = options.surface_velocity;
  matcher_.set_hold(held_contacts);
  if (has_spin(dims_))
    discs_.emplace(patches_, bristle::Material::from_coefficients(law), options.patch,
                   bristle::Outline::disc(1.0, bristle::Pressure::uniform, options.rings),
                   bristle::KeyedOptions{}.with_capacity(options.contacts));
  if (options.rolling) {
    const bristle_example::RollingBed& bed = *options.rolling;
    beds_.emplace(bed_batch_, bed.material, bed.shape, bed.options,
                  bristle::KeyedOptions{}.with_capacity(options.contacts));
    bed_friction_ = bed.material.kinetic_friction;
  }
  for (int dof = static_cast<int>(model.nv) - 1; dof >= 0; --dof) tree_start_[tree_of(model, dof)] = dof;
  batch_.warm_up();
}

void BristleFriction::step(const mjModel& model, mjData& data) {
  prepare(model, data);
  mj_step2(&model, &data);
  correct_sensors(model, data);
  end_step(model, data);
}

void BristleFriction::forward(const mjModel& model, mjData& data) {
  prepare(model, data);
  mj_fwdActuation(&model, &data);
  mj_fwdAcceleration(&model, &data);
  mj_fwdConstraint(&model, &data);
#if mjVERSION_HEADER >= 3011000
  data.flg_rnepost = 0;  // the forces on bodies that sensors read are those of an earlier state
#endif
  mj_sensorAcc(&model, &data);
  correct_sensors(model, data);
}

/// Runs a step as far as the friction force, and adds that force to the passive forces. (Among applied forces
/// it would keep MuJoCo 3 from putting bodies to sleep.)
void BristleFriction::prepare(const mjModel& model, mjData& data) {
  mj_step1(&model, &data);
  mj_fwdActuation(&model, &data);
  mj_fwdAcceleration(&model, &data);
  find_friction(model, data);
  Map<VectorXd>(data.qfrc_passive, model.nv) += friction_;
}

/// Adds the friction of each contact to the forces on both of its bodies (xfrc_applied).
void BristleFriction::add_wrenches(const mjModel&, mjData& data) const {
  for (const Contact& contact : contacts_) {
    const Vector3d force = contact.frame.force({contact.force[0], contact.force[1]});
    for (int side = 0; side < 2; ++side) {
      const int body = contact.bodies[side];
      const Vector3d arm = contact.point - Map<const Vector3d>(data.xipos + 3 * body);
      Map<Vector3d> on(data.xfrc_applied + 6 * body), about(data.xfrc_applied + 6 * body + 3);
      const double sign = side == 0 ? -1.0 : 1.0;
      on += sign * force;
      about += sign * (arm.cross(force) + contact.force[2] * contact.frame.normal());
    }
  }
}

void BristleFriction::correct_sensors(const mjModel& model, mjData& data) const {
  if (std::none_of(model.sensor_type, model.sensor_type + model.nsensor, reads_forces)) return;
  const std::vector<double> applied(data.xfrc_applied, data.xfrc_applied + 6 * model.nbody);
  add_wrenches(model, data);
  mj_rnePostConstraint(&model, &data);
  std::copy(applied.begin(), applied.end(), data.xfrc_applied);
  for (int i = 0; i < model.nsensor; ++i) {
    if (!reads_forces(model.sensor_type[i])) continue;
#if mjVERSION_HEADER >= 3011000
    if (model.sensor_delay[i] > 0.0) continue;
#endif
    const int site = model.sensor_objid[i], body = model.site_bodyid[site];
    mjtNum local[6];
    mju_transformSpatial(local, data.cfrc_int + 6 * body, 1, data.site_xpos + 3 * site,
                         data.subtree_com + 3 * model.body_rootid[body], data.site_xmat + 9 * site);
    const double most = model.sensor_cutoff[i] > 0.0 ? model.sensor_cutoff[i] : HUGE_VAL;
    for (int a = 0; a < 3; ++a)
      data.sensordata[model.sensor_adr[i] + a] =
          std::clamp(local[model.sensor_type[i] == mjSENS_FORCE ? 3 + a : a], -most, most);
  }
}

void BristleFriction::contact_force(const mjModel& model, const mjData& data, int id,
                                    mjtNum (&force)[6]) const {
  mj_contactForce(&model, &data, id, force);
  const int row = data.contact[id].efc_address;
  const Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> axes(data.contact[id].frame);
  for (const Contact& contact : contacts_) {
    if (row < 0 || contact.row != row) continue;
    Map<Vector3d>(force, 3) += axes * contact.frame.force({contact.force[0], contact.force[1]});
    force[3] += contact.force[2];
  }
}

namespace {

/// Head of a saved state. It has no padding, so that equal states have equal bytes.
struct StateHead {
  std::uint32_t capacity, contacts, slipped, moved;
};
struct Writer {
  BristleFriction::State& to;
  template <class T>
  void operator()(const T& value) {
    const auto* const from = reinterpret_cast<const std::byte*>(&value);
    to.insert(to.end(), from, from + sizeof value);
  }
  template <class Kept>
  void part(const Kept& kept) {
    const std::size_t at = to.size();
    to.resize(at + kept.state_size());
    kept.save_state({to.data() + at, to.size() - at});
  }
};
struct Reader {
  const BristleFriction::State& from;
  std::size_t at = 0;
  const std::byte* take(std::size_t bytes) {
    if (from.size() - at < bytes) throw bristle::Error("a state of BristleFriction is cut short");
    at += bytes;
    return from.data() + at - bytes;
  }
  template <class T>
  void operator()(T& value) {
    const std::byte* const bytes = take(sizeof value);
    std::copy_n(bytes, sizeof value, reinterpret_cast<std::byte*>(&value));
  }
};

}  // namespace

/// Calls visit(field) for each field of a contact that the next step reads.
template <class AnyContact, class Visit>
void BristleFriction::visit_fields(AnyContact& contact, Visit& visit) {
  visit(contact.key), visit(contact.pair), visit(contact.patch.value), visit(contact.bed.value);
  bristle::ContactFrame::visit_fields(contact.frame, visit);
  bristle::SlipByPoses::visit_fields(contact.slip, visit);
  for (auto* const vector : {&contact.turn[0], &contact.turn[1], &contact.point, &contact.force,
                             &contact.position, &contact.moved_by_velocity})
    visit(*vector);
  visit(contact.surface), visit(contact.arc), visit(contact.normal_load), visit(contact.scale);
  visit(contact.cells);
  for (auto* const number : {&contact.bodies[0], &contact.bodies[1], &contact.geoms[0], &contact.geoms[1],
                             &contact.row, &contact.surfaces})
    visit(*number);
  for (auto* const flag : {&contact.is_disc, &contact.is_listed, &contact.is_asleep}) visit(*flag);
}

template <class AnyFriction, class Visit>
void BristleFriction::visit_parts(AnyFriction& of, Visit&& visit) {
  visit(of.patches_);
  visit(of.points_);
  visit(of.bed_batch_);
  visit(of.matcher_);
  if (of.discs_) visit(*of.discs_);
  if (of.beds_) visit(*of.beds_);
}

BristleFriction::State BristleFriction::save() const {
  State to;
  save(to);
  return to;
}

void BristleFriction::save(State& to) const {
  to.clear();
  Writer write{to};
  const auto keeps = [](const Contact& contact) { return contact.patch || contact.bed; };
  const auto kept = std::count_if(contacts_.begin(), contacts_.end(), keeps);
  write(StateHead{points_.capacity(), static_cast<std::uint32_t>(kept), slipped_, moved_});
  for (const double force : other_constraints_) write(force);
  for (const Contact& contact : contacts_) {
    if (!keeps(contact)) continue;
    visit_fields(contact, write);
    // Leaves out the answers of patches that have yet to step, because the step will replace them.
    for (std::size_t k = contact.first_cell; !slipped_ && k < contact.first_cell + contact.cells; ++k) {
      write(cells_[k].response);
      write(cells_[k].at);
    }
  }
  const auto add = [&](const auto& kept_beside) {
    write(kept_beside.state_size());
    write.part(kept_beside);
  };
  visit_parts(*this, add);
}

std::size_t BristleFriction::largest_state() const {
  State one;
  Writer write{one};
  const Contact contact;
  visit_fields(contact, write);
  constexpr std::size_t of_matcher = 68 * 2, other = 256;
  std::size_t parts = 0;
  visit_parts(*this, [&](const auto& part) { parts += part.state_size(); });
  return parts + points_.capacity() * (one.size() + of_matcher) +
         sizeof(double) * static_cast<std::size_t>(other_constraints_.size()) + other;
}

std::uint32_t BristleFriction::capacity_of(const State& state) {
  StateHead head{};
  Reader{state}(head);
  return head.capacity;
}

void BristleFriction::restore(const State& state) {
  try {
    read(state);
  } catch (const bristle::Error&) {
    forget_contacts();
    throw;
  }
}

void BristleFriction::read(const State& state) {
  Reader reader{state};
  StateHead head{};
  reader(head);
  reserve(head.capacity);
  for (double& force : other_constraints_) reader(force);
  contacts_.clear();
  cells_.clear();
  dofs_.clear();
  std::vector<Cell> cells;
  for (std::uint32_t i = 0; i < head.contacts; ++i) {
    Contact& contact = contacts_.emplace_back();
    visit_fields(contact, reader);
    contact.is_new = false;
    const auto names = [](int id, std::size_t count) {
      return id >= 0 && static_cast<std::size_t>(id) < count;
    };
    for (int side = 0; side < 2; ++side)
      if (!names(contact.bodies[side], tree_start_.size()) || !names(contact.geoms[side], dims_.geom.size()))
        throw bristle::Error("a state of BristleFriction is of another model");
    for (std::size_t k = 0; head.slipped == 0 && k < contact.cells; ++k) {
      reader(cells.emplace_back().response);
      reader(cells.back().at);
    }
  }
  const auto restore_part = [&](auto& kept) {
    std::size_t bytes = 0;
    reader(bytes);
    const std::byte* const from = reader.take(bytes);
    kept.restore_state({from, bytes});
  };
  visit_parts(*this, restore_part);
  for (Contact& contact : contacts_) add_cells(nullptr, contact);
  if (head.slipped == 0 && cells.size() == cells_.size()) cells_ = cells;
  slipped_ = head.slipped != 0;
  moved_ = head.moved != 0;
  column_.clear();
}

const VectorXd& BristleFriction::find_friction(const mjModel& model, mjData& data) {
  if (slipped_) step_patches(model, data);
  match(model, data);
  begin_new_contacts(model, data);
  number_dofs(model);
  for (const Contact& contact : contacts_)
    for (std::size_t k = contact.first_cell; k < contact.first_cell + contact.cells; ++k)
      cells_[k].model = {cells_[k].response, model.opt.timestep, contact.normal_load, contact.scale};
  guess_beds(model, data);
  // Repeats the linear solve until no more cells slip. A cell that slips in one pass slips in all later ones.
  do {
    solve(model, data);
  } while (release_cells());
  find_forces(model, data);
  return friction_;
}

void BristleFriction::forget_contacts() {
  matcher_.clear();
  points_.clear();
  if (discs_) discs_->clear();
  if (beds_) beds_->clear();
  contacts_.clear();
  cells_.clear();
  dofs_.clear();
  slipped_ = false;
  other_constraints_.setZero();
}

/// Returns the condim of a contact (which motions it resists) by MuJoCo's rules: that of the listed pair if
/// the model lists one; otherwise that of the geom of higher priority, or of equal priorities the larger one.
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

/// Finds the patch of each contact: the one that it had in the step before.
void BristleFriction::match(const mjModel& model, const mjData& data) {
  before_.swap(contacts_);
  cells_before_.swap(cells_);
  next_before_ = 0;
  by_key_.clear();
  dofs_before_.swap(dofs_);
  contacts_.clear();
  cells_.clear();
  dofs_.clear();
  levers_.clear();
  found_.clear();
  found_points_.clear();
  found_normals_.clear();
  near_[0].first = near_[1].first = -1;
  // Leaves out contacts of soft bodies (flexes), which MuJoCo 3 has.
  for (const mjContact* c = data.contact; c != data.contact + data.ncon; ++c)
    if (c->efc_address >= 0 && c->geom1 >= 0 && c->geom2 >= 0) list(model, data, *c);
  list_asleep(model, data);
  keys_.resize(found_points_.size());
  reserve(found_points_.size());
  matcher_.match(found_points_, keys_, found_normals_);
  reserve(found_points_.size() + matcher_.held().size());
  for (std::size_t i = 0; i < found_.size(); ++i)
    if (keys_[i] != bristle::no_contact_key && !matcher_.has_joined(i))
      take_over(model, data, *found_[i], keys_[i], nullptr);
  for (const bristle::HeldContact& held : matcher_.held()) hold(model, data, held);
  for (std::size_t i = 0; i < found_.size(); ++i)
    if (matcher_.has_joined(i)) join(model, data, *found_[i], keys_[i]);
  for (std::size_t i = found_.size(); i < keys_.size(); ++i) keep_asleep(keys_[i]);
  find_surfaces();
  points_.end_step();
  if (discs_) discs_->end_step();
  if (beds_) beds_->end_step();
  moved_ = false;
}

/// Adds a contact to the list of points that are matched with the contacts of the step before.
void BristleFriction::list(const mjModel& model, const mjData& data, const mjContact& found) {
  found_.push_back(&found);
  const int geom = smaller_geom(model, found);
  Vector3d position = Map<const Vector3d>(found.pos) - centre_of(data, geom),
           normal = Map<const Vector3d>(found.frame);
  if (!is_round(model, geom)) {
    const Eigen::Matrix3d to_geom = axes_of(model, data, geom).transpose();
    position = to_geom * position;
    normal = to_geom * normal;
  }
  found_points_.push_back({pair_of(found), {position[0], position[1], position[2]}});
  found_normals_.insert(found_normals_.end(), normal.data(), normal.data() + 3);
}

/// Adds contacts of sleeping bodies, which MuJoCo does not list, to the points that are matched, so that they
/// keep their patches.
void BristleFriction::list_asleep([[maybe_unused]] const mjModel& model,
                                  [[maybe_unused]] const mjData& data) {
#if mjVERSION_HEADER >= 3011000
  if (data.ntree_awake == model.ntree) return;
  const auto rests = [&](int body) {
    const int tree = model.body_treeid[body];
    return tree < 0 || data.tree_asleep[tree] >= 0;
  };
  const std::size_t listed = found_points_.size();
  for (const Contact& contact : before_) {
    const auto same_pair = [&](const bristle::ContactPoint& point) { return point.pair == contact.pair; };
    const auto end = found_points_.begin() + static_cast<std::ptrdiff_t>(listed);
    if ((!contact.patch && !contact.bed) || !rests(contact.bodies[0]) || !rests(contact.bodies[1]) ||
        std::any_of(found_points_.begin(), end, same_pair))
      continue;
    const int a = static_cast<int>(contact.pair >> 32), b = static_cast<int>(contact.pair & 0xffffffffu);
    const Vector3d normal =
        axes_of(model, data, smaller_geom(model, a, b)).transpose() * contact.frame.normal();
    found_points_.push_back({contact.pair, {contact.position[0], contact.position[1], contact.position[2]}});
    found_normals_.insert(found_normals_.end(), normal.data(), normal.data() + 3);
  }
#endif
}

/// Keeps a contact of sleeping bodies with its patch, in the state in which the bodies fell asleep.
void BristleFriction::keep_asleep(std::uint64_t key) {
  const Contact* const old = find_before(key);
  if (!old) return;
  Contact& contact = contacts_.emplace_back(*old);
  if (contact.bed)
    beds_->find_or_add(key);
  else
    (contact.is_disc ? *discs_ : points_).find_or_add(key);
  contact.is_asleep = true;
  contact.is_new = false;
  contact.surfaces = -1;
  contact.row = -1;
  contact.arc.setZero();
  contact.moved_by_velocity.setZero();
  contact.first_dof = dofs_.size();
  contact.dofs = 0;
  add_cells(old, contact);
}

/// Makes room for a number of contacts. Allocates only if it is larger than ever before.
void BristleFriction::reserve(std::size_t contacts) {
  while (contacts > points_.capacity()) {
    const std::uint32_t room = 2 * points_.capacity();
    matcher_.reserve(room);
    points_.reserve(room);
    if (discs_) discs_->reserve(room);
    if (beds_) beds_->reserve(room);
  }
}

/// Adds a contact that has only a normal force. The patch of another contact of the same surfaces, which has
/// the key `key`, carries its load.
void BristleFriction::join(const mjModel& model, const mjData& data, const mjContact& found,
                           std::uint64_t key) {
  const auto it = std::find_if(contacts_.begin(), contacts_.end(),
                               [&](const Contact& contact) { return contact.key == key; });
  const int joined = it == contacts_.end() ? no_friction : static_cast<int>(it - contacts_.begin());
  Contact& contact = contacts_.emplace_back();
  contact.key = bristle::no_contact_key;
  contact.pair = pair_of(found);
  contact.is_new = false;
  contact.joined = joined;
  contact.bodies[0] = model.geom_bodyid[found.geom1];
  contact.bodies[1] = model.geom_bodyid[found.geom2];
  contact.frame =
      bristle::ContactFrame(Map<const Vector3d>(found.frame), Map<const Vector3d>(found.frame + 3));
  contact.point = Map<const Vector3d>(found.pos);
  contact.row = found.efc_address;
  contact.first_cell = cells_.size();
  contact.normal_load = found.dist < 0.0 ? 1.0 : 0.0;  // positive: its normal force counts in the prediction
  set_levers(model, data, nullptr, contact);
}

/// Keeps a contact whose pair MuJoCo lists at other points only, if both surfaces still touch at its point.
void BristleFriction::hold(const mjModel& model, const mjData& data, const bristle::HeldContact& held) {
  constexpr double steepest = 2e-3;  // angle between the surfaces beyond which they part there, rad
  const Contact* const old = find_before(held.key);
  const auto same_pair = [&](const mjContact* c) {
    return pair_of(*c) == held.contact.pair &&
           (!old || old->frame.normal().dot(Map<const Vector3d>(c->frame)) > 0.7);
  };
  const auto listed = std::find_if(found_.begin(), found_.end(), same_pair);
  if (old && old->patch && listed != found_.end()) {
    const int geom = smaller_geom(model, **listed);
    const Vector3d at =
        centre_of(data, geom) + axes_of(model, data, geom) * Map<const Vector3d>(held.contact.point);
    const Vector3d apart = at - Map<const Vector3d>((*listed)->pos);
    if (std::fabs(apart.dot(Map<const Vector3d>((*listed)->frame))) <= steepest * apart.norm())
      return take_over(model, data, **listed, held.key, &at);
  }
  matcher_.release(held.key);
}

/// Finds the contacts that MuJoCo now lists at other points of the same two surfaces, and the patches for new
/// points.
void BristleFriction::find_surfaces() {
  surfaces_.clear();
  for (const Contact& contact : contacts_)
    if (!contact.is_asleep && (!contact.is_listed || contact.joined != own_patch))
      surfaces_.add(contact.pair);
  for (Contact& contact : contacts_) contact.surfaces = surfaces_.find(contact.pair);
}

/// Sets the normal load of each contact, from MuJoCo's normal forces of this step.
void BristleFriction::share_loads(const mjData& data) {
  for (bristle::SurfaceLoads::Sums& of : surfaces_.all()) of.before = of.now = 0.0;
  for (Contact& contact : contacts_) contact.on_points = contact.row >= 0 ? data.efc_force[contact.row] : 0.0;
  for (Contact& contact : contacts_) {
    if (contact.surfaces < 0) continue;
    surfaces_[contact.surfaces].now += contact.on_points;
    if (contact.joined == own_patch)
      surfaces_[contact.surfaces].before += contact.normal_load;
    else if (contact.joined >= 0)
      contacts_[static_cast<std::size_t>(contact.joined)].on_points += contact.on_points;
  }
  for (Contact& contact : contacts_) {
    if (contact.joined != own_patch || contact.is_asleep) continue;
    contact.normal_load = surfaces_.held_load(contact.surfaces, contact.normal_load, contact.on_points);
    if (!contact.is_listed && !surfaces_.presses(contact.surfaces, contact.normal_load))
      matcher_.release(contact.key);
  }
}

/// Looks up a contact of the previous step by its key; null if there is none. Tries the next one first,
/// because MuJoCo mostly keeps the order.
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

/// Adds a contact with the patch that it had in the step before, or with a fresh one. `held_at`: its place
/// (m) if `found` is another contact of the same surfaces.
void BristleFriction::take_over(const mjModel& model, const mjData& data, const mjContact& found,
                                std::uint64_t key, const Vector3d* held_at) {
  const Contact* const old = find_before(key);
  const bool known = old != nullptr;
  Contact& contact = known ? contacts_.emplace_back(*old) : contacts_.emplace_back();
  const int dim = dim_of(model, found);
  contact.key = key;
  contact.pair = pair_of(found);
  contact.is_new = !known;
  contact.is_listed = held_at == nullptr;
  contact.is_asleep = false;
  contact.bodies[0] = model.geom_bodyid[found.geom1];
  contact.bodies[1] = model.geom_bodyid[found.geom2];
  const bool rounds[2] = {is_round(model, found.geom1), is_round(model, found.geom2)};
  const int small = smaller_geom(model, found);
  contact.geoms[0] = rounds[0] == rounds[1] ? small : rounds[0] ? found.geom1 : found.geom2;
  contact.geoms[1] = found.geom1 + found.geom2 - contact.geoms[0];
  const bool rolls = beds_ && dim >= 3 && is_round(model, small);
  contact.bed = rolls ? beds_->find_or_add(key) : bristle::BedId{};
  const bool disc = contact.is_disc = dim >= 4 && !rolls;
  const Map<const Vector3d> normal(found.frame), along(found.frame + 3);
  if (known) {
    carry_frame(model, data, normal, contact);
  } else {
    contact.frame = bristle::ContactFrame(normal, along);
  }
  contact.point = held_at ? *held_at : Map<const Vector3d>(found.pos);
  const Eigen::Matrix3d axes = axes_of(model, data, small);
  if (known && old->surfaces >= 0 && !held_at) {
    // Keeps the height of a contact point whose height changes by less than 0.1 mm from step to step. The
    // body is only rocking then, and would walk if its friction followed.
    constexpr double hop = 1e-4;  // m
    const double up = normal.dot(contact.point - centre_of(data, small) - axes * contact.position);
    if (std::fabs(up) < hop) contact.point -= up * normal;
  }
  contact.position = axes.transpose() * (contact.point - centre_of(data, small));
  contact.slip.record(pose_of(model, data, contact, 0), pose_of(model, data, contact, 1), contact.point,
                      rounds[0] && rounds[1]);
  contact.scale = found.friction[0] / (rolls ? bed_friction_ : kinetic_);
  contact.row = held_at ? -1 : found.efc_address;
  contact.patch = {};
  if (disc) {
    const double mu = found.friction[0], torsional = found.friction[2];
    contact.patch = discs_->find_or_add(key);
    contact.radius = mu > 0.0 ? 1.5 * torsional / mu : 0.0;
    patches_.set_scale(contact.patch, contact.radius);
  } else if (dim == 3 && !rolls) {
    contact.patch = points_.find_or_add(key);
  }
  add_cells(old, contact);
  set_levers(model, data, old, contact);
}

/// Appends the cells of a contact's patch; `old`: this contact in the step before, or null.
void BristleFriction::add_cells(const Contact* old, Contact& contact) {
  const std::size_t before = old ? old->cells : 0, first = old ? old->first_cell : 0;
  contact.cells = !contact.patch ? 0 : contact.is_disc ? patches_.cell_count(contact.patch) : 1;
  contact.first_cell = cells_.size();
  for (std::size_t k = 0; k < contact.cells; ++k)
    cells_.push_back(k < before ? cells_before_[first + k] : Cell{});
}

/// Returns the pose of the geom on one side of a contact. Successive contacts mostly have the same geoms, so
/// the last answers are kept to save time.
const bristle::BodyPose& BristleFriction::pose_of(const mjModel& model, const mjData& data,
                                                  const Contact& contact, int side) {
  const int geom = contact.geoms[side];
  auto& [known, pose] = near_[side];
  if (known != geom) {
    pose.centre = centre_of(data, geom);
    pose.axes = Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(data.geom_xmat + 9 * geom);
    pose.turn = model.opt.timestep * spin_of(data, model.geom_bodyid[geom]);
    known = geom;
  }
  return pose;
}

/// Turns the axes of the contact with the bodies. Small turns are only added up until they matter, which
/// saves time, since most contacts rest.
void BristleFriction::carry_frame(const mjModel& model, const mjData& data, const Vector3d& normal,
                                  Contact& contact) {
  constexpr double negligible = 1e-6;  // rad
  for (int side = 0; side < 2 && moved_; ++side)
    contact.turn[side] += model.opt.timestep * spin_of(data, contact.bodies[side]);
  if ((normal - contact.frame.normal()).squaredNorm() + contact.turn[0].squaredNorm() +
          contact.turn[1].squaredNorm() <
      negligible * negligible)
    return;
  if (contact.bed)  // the contact's axes move with the body that does not roll
    contact.frame.carry_with_surface(
        normal, contact.turn[contact.bodies[0] == model.geom_bodyid[contact.geoms[0]] ? 1 : 0]);
  else if (contact.is_disc)
    contact.frame.carry_with_surface(normal, contact.turn[0]);
  else
    contact.frame.carry(normal, contact.turn[1], contact.turn[0]);
  contact.turn[0].setZero();
  contact.turn[1].setZero();
}

/// Computes the Jacobian of a contact (as mj_jac, without columns of zeros) and its velocity. `old`: the same
/// contact in the step before, or null.
void BristleFriction::set_levers(const mjModel& model, const mjData& data, const Contact* old,
                                 Contact& contact) {
  const int last[2] = {last_dof(model, contact.bodies[0]), last_dof(model, contact.bodies[1])};
  contact.first_dof = dofs_.size();
  if (old && old->dofs > 0) {
    const auto from = dofs_before_.begin() + static_cast<std::ptrdiff_t>(old->first_dof);
    dofs_.insert(dofs_.end(), from, from + static_cast<std::ptrdiff_t>(old->dofs));
  } else {
    for (const int end : last)
      for (int dof = end; dof >= 0; dof = model.dof_parentid[dof]) dofs_.push_back(dof);
    const auto begin = dofs_.begin() + static_cast<std::ptrdiff_t>(contact.first_dof);
    std::sort(begin, dofs_.end());
    dofs_.erase(std::unique(begin, dofs_.end()), dofs_.end());
  }
  contact.dofs = dofs_.size() - contact.first_dof;
  levers_.resize(4 * dofs_.size(), 0.0);
  const int* const first = dofs_.data() + contact.first_dof;
  double* const levers = levers_.data() + 4 * contact.first_dof;
  const std::size_t count = contact.dofs;
  const Vector3d axes[3] = {contact.frame.normal(), contact.frame.along(), contact.frame.aside()};
  const bool in_line = count > 0 && static_cast<std::size_t>(dofs_.back() - *first) + 1 == count;
  for (int side = 0; side < 2; ++side) {
    if (last[side] < 0) continue;
    const double sign = side == 0 ? -1.0 : 1.0;
    const int root = model.body_rootid[contact.bodies[side]];
    const Vector3d arm = contact.point - Map<const Vector3d>(data.subtree_com + 3 * root);
    for (int dof = last[side]; dof >= 0; dof = model.dof_parentid[dof]) {
      double* const to =
          levers + (in_line ? dof - *first : std::lower_bound(first, first + count, dof) - first);
      if (shifts(model, dof)) {  // the last of three shifts along the axes of the world, the root of its tree
        for (std::size_t a = 0; a < 3; ++a)
          for (int i = 0; i < 3; ++i) (to + a * count - 2)[i] += sign * axes[a][i];
        break;
      }
      const Map<const Vector3d> turn(data.cdof + 6 * dof), shift(data.cdof + 6 * dof + 3);
      const Vector3d moved = sign * (shift + turn.cross(arm));
      for (std::size_t a = 0; a < 3; ++a) to[a * count] += axes[a].dot(moved);
      to[3 * count] += sign * axes[0].dot(turn);
    }
  }
  contact.start.setZero();
  for (std::size_t k = 0; k < count; ++k) {
    const double speed = data.qvel[first[k]];
    for (std::size_t a = 0; a < 4; ++a) contact.start[static_cast<int>(a)] += speed * levers[a * count + k];
  }
  contact.start.segment<2>(1) += contact.arc;
  contact.surface = surface_velocity(model, data, contact);
  contact.start += contact.surface;
}

/// Returns the velocity of the surface of geom2 (a belt) against that of geom1, beyond the motion of the
/// bodies, in the axes of Contact::velocity.
Eigen::Vector4d BristleFriction::surface_velocity(const mjModel& model, const mjData& data,
                                                  const Contact& contact) const {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (const int geom : contact.geoms) {
    double given[6] = {};
    const double* own = given;
    if (surface_velocity_) surface_velocity_(model, geom, given);
#if mjVERSION_HEADER >= 3011000
    else
      own = model.geom_surfacevel + 6 * geom;
#endif
    if (std::all_of(own, own + 6, [](double v) { return v == 0.0; })) continue;
    const Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> axes(data.geom_xmat + 9 * geom);
    const Vector3d turn = axes * Map<const Vector3d>(own + 3),
                   at = axes * Map<const Vector3d>(own) + turn.cross(contact.point - centre_of(data, geom));
    const double sign = model.geom_bodyid[geom] == contact.bodies[1] ? 1.0 : -1.0;
    sum += sign * Eigen::Vector4d(0.0, contact.frame.along().dot(at), contact.frame.aside().dot(at),
                                  contact.frame.normal().dot(turn));
  }
  return sum;
}

BristleFriction::Levers BristleFriction::levers_of(const Contact& contact) {
  return {levers_.data() + 4 * contact.first_dof, static_cast<Eigen::Index>(contact.dofs), 4};
}

/// Numbers the columns of the matrix, one for each degree of freedom on which contacts act. Kinematic trees
/// that touch get near numbers, so that the lines of the matrix are short.
void BristleFriction::number_dofs(const mjModel& model) {
  if (!column_.empty() && dofs_ == dofs_before_ &&
      std::equal(contacts_.begin(), contacts_.end(), before_.begin(), before_.end(),
                 [](const Contact& a, const Contact& b) { return a.dofs == b.dofs; }))
    return;  // the same trees touch as in the last step, so their columns stay
  touching_.clear();
  for (const Contact& contact : contacts_) {
    if (contact.dofs == 0) continue;
    const int a = static_cast<int>(tree_of(model, dofs_[contact.first_dof])),
              b = static_cast<int>(tree_of(model, dofs_[contact.first_dof + contact.dofs - 1]));
    touching_.insert(touching_.end(), {{a, b}, {b, a}});
  }
  std::sort(touching_.begin(), touching_.end());
  trees_.clear();
  column_.assign(static_cast<std::size_t>(model.nv), -1);
  int columns = 0;
  const auto add = [&](int tree) {
    const int first = tree_start_[static_cast<std::size_t>(tree)];
    if (column_[static_cast<std::size_t>(first)] >= 0) return;
    trees_.push_back(tree);
    for (int dof = first; dof < model.nv && static_cast<int>(tree_of(model, dof)) == tree; ++dof)
      column_[static_cast<std::size_t>(dof)] = columns++;
  };
  std::size_t next = 0;
  for (const auto& pair : touching_) {
    add(pair.first);
    for (; next < trees_.size(); ++next)
      for (auto at = std::lower_bound(touching_.begin(), touching_.end(), std::make_pair(trees_[next], 0));
           at != touching_.end() && at->first == trees_[next]; ++at)
        add(at->second);
  }

  system_.begin(columns);
  for (int dof = 0; dof < model.nv; ++dof) {
    const int column = column_[static_cast<std::size_t>(dof)];
    for (int above = dof; column >= 0 && above >= 0; above = model.dof_parentid[above])
      system_.couple(column, column_[static_cast<std::size_t>(above)]);
  }
  columns_.clear();
  for (const int dof : dofs_) columns_.push_back(column_[static_cast<std::size_t>(dof)]);
  for (const Contact& contact : contacts_) system_.couple(columns_.data() + contact.first_dof, contact.dofs);
}

/// Gives each new contact the normal load that a step without friction finds. If its bodies already slide,
/// its bristles begin as bent as in steady sliding along the slip.
void BristleFriction::begin_new_contacts(const mjModel& model, mjData& data) {
  const auto is_new = [](const Contact& contact) { return contact.is_new && (contact.patch || contact.bed); };
  if (std::none_of(contacts_.begin(), contacts_.end(), is_new)) return;
  mj_fwdConstraint(&model, &data);
  motions_.assign(cells_.size(), Motion{});
  responses_.resize(cells_.size());
  for (Contact& contact : contacts_) {
    if (!is_new(contact)) continue;
    contact.normal_load = data.efc_force[contact.row];
    if (contact.surfaces >= 0) contact.normal_load = bristle::SurfaceLoads::first_load(contact.normal_load);
    if (contact.bed) continue;  // a bed reaches its force limit within a presliding displacement
    Vector3d moved = contact.start.tail<3>();
    const double speed = moved.head<2>().norm() + std::fabs(moved[2]) * contact.radius;
    // Slides the patch so far that its bristles are bent as in steady sliding.
    const bool slides = speed * model.opt.timestep > presliding_length_;
    moved *= slides ? 32.0 * presliding_length_ / speed : 0.0;
    set_motions(contact, moved);
    for (std::size_t cell = contact.first_cell; cell < contact.first_cell + contact.cells; ++cell)
      motions_[cell].has_velocity = 1;  // zero velocity, so that dampers give no force
  }
  constexpr double no_time = 1e-300;  // s
  batch_.step(no_time, motions_, responses_);
  for (const Contact& contact : contacts_) {
    if (!is_new(contact)) continue;
    for (std::size_t cell = contact.first_cell; cell < contact.first_cell + contact.cells; ++cell)
      cells_[cell].response = responses_[cell];
    if (contact.is_disc) turn_disc(contact);
  }
}

/// Predicts the velocity of every contact at the end of the step: one linear solve for the change of
/// velocity, in which the patches' stiffness and damping G act at the end of the step,
///
///   (M + T D + Jn' Jn / R + T Jt' G Jt) (u1 - u0) = T (f + Jn' aref / R + Jt' (E - G Jt u0))
///
/// D: damping of the joints. f: all free forces, and the last step's constraint forces other than contacts.
/// R, aref: MuJoCo's soft normal force (aref - a) / R of the contacts that carried load. Without it a held
/// body would seem free to turn under friction, although normal forces prevent that, and the force would
/// ring. A disc's cells are summed before they meet the rows, so their number does not add to the cost of the
/// solve.
void BristleFriction::solve(const mjModel& model, const mjData& data) {
  const double dt_s = model.opt.timestep;
  system_.set_zero();
  for (int dof = 0; dof < model.nv; ++dof) {
    const int column = column_[static_cast<std::size_t>(dof)];
    if (column < 0) continue;
    system_.right[column] = dt_s * (data.qfrc_smooth[dof] + other_constraints_[dof]);
    double* const line = system_.line(column);
    visit_masses(model, data, dof,
                 [&](int other, double mass) { line[column_[static_cast<std::size_t>(other)]] = mass; });
    line[column] += dt_s * model.dof_damping[dof];  // joint damping, implicit in MuJoCo's integrators too
  }
  for (const Contact& contact : contacts_) {
    if (contact.dofs == 0) continue;
    const bool point = contact.cells == 1 && !contact.is_disc;
    Eigen::Vector4d pull = Eigen::Vector4d::Zero(), straight = Eigen::Vector4d::Zero();
    if (contact.is_listed && contact.normal_load > 0.0) {
      straight[0] = 1.0 / data.efc_R[contact.row];
      pull[0] = dt_s * data.efc_aref[contact.row] * straight[0];
    }
    if (contact.cells <= 1 && !contact.bed) {
      if (point) {
        const bristle::LinearFriction& model_of_cell = cells_[contact.first_cell].model;
        straight[1] = straight[2] = dt_s * model_of_cell.slope()[0];
        pull.segment<2>(1) = dt_s * model_of_cell.steady - straight[1] * contact.start.segment<2>(1);
      }
      add<3>(contact, straight.head<3>().asDiagonal(), pull.head<3>());
      continue;
    }
    Eigen::Matrix3d of_cells = Eigen::Matrix3d::Zero();
    Vector3d elastic = Vector3d::Zero();
    sum_cells(contact, of_cells, elastic);
    Eigen::Matrix4d gain = straight.asDiagonal();
    gain.bottomRightCorner<3, 3>() = dt_s * of_cells;
    pull.tail<3>() = dt_s * (elastic - of_cells * contact.start.tail<3>());
    add<4>(contact, gain, pull);
  }
  system_.factor();
  system_.substitute();
  for (Contact& contact : contacts_) {
    const double* lever = levers_.data() + 4 * contact.first_dof;
    const int* const columns = columns_.data() + contact.first_dof;
    contact.velocity = contact.start;
    for (int a = 0; a < 4; ++a)
      for (std::size_t k = 0; k < contact.dofs; ++k)
        contact.velocity[a] += system_.right[columns[k]] * *lever++;
  }
}

/// Adds a contact to the linear solve: 3 forces of a point, or 4 with a torque about the normal. Contacts of
/// one or two free bodies (or of one with the ground) have matrices of fixed size, with which the compiler
/// makes faster code.
template <int forces, class Gain, class Pull>
void BristleFriction::add(const Contact& contact, const Gain& gain, const Pull& pull) {
  const int* const columns = columns_.data() + contact.first_dof;
  const double* const levers = levers_.data() + 4 * contact.first_dof;
  const auto in_row = [&](int at) { return columns[at + 5] == columns[at] + 5; };
  if (contact.dofs == 6 && in_row(0))
    system_.add_bodies({columns[0], -1}, Map<const Eigen::Matrix<double, 6, forces>>(levers), gain, pull);
  else if (contact.dofs == 12 && in_row(0) && in_row(6))
    system_.add_bodies({columns[0], columns[6]}, Map<const Eigen::Matrix<double, 12, forces>>(levers), gain,
                       pull);
  else
    system_.add(columns, levers_of(contact).leftCols<forces>(), gain, pull);
}

/// Adds up the gain G (force per velocity) and the elastic force E of the cells about the contact point. A
/// cell that slips contributes its force limit and no stiffness.
void BristleFriction::sum_cells(const Contact& contact, Eigen::Matrix3d& gain, Vector3d& pull) const {
  if (contact.bed) {
    gain = contact.slope;
    pull = contact.steady;
    return;
  }
  for (std::size_t k = contact.first_cell; k < contact.first_cell + contact.cells; ++k) {
    const Cell& cell = cells_[k];
    const double of_cell = cell.model.slope()[0];
    const Vector2d elastic = cell.model.steady;
    gain(0, 0) += of_cell;
    pull.head<2>() += elastic;
    if (!contact.is_disc) continue;
    gain(2, 2) += of_cell * cell.at.squaredNorm();
    gain(0, 2) -= of_cell * cell.at[1];
    gain(1, 2) += of_cell * cell.at[0];
    pull[2] += cell.at[0] * elastic[1] - cell.at[1] * elastic[0];
  }
  gain(1, 1) = gain(0, 0);
  gain(2, 0) = gain(0, 2);
  gain(2, 1) = gain(1, 2);
}

/// Lets those cells slip whose predicted force exceeds their limit. Returns false if there are none.
bool BristleFriction::release_cells() {
  bool released = false;
  for (const Contact& contact : contacts_) {
    for (std::size_t k = contact.first_cell; k < contact.first_cell + contact.cells; ++k) {
      Vector2d slip(contact.velocity[1], contact.velocity[2]);
      if (contact.is_disc) slip += contact.velocity[3] * Vector2d(-cells_[k].at[1], cells_[k].at[0]);
      released = cells_[k].model.release(slip) || released;
    }
  }
  return released;
}

/// Returns the motion of a contact's bed in this step. `moved`: slip (m) and spin (rad) of the body of geom2.
bristle::BedMotion BristleFriction::bed_motion(const mjModel& model, const mjData& data,
                                               const Contact& contact, const Vector3d& moved) const {
  return bristle_example::bed_motion(contact.bed, contact.frame, contact.slip.arm(),
                                     model.opt.timestep * spin_of(data, model.geom_bodyid[contact.geoms[0]]),
                                     moved, contact.normal_load);
}

/// Makes the linear model of each bed from two of its forces after the rolling of this step: without slip,
/// and at a small slip back. (A bed that rolls far in a step is softer than its tangent says.) A slip back
/// bends even a bed at its limit, so that the prediction cannot reverse it.
void BristleFriction::guess_beds(const mjModel& model, const mjData& data) {
  constexpr double small = 0.05;  // share of the force limit by which the slip changes the force
  const double dt_s = model.opt.timestep;
  for (Contact& contact : contacts_) {
    if (!contact.bed) continue;
    const auto find_force = [&](const Vector3d& slip) {
      return bed_batch_.find_force(bed_motion(model, data, contact, dt_s * slip));
    };
    const auto force = [&](const bristle::BedResponse& bed) {
      return Vector3d(contact.scale * Vector3d(bed.force[0], bed.force[1], bed.torque));
    };
    const bristle::BedResponse held = find_force(Vector3d::Zero());
    contact.steady = force(held);
    contact.slope =
        contact.scale * dt_s * Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&held.tangent[0][0]);
    Vector3d v = contact.start.tail<3>();
    const double change = (contact.slope * v).head<2>().norm();
    if (!(change > 0.0)) continue;
    v *= -std::min(1.0, small * contact.scale * bed_friction_ * contact.normal_load / change);
    contact.slope *=
        std::clamp((contact.steady - force(find_force(v))).dot(v) / v.dot(contact.slope * v), 0.0, 1.0);
  }
}

/// Computes the forces of the patches at the slip that solve() predicts, and from them the generalised
/// friction force on each degree of freedom.
void BristleFriction::find_forces(const mjModel& model, const mjData& data) {
  const double dt_s = model.opt.timestep;
  friction_.setZero();
  for (Contact& contact : contacts_) {
    if (contact.is_asleep) continue;
    contact.force.setZero();
    if (!contact.patch && !contact.bed) continue;
    const Vector3d moved = dt_s * contact.velocity.tail<3>();
    if (contact.bed) {
      const bristle::BedResponse trial = bed_batch_.find_force(bed_motion(model, data, contact, moved));
      contact.force = contact.scale * Vector3d(trial.force[0], trial.force[1], trial.torque);
    } else if (contact.is_disc) {
      const bristle::ExtendedResponse trial = patches_.find_force(dt_s, disc_motion(contact, moved));
      contact.force = contact.scale * Vector3d(trial.end[0], trial.end[1], trial.end[2]);
    } else {
      const Response& now = cells_[contact.first_cell].response;
      const Vector2d d = moved.head<2>();
      Vector2d force = Vector2d(now.elastic[0], now.elastic[1]) - (now.stiffness + now.damping / dt_s) * d;
      // Change of the force, as a share of its limit, below which the linear force is exact enough.
      constexpr double linear = 1e-6;
      if (!(now.stiffness * d.norm() < linear * now.force_limit)) {
        const Response trial = batch_.find_force(dt_s, point_motion(contact, d));
        force = Vector2d(trial.end[0], trial.end[1]);
      }
      contact.force.head<2>() = contact.scale * force;
    }
    const double* const lever = levers_.data() + 4 * contact.first_dof + contact.dofs;
    for (std::size_t k = 0; k < contact.dofs; ++k)
      friction_[dofs_[contact.first_dof + k]] += contact.force[0] * lever[k] +
                                                 contact.force[1] * lever[k + contact.dofs] +
                                                 contact.force[2] * lever[k + 2 * contact.dofs];
  }
}

/// Records the load and the slip of each contact in this step, for the step of its patch.
void BristleFriction::end_step(const mjModel& model, const mjData& data) {
  const double dt_s = model.opt.timestep;
  other_constraints_ = Map<const VectorXd>(data.qfrc_constraint, model.nv);
#if mjVERSION_HEADER >= 3011000
  for (int dof = 0; data.ntree_awake < model.ntree && dof < model.nv; ++dof)
    if (data.tree_asleep[model.dof_treeid[dof]] >= 0) other_constraints_[dof] = 0.0;
#endif
  for (Contact& contact : contacts_) {
    const double load = contact.row >= 0 ? data.efc_force[contact.row] : 0.0;
    const double* const lever = levers_.data() + 4 * contact.first_dof;
    contact.moved_by_velocity.setZero();
    for (std::size_t k = 0; k < contact.dofs; ++k) {
      const int dof = dofs_[contact.first_dof + k];
      for (int a = 0; a < 3; ++a)
        contact.moved_by_velocity[a] +=
            dt_s * data.qvel[dof] * lever[k + static_cast<std::size_t>(a + 1) * contact.dofs];
      other_constraints_[dof] -= load * lever[k];
    }
  }
  share_loads(data);
  moved_ = slipped_ = true;
}

/// Returns the slip (m) and spin (rad) of geom2 against geom1 in the last step, from the poses of the
/// bodies. Stores by how much the slip differs from velocity times time.
Vector3d BristleFriction::moved_by_poses(const mjModel& model, const mjData& data, Contact& contact) {
  Vector3d slip = contact.slip.find(pose_of(model, data, contact, 0), pose_of(model, data, contact, 1));
  if (model.geom_bodyid[contact.geoms[0]] == contact.bodies[0]) slip = -slip;
  const Vector3d moved(contact.frame.along().dot(slip), contact.frame.aside().dot(slip),
                       contact.moved_by_velocity[2]);
  contact.arc = (moved - contact.moved_by_velocity).head<2>() / model.opt.timestep;
  return moved + model.opt.timestep * contact.surface.tail<3>();
}

/// Steps all patches and beds by the slip that their contacts really had in the last step, under the normal
/// loads of that step.
void BristleFriction::step_patches(const mjModel& model, const mjData& data) {
  motions_.assign(cells_.size(), Motion{});
  responses_.resize(cells_.size());
  bed_motions_.clear();
  near_[0].first = near_[1].first = -1;
  for (Contact& contact : contacts_) {
    if ((!contact.patch && !contact.bed) || contact.is_asleep) continue;
    const Vector3d moved = moved_by_poses(model, data, contact);
    if (contact.bed)
      bed_motions_.push_back(bed_motion(model, data, contact, moved));
    else
      set_motions(contact, moved);
  }
  batch_.step(model.opt.timestep, motions_, responses_);
  bed_responses_.resize(bed_motions_.size());
  bed_batch_.step(bed_motions_, bed_responses_);
  for (std::size_t k = 0; k < cells_.size(); ++k)
    if (motions_[k].id) cells_[k].response = responses_[k];
  for (const Contact& contact : contacts_)
    if (contact.is_disc && contact.patch && !contact.is_asleep) turn_disc(contact);
  slipped_ = false;
}

/// Sets the motion of each cell of a contact for the patches' next step.
void BristleFriction::set_motions(Contact& contact, const Vector3d& moved) {
  if (!contact.is_disc) {
    motions_[contact.first_cell] = point_motion(contact, moved.head<2>());
    return;
  }
  contact.moved = disc_motion(contact, moved);
  patches_.write_motions({&contact.moved, 1}, {&motions_[contact.first_cell], contact.cells});
}

void BristleFriction::turn_disc(const Contact& contact) {
  bristle::ExtendedResponse sum;
  patches_.read_responses({&contact.moved, 1}, {&responses_[contact.first_cell], contact.cells}, {&sum, 1});
  positions_.resize(contact.cells);
  patches_.read_cells(contact.patch, 0.0, contact.normal_load, positions_);
  for (std::size_t k = 0; k < contact.cells; ++k)
    cells_[contact.first_cell + k].at = Vector2d(positions_[k].position[0], positions_[k].position[1]);
}

void roll_out(const mjModel& model, const std::vector<mjData*>& data,
              const std::vector<BristleFriction*>& frictions, int steps, int threads,
              const std::function<void(std::size_t, const mjModel&, mjData&)>& drive) {
  const auto run = [&](std::size_t first) {
    for (std::size_t i = first; i < data.size(); i += static_cast<std::size_t>(threads))
      for (int step = 0; step < steps; ++step) {
        if (drive) drive(i, model, *data[i]);
        frictions[i]->step(model, *data[i]);
      }
  };
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) others.emplace_back(run, static_cast<std::size_t>(t));
  run(0);
  for (std::thread& other : others) other.join();
}

}  // namespace mujoco_example
