#include "bullet_friction.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include <Eigen/LU>

namespace bullet_example {

using bristle::Motion;
using bristle::Response;
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

Vector3d from(const btVector3& v) {
  return {static_cast<double>(v.x()), static_cast<double>(v.y()), static_cast<double>(v.z())};
}
btVector3 to(const Vector3d& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}
// Largest errors with which the linear solve of a group of bodies is accepted without further iterations: of
// the velocity at normal impulses and joints and at slips, as accelerations (m/s^2), and of a patch's force,
// as the change by this step's slip over the force limit.
constexpr double row_error = 0.1, slip_error = 1e-3, most_bent = 0.05;

constexpr std::uint32_t held_contacts = 4;  // largest number of contacts kept for each pair of surfaces

bool moves(const btCollisionObject& body) { return !body.isStaticObject(); }
const btCollisionObject& body_of(const btPersistentManifold& manifold, int k) {
  return *(k == 0 ? manifold.getBody0() : manifold.getBody1());
}
bool is_round(const btCollisionObject& body) {
  const int type = body.getCollisionShape()->getShapeType();
  return type == SPHERE_SHAPE_PROXYTYPE || type == CAPSULE_SHAPE_PROXYTYPE ||
         type == CYLINDER_SHAPE_PROXYTYPE;
}
/// Returns which of the two bodies of a manifold is the smaller one, 0 or 1.
int smaller_body(const btPersistentManifold& manifold) {
  btScalar radius[2];
  btVector3 centre;
  for (int k = 0; k < 2; ++k) body_of(manifold, k).getCollisionShape()->getBoundingSphere(centre, radius[k]);
  return radius[0] < radius[1] ? 0 : 1;
}
/// Returns which of the two bodies of a manifold is round, 0 or 1: the smaller one if both are, -1 if none
/// is.
int round_body(const btPersistentManifold& manifold) {
  const bool round[2] = {is_round(body_of(manifold, 0)), is_round(body_of(manifold, 1))};
  return round[0] && round[1] ? smaller_body(manifold) : round[0] ? 0 : round[1] ? 1 : -1;
}
/// Returns a frame in which the contacts of a manifold hardly move, so that their points can be matched from
/// step to step. It is the frame of a body that moves; for a round body, which may roll, one at its centre
/// with the world's axes.
btTransform frame_of(const btPersistentManifold& manifold) {
  const int round = round_body(manifold);
  if (round >= 0)
    return btTransform(btQuaternion::getIdentity(), body_of(manifold, round).getWorldTransform().getOrigin());
  return body_of(manifold, moves(*manifold.getBody0()) ? 0 : 1).getWorldTransform();
}
bristle::BodyPose pose_of(const btCollisionObject& body, const Vector3d& turn) {
  bristle::BodyPose pose;
  pose.centre = from(body.getWorldTransform().getOrigin());
  for (int i = 0; i < 3; ++i) pose.axes.row(i) = from(body.getWorldTransform().getBasis()[i]);
  pose.turn = turn;
  return pose;
}
/// Converts the response of a bed to that of a patch without a damper. Its stiffness is the mean over both
/// axes.
Response as_patch(const bristle::BedResponse& bed, double force_limit) {
  Response to;
  for (int a = 0; a < 2; ++a) to.end[a] = to.elastic[a] = bed.force[a];
  to.stiffness = 0.5 * (bed.tangent[0][0] + bed.tangent[1][1]);
  to.force_limit = force_limit;
  return to;
}
/// Returns the stiffness of a bed along each axis over the mean of both.
Vector2d stiffness_ratios(const bristle::BedMaterial& material) {
  const double *const slip = material.slip_stiffness, *const flexibility = material.flexibility;
  Vector2d stiffness(1.0, 1.0);
  if (slip[0] > 0.0) stiffness = {slip[0], slip[1]};
  if (flexibility[0] > 0.0) stiffness = {1.0 / flexibility[0], 1.0 / flexibility[1]};
  return stiffness / stiffness.mean();
}
/// Returns a key of the two bodies, from Bullet's ids, which are constant while both bodies are in the world.
std::uint64_t pair_of(const btPersistentManifold& manifold) {
  const auto number = [](const btCollisionObject* body) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(body->getBroadphaseHandle()->getUid()));
  };
  return number(manifold.getBody0()) << 32 | number(manifold.getBody1());
}

}  // namespace

/// Linear equations for the velocity changes of all bodies of a group, six unknowns for each body.
struct BristleSolver::System {
  using Vector12 = Eigen::Matrix<double, 12, 1>;
  /// Jacobian of a constraint with respect to the velocities of its two bodies, six for each, and the first
  /// column of each body in the matrix, -1 if it cannot move.
  struct Line {
    int first[2];
    Vector12 along;
  };
  /// Bullet's constraint of a normal impulse or a joint, as a row of the equations. It is solved with
  /// `softness`, slightly more than its own compliance, so that redundant contacts share the load.
  struct Row {
    btSolverConstraint* constraint;
    Line line;
    double before, impulse;  // N s
    // Velocity that the row demands, m/s; its own softness, and the larger one with which it is solved, 1/kg.
    double wanted, own, softness;
    // Whether the impulse of the row is within its limits, so that it is an unknown; otherwise it is fixed at
    // a limit.
    bool active;
  };
  struct Friction {
    Contact* contact;
    Line lines[2];
    Vector2d before;  // slip before the solve, m/s
    bristle::LinearFriction model;
    double share;  // factor from force to impulse, s
  };

  static double velocity(const Line& l, const Eigen::VectorXd& of) {
    double sum = 0.0;
    for (int side = 0; side < 2; ++side)
      if (l.first[side] >= 0) sum += l.along.segment<6>(6 * side).dot(of.segment<6>(l.first[side]));
    return sum;
  }
  Vector2d slip(const Friction& f) const {
    return f.before + Vector2d(velocity(f.lines[0], change), velocity(f.lines[1], change));
  }
  /// Adds a constraint, or friction, that acts along a line with the impulse `pull` - `gain` x velocity along
  /// the line.
  void add(const Line& l, double gain, double pull) {
    using One = Eigen::Matrix<double, 1, 1>;
    matrix.add_bodies(l.first, l.along, One(gain), One(pull));
  }
  void set_shape();
  void set_masses(const btAlignedObjectArray<btSolverBody>& bodies);
  void solve();
  void refine();
  bool drop();
  double error() const;

  std::vector<int> column;  // first column of each body in the solve's matrix
  bristle::BodySystem matrix, masses;
  Eigen::VectorXd change;
  std::vector<Row> rows;
  std::vector<Friction> frictions;
};

/// Allocates the matrix and its factor, with room for an entry for each two bodies that a constraint or a
/// contact joins.
void BristleSolver::System::set_shape() {
  for (int i = 0; i < masses.size(); ++i) masses.couple(i, i - i % 6);
  const auto couple = [this](const Line& line) {
    const int low = std::min(line.first[0], line.first[1]), high = std::max(line.first[0], line.first[1]);
    for (int i = 0; low >= 0 && i < 6; ++i) masses.couple(high + i, low);
  };
  for (const Row& row : rows) couple(row.line);
  for (const Friction& f : frictions) couple(f.lines[0]);
  masses.set_zero();
}

void BristleSolver::System::set_masses(const btAlignedObjectArray<btSolverBody>& bodies) {
  constexpr double locked = 1e-12;  // least inverse mass (1/kg) or inertia (1/(kg m^2)), of a locked axis
  for (int b = 0; b < bodies.size(); ++b) {
    const int at = column[static_cast<std::size_t>(b)];
    if (at < 0) continue;
    const btRigidBody& body = *bodies[b].m_originalBody;
    const Vector3d free = from(body.getAngularFactor());
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity() * locked;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        inertia(i, j) += free[i] * free[j] * static_cast<double>(body.getInvInertiaTensorWorld()[i][j]);
    inertia = inertia.inverse().eval();
    for (int i = 0; i < 3; ++i) {
      masses.line(at + i)[at + i] = 1.0 / (static_cast<double>(bodies[b].internalGetInvMass()[i]) + locked);
      for (int j = 0; j <= i; ++j) masses.line(at + 3 + i)[at + 3 + j] = inertia(i, j);
    }
  }
}

/// Solves for the velocity changes of the bodies with the active rows and the friction, and for the impulses
/// of these rows.
void BristleSolver::System::solve() {
  matrix = masses;
  for (const Row& row : rows)
    add(row.line, row.active ? 1.0 / row.softness : 0.0,
        row.active ? row.wanted / row.softness : row.impulse - row.before);
  for (const Friction& f : frictions) {
    const Vector2d impulse = f.share * f.model.force(f.before) - f.contact->impulse;
    for (int a = 0; a < 2; ++a) add(f.lines[a], f.share * f.model.slope()[a], impulse[a]);
  }
  matrix.factor();
  matrix.substitute();
  change = matrix.right;
  for (Row& row : rows)
    if (row.active) row.impulse = row.before + (row.wanted - velocity(row.line, change)) / row.softness;
}

/// Removes most of the error that the additional softness causes, by one step of iterative refinement.
void BristleSolver::System::refine() {
  const auto missing = [&](const Row& row) {
    return row.active ? row.wanted - velocity(row.line, change) - row.own * (row.impulse - row.before) : 0.0;
  };
  matrix.right.setZero();
  for (const Row& row : rows) {
    const double impulse = missing(row) / row.softness;
    for (int side = 0; side < 2; ++side)
      if (row.line.first[side] >= 0)
        matrix.right.segment<6>(row.line.first[side]) += impulse * row.line.along.segment<6>(6 * side);
  }
  matrix.substitute();
  for (Row& row : rows)
    if (row.active) row.impulse += (missing(row) - velocity(row.line, matrix.right)) / row.softness;
  change += matrix.right;
}

/// Fixes impulses beyond a limit at the limit, and lets patches beyond their force limit slip. Returns false
/// if there were none, so that the solution stands.
bool BristleSolver::System::drop() {
  bool dropped = false;
  for (Row& row : rows) {
    const double impulse = std::clamp(row.impulse, static_cast<double>(row.constraint->m_lowerLimit),
                                      std::max(static_cast<double>(row.constraint->m_lowerLimit),
                                               static_cast<double>(row.constraint->m_upperLimit)));
    if (impulse == row.impulse) continue;
    row.impulse = impulse;
    row.active = false;
    dropped = true;
  }
  for (Friction& f : frictions)
    if (f.share != 0.0) dropped = f.model.release(slip(f)) || dropped;
  return dropped;
}

/// Returns the largest error of the velocity of a row, m/s. A row without an impulse may be faster than it
/// demands, for surfaces may part.
double BristleSolver::System::error() const {
  double largest = 0.0;
  for (const Row& row : rows) {
    const double missing = row.wanted - velocity(row.line, change) - row.own * (row.impulse - row.before);
    largest = std::max(largest, row.active ? std::fabs(missing) : missing);
  }
  return largest;
}

BristleSolver::~BristleSolver() = default;

BristleSolver::BristleSolver(btDispatcher& dispatcher, const bristle::Coefficients& law,
                             const FrictionOptions& options)
    : dispatcher_(dispatcher),
      kinetic_(law.kinetic),
      highest_load_(options.patch.max_normal_load),
      friction_sweeps_(options.sweeps),
      patches_(batch_, bristle::Material::from_coefficients(law), options.patch,
               bristle::KeyedOptions{}.with_capacity(options.contacts)),
      matcher_(bristle::MatcherOptions{}.with_capacity(options.contacts).with_reach(options.reach)),
      index_(options.contacts),
      system_(std::make_unique<System>()) {
  if (options.rolling) {
    const bristle_example::RollingBed& bed = *options.rolling;
    beds_.emplace(bed_batch_, bed.material, bed.shape, bed.options,
                  bristle::KeyedOptions{}.with_capacity(options.contacts));
    bed_friction_ = bed.material.kinetic_friction;
    bed_axes_ = stiffness_ratios(bed.material);
  }
  matcher_.set_hold(held_contacts);
  batch_.warm_up();
}

void BristleSolver::forget_contacts() {
  matcher_.clear();
  patches_.clear();
  if (beds_) beds_->clear();
  known_.clear();
  solved_.clear();
  listed_.clear();
}

void BristleSolver::reset() {
  btSequentialImpulseConstraintSolver::reset();
  forget_contacts();
}

/// Prepares a step of all bodies. Bullet calls it once, before it solves the islands (groups of touching
/// bodies) one after the other.
void BristleSolver::prepareSolve(int, int) {
  touching_.clear();
  for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
    const btPersistentManifold* const manifold = dispatcher_.getManifoldByIndexInternal(m);
    if (manifold->getNumContacts() > 0) touching_.emplace_back(pair_of(*manifold), manifold);
  }
  std::sort(touching_.begin(), touching_.end(), std::less<>{});
  step_patches();
  solved_.clear();
  listed_.clear();
  bed_motions_.clear();
  match();
}

/// Steps patches and beds by the slip of their contacts, taken from the poses of the bodies. Only islands
/// that were awake in the last step; patches of sleeping bodies keep their state.
void BristleSolver::step_patches() {
  motions_.assign(solved_.size(), Motion{});
  responses_.resize(solved_.size());
  bed_motions_.clear();
  for (std::size_t i = 0; i < solved_.size(); ++i) {
    Contact& contact = *solved_[i];
    const auto at = std::lower_bound(touching_.begin(), touching_.end(), contact.pair,
                                     [](const auto& a, std::uint64_t pair) { return a.first < pair; });
    if (at == touching_.end() || at->first != contact.pair) continue;  // the bodies have parted
    const auto pose = [&](int k) { return pose_of(body_of(*at->second, k), contact.turns[k]); };
    Vector3d slip = contact.slip.find(pose(contact.rider), pose(1 - contact.rider));
    if (contact.rider == 1) slip = -slip;
    const Vector2d d(contact.frame.along().dot(slip), contact.frame.aside().dot(slip));
    contact.arc = d / last_dt_s_ - contact.by_velocity;
    if (contact.bed)
      bed_motions_.push_back(bristle_example::bed_motion(contact.bed, contact.frame, contact.arm,
                                                         contact.turns[contact.round], {d[0], d[1], 0.0},
                                                         contact.normal_load));
    else
      motions_[i] = Motion{contact.patch, {d[0], d[1]}, contact.normal_load};
  }
  if (solved_.empty()) return;
  batch_.step(last_dt_s_, motions_, responses_);
  bed_responses_.resize(bed_motions_.size());
  bed_batch_.step(bed_motions_, bed_responses_);
  auto bed = bed_responses_.begin();
  for (std::size_t i = 0; i < solved_.size(); ++i) {
    Contact& contact = *solved_[i];
    if (motions_[i].id) contact.response = responses_[i];
    if (contact.bed && bed != bed_responses_.end() && bed->id == contact.bed)
      contact.response = as_patch(*bed++, bed_friction_ * contact.normal_load);
  }
}

/// Finds the patch of each contact: that of the same contact in the step before. Contacts of sleeping bodies
/// keep their patches.
void BristleSolver::match() {
  found_.clear();
  of_.clear();
  points_.clear();
  normals_.clear();
  for (const auto& [pair, manifold] : touching_) {
    const btTransform frame = frame_of(*manifold);
    const bool on_a = moves(*manifold->getBody0());
    for (int p = 0; p < manifold->getNumContacts(); ++p) {
      const btManifoldPoint& point = manifold->getContactPoint(p);
      if (!(point.m_combinedFriction > 0)) continue;
      const Vector3d position =
          from(frame.invXform(on_a ? point.getPositionWorldOnA() : point.getPositionWorldOnB()));
      const Vector3d normal = from(frame.getBasis().transpose() * point.m_normalWorldOnB);
      found_.push_back(&point);
      of_.push_back(manifold);
      points_.push_back({pair, {position[0], position[1], position[2]}});
      normals_.insert(normals_.end(), normal.data(), normal.data() + 3);
    }
  }
  keys_.resize(points_.size());
  reserve(points_.size());
  matcher_.match(points_, keys_, normals_);
  reserve(points_.size() + matcher_.held().size());

  before_.swap(known_);
  known_.clear();
  sorted_points_.clear();
  for (std::size_t i = 0; i < found_.size(); ++i) {
    if (keys_[i] == bristle::no_contact_key || matcher_.has_joined(i)) continue;
    const bristle::KeyedContact keyed = patches_.find_or_add_contact(keys_[i]);
    std::size_t& index = index_[keyed.index];
    Contact& contact = keyed.is_new ? known_.emplace_back() : known_.emplace_back(before_[index]);
    if (keyed.is_new) contact.frame = bristle::ContactFrame(from(found_[i]->m_normalWorldOnB));
    index = known_.size() - 1;
    contact.key = keys_[i];
    contact.pair = points_[i].pair;
    contact.patch = keyed.id;
    contact.is_listed = true;
    const int round = round_body(*of_[i]);
    for (int k = 0; k < 2; ++k) contact.objects[k] = &body_of(*of_[i], k);
    contact.round = beds_ ? round : -1;
    contact.rider = round >= 0 ? round : smaller_body(*of_[i]);
    contact.bed = contact.round >= 0 ? beds_->find_or_add(keys_[i]) : bristle::BedId{};
    contact.scale =
        static_cast<double>(found_[i]->m_combinedFriction) / (contact.bed ? bed_friction_ : kinetic_);
    sorted_points_.push_back({found_[i], index, false});
  }
  for (const bristle::HeldContact& held : matcher_.held()) hold(held);
  for (std::size_t i = 0; i < found_.size(); ++i) {
    if (!matcher_.has_joined(i) || !patches_.find(keys_[i])) continue;  // surfaces parted at the patch
    const bristle::KeyedContact keyed = patches_.find_or_add_contact(keys_[i]);
    sorted_points_.push_back({found_[i], index_[keyed.index], true});
  }
  find_surfaces();
  patches_.end_step();
  if (beds_) beds_->end_step();
  std::sort(sorted_points_.begin(), sorted_points_.end(),
            [](const Listed& a, const Listed& b) { return std::less<>{}(a.point, b.point); });
}

/// Makes room for a number of contacts. Allocates only if it is larger than ever before.
void BristleSolver::reserve(std::size_t contacts) {
  if (contacts <= patches_.capacity()) return;
  const auto room = static_cast<std::uint32_t>(std::max(contacts, std::size_t{2} * patches_.capacity()));
  matcher_.reserve(room);
  patches_.reserve(room);
  if (beds_) beds_->reserve(room);
  index_.resize(room);
}

/// Keeps a contact whose pair Bullet lists at other points only, if both surfaces still touch at its point.
void BristleSolver::hold(const bristle::HeldContact& held) {
  // Angle (rad) and distance (m) between the surfaces from which on they no longer touch at the point.
  constexpr double steepest = 2e-3, deepest = 1e-4;
  const bristle::KeyedContact keyed = patches_.find_or_add_contact(held.key);
  std::size_t& index = index_[keyed.index];
  for (std::size_t i = 0; i < found_.size() && !keyed.is_new; ++i) {
    const Contact& old = before_[index];
    const Vector3d normal = from(found_[i]->m_normalWorldOnB);
    if (points_[i].pair != held.contact.pair || old.bed || old.frame.normal().dot(normal) < 0.7) continue;
    const Vector3d at = from(frame_of(*of_[i]) * to(Vector3d(held.contact.point[0], held.contact.point[1],
                                                             held.contact.point[2])));
    const Vector3d apart =
        at - 0.5 * from(found_[i]->getPositionWorldOnA() + found_[i]->getPositionWorldOnB());
    if (std::fabs(apart.dot(normal)) > steepest * apart.norm() + deepest) break;
    Contact& contact = known_.emplace_back(old);
    contact.is_listed = false;
    contact.held_at = at;
    index = known_.size() - 1;
    return;
  }
  matcher_.release(held.key);
  patches_.remove(held.key);
}

/// Finds the contacts that Bullet now lists at other points of the same two surfaces.
void BristleSolver::find_surfaces() {
  surfaces_.clear();
  for (const Contact& contact : known_)
    if (!contact.is_listed) surfaces_.add(contact.pair);
  for (const Listed& point : sorted_points_)
    if (point.joined) surfaces_.add(known_[point.contact].pair);
  for (Contact& contact : known_) {
    contact.surfaces = surfaces_.find(contact.pair);
    if (contact.surfaces >= 0) surfaces_[contact.surfaces].before += contact.normal_load;
  }
  for (Contact& contact : known_) {
    const double all = contact.surfaces < 0 ? 0.0 : surfaces_[contact.surfaces].before;
    contact.share = all > 0.0 ? contact.normal_load / all : 0.0;
  }
  rows_.resize(surfaces_.all().size());
}

const BristleSolver::Listed* BristleSolver::find_listed(const btManifoldPoint& point) const {
  const auto found =
      std::lower_bound(sorted_points_.begin(), sorted_points_.end(), &point,
                       [](const Listed& a, const btManifoldPoint* of) { return std::less<>{}(a.point, of); });
  return found == sorted_points_.end() || found->point != &point ? nullptr : &*found;
}

/// Sets Bullet's friction coefficient to 0 while Bullet makes its constraints, so that friction comes from
/// the bristles alone.
void BristleSolver::convertContacts(btPersistentManifold** manifolds, int count,
                                    const btContactSolverInfo& info) {
  coefficients_.clear();
  for (int m = 0; m < count; ++m) {
    for (int p = 0; p < manifolds[m]->getNumContacts(); ++p) {
      btScalar& coefficient = manifolds[m]->getContactPoint(p).m_combinedFriction;
      coefficients_.push_back(coefficient);
      coefficient = 0;
    }
  }
  btSequentialImpulseConstraintSolver::convertContacts(manifolds, count, info);
  auto coefficient = coefficients_.begin();
  for (int m = 0; m < count; ++m) {
    for (int p = 0; p < manifolds[m]->getNumContacts(); ++p)
      manifolds[m]->getContactPoint(p).m_combinedFriction = *coefficient++;
  }
  first_of_group_ = solved_.size();
  const double dt_s = static_cast<double>(info.m_timeStep);
  last_dt_s_ = dt_s;
  for (auto& rows : rows_) rows.clear();
  for (int row = 0; row < m_tmpSolverContactConstraintPool.size(); ++row) {
    const auto& point =
        *static_cast<const btManifoldPoint*>(m_tmpSolverContactConstraintPool[row].m_originalContactPoint);
    const Listed* const listed = find_listed(point);
    if (!listed) continue;
    Contact& contact = known_[listed->contact];
    if (contact.surfaces >= 0) rows_[static_cast<std::size_t>(contact.surfaces)].push_back(row);
    if (!listed->joined) begin(contact, row, dt_s);
  }
  for (Contact& contact : known_) {
    if (contact.is_listed) continue;
    const auto& rows = rows_[static_cast<std::size_t>(contact.surfaces)];
    if (!rows.empty()) begin(contact, rows.front(), dt_s);
  }
}

/// Prepares a contact for the iterations, which start from the present force of its patch.
void BristleSolver::begin(Contact& contact, int row, double dt_s) {
  const btSolverConstraint& normal = m_tmpSolverContactConstraintPool[row];
  const auto& point = *static_cast<const btManifoldPoint*>(normal.m_originalContactPoint);
  const auto turn = [&](int body) -> Vector3d {
    return dt_s * from(m_tmpSolverBodyPool[body].m_angularVelocity);
  };
  contact.row = row;
  contact.turns[0] = turn(normal.m_solverBodyIdA);
  contact.turns[1] = turn(normal.m_solverBodyIdB);
  if (contact.bed)  // the contact's axes move with the body that does not roll
    contact.frame.carry_with_surface(from(point.m_normalWorldOnB), contact.turns[1 - contact.round]);
  else
    contact.frame.carry(from(point.m_normalWorldOnB), contact.turns[0], contact.turns[1]);
  set_sides(contact, contact.is_listed ? 0.5 * from(point.getPositionWorldOnA() + point.getPositionWorldOnB())
                                       : contact.held_at);
  if (contact.bed) {
    const btVector3 centre = contact.bodies[contact.round] == nullptr
                                 ? to(contact.point)
                                 : contact.bodies[contact.round]->getWorldTransform().getOrigin();
    contact.arm = contact.point - from(centre);
  }
  const auto pose = [&](int k) { return pose_of(*contact.objects[k], Vector3d::Zero()); };
  contact.slip.record(pose(contact.rider), pose(1 - contact.rider), contact.point,
                      is_round(*contact.objects[0]) && is_round(*contact.objects[1]));
  guess_answer(contact, dt_s);
  contact.impulse.setZero();
  push(contact,
       dt_s * std::min(1.0, normal_impulse(contact) / (dt_s * contact.answer.load)) * contact.answer.steady);
  solved_.push_back(&contact);
}

/// Sets the Jacobian of the contact's slip, and the change of slip by an impulse. Friction acts on both
/// bodies at one common point, so that it conserves angular momentum too.
void BristleSolver::set_sides(Contact& contact, const Vector3d& at) {
  const btSolverConstraint& row = m_tmpSolverContactConstraintPool[contact.row];
  const btVector3 position = to(at);
  contact.point = at;
  contact.start = contact.arc;
  const btVector3 axes[2] = {to(contact.frame.along()), to(contact.frame.aside())};
  for (int k = 0; k < 2; ++k) {
    Contact::Side& side = contact.sides[k];
    side.body = k == 0 ? row.m_solverBodyIdA : row.m_solverBodyIdB;
    const btSolverBody& body = m_tmpSolverBodyPool[side.body];
    const btRigidBody* rigid = body.m_originalBody;
    contact.bodies[k] = rigid;
    for (int a = 0; a < 2; ++a) {
      side.axis[a] = k == 0 ? axes[a] : -axes[a];
      side.linear[a].setZero();
      side.angular[a].setZero();
      side.moment[a].setZero();
      if (!rigid) continue;
      side.moment[a] = (position - rigid->getCenterOfMassPosition()).cross(side.axis[a]);
      side.linear[a] = side.axis[a] * body.internalGetInvMass();
      contact.start[a] +=
          static_cast<double>(side.axis[a].dot(body.m_linearVelocity + body.m_externalForceImpulse) +
                              side.moment[a].dot(body.m_angularVelocity + body.m_externalTorqueImpulse));
      side.angular[a] = rigid->getInvInertiaTensorWorld() * (side.moment[a] * rigid->getAngularFactor()) *
                        rigid->getAngularFactor();
    }
  }
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b) {
      contact.mobility(a, b) = 0.0;
      for (const Contact::Side& side : contact.sides)
        contact.mobility(a, b) +=
            static_cast<double>(side.axis[a].dot(side.linear[b]) + side.moment[a].dot(side.angular[b]));
    }
}

/// Sets the linear model of the contact's force: spring and damper with the present force and stiffness of
/// the patch, clipped at the force limit. The patch of a new contact has no load yet, so it is evaluated at
/// the highest load, and its force is scaled.
void BristleSolver::guess_answer(Contact& contact, double dt_s) {
  if (contact.bed) {
    // Finds the stiffness by a small slip back. A bed that rolls far in a step is softer than its tangent
    // says.
    constexpr double small = 0.05;  // share of the force limit by which the slip changes the force
    const double load = contact.normal_load > 0.0 ? contact.normal_load : highest_load_;
    const Vector2d slip = slip_of(contact);
    const double limit = bed_friction_ * load;
    const Response rest = find_force(contact, Vector2d::Zero(), load, dt_s);
    const double change = dt_s * rest.stiffness * axes_of(contact).cwiseProduct(slip).norm();
    const double back = change > 0.0 ? std::min(1.0, small * limit / change) : 0.0;
    set_secant(contact, -back * slip, rest, load, dt_s);
    contact.answer.limited = true;
    return;
  }
  const double load = contact.normal_load > 0.0 ? contact.normal_load : highest_load_;
  if (!(contact.normal_load > 0.0)) {
    const Vector2d slip = slip_of(contact);  // slip velocity, m/s, on which the damping coefficient depends
    contact.response =
        batch_.find_force(dt_s, Motion{contact.patch, {0.0, 0.0}, highest_load_, true, {slip[0], slip[1]}});
  }
  contact.answer = {contact.response, dt_s, load, contact.scale};
}

/// Returns the stiffness of the contact's patch or bed along each axis, over the mean of both axes.
Vector2d BristleSolver::axes_of(const Contact& contact) const {
  return contact.bed ? Vector2d(bed_axes_) : Vector2d(1.0, 1.0);
}

/// Returns the response that the contact's patch or bed would give to a slip velocity (m/s) in this step.
Response BristleSolver::find_force(const Contact& contact, const Vector2d& slip, double load, double dt_s) {
  const Vector2d d = dt_s * slip;
  if (!contact.bed) return batch_.find_force(dt_s, Motion{contact.patch, {d[0], d[1]}, load});
  return as_patch(
      bed_batch_.find_force(bristle_example::bed_motion(
          contact.bed, contact.frame, contact.arm, contact.turns[contact.round], {d[0], d[1], 0.0}, load)),
      bed_friction_ * load);
}

/// Sets the linear model of the contact's force through the force at a slip. Its slope is the secant from
/// `rest`, the response without slip under the same load.
void BristleSolver::set_secant(Contact& contact, const Vector2d& slip, const Response& rest, double load,
                               double dt_s) {
  contact.answer = bristle::LinearFriction::through(find_force(contact, slip, load, dt_s),
                                                    {rest.elastic[0], rest.elastic[1]}, slip, dt_s, load,
                                                    contact.scale, axes_of(contact));
}

/// Replaces the linear model of a loaded contact by the response of its patch or bed to the present slip.
void BristleSolver::ask_patch(Contact& contact, double dt_s) {
  const double load = normal_impulse(contact) / dt_s;
  if (!(load > 0.0)) return;
  set_secant(contact, slip_of(contact), find_force(contact, Vector2d::Zero(), load, dt_s), load, dt_s);
}

/// Finds the friction impulse of a contact while all other contacts stay fixed. Returns the squared change of
/// slip, in the unit in which Bullet measures the change by a row.
double BristleSolver::rub(Contact& contact, double dt_s) {
  const Vector2d free = slip_of(contact) - contact.mobility * contact.impulse;
  const Vector2d impulse = contact.answer.impulse(normal_impulse(contact), dt_s, contact.mobility, free);
  const double change = (contact.mobility * (impulse - contact.impulse)).squaredNorm();
  push(contact, impulse);
  return change;
}

void BristleSolver::push(Contact& contact, const Vector2d& impulse) {
  const Vector2d change = impulse - contact.impulse;
  const auto a = static_cast<btScalar>(change[0]), b = static_cast<btScalar>(change[1]);
  for (const Contact::Side& side : contact.sides) {
    btSolverBody& body = m_tmpSolverBodyPool[side.body];
    if (body.m_originalBody)
      body.internalApplyImpulse(a * side.linear[0] + b * side.linear[1],
                                a * side.angular[0] + b * side.angular[1], 1);
  }
  contact.impulse = impulse;
}

Vector2d BristleSolver::slip_of(const Contact& contact) const {
  Vector2d slip = contact.start;
  for (const Contact::Side& side : contact.sides) {
    const btSolverBody& body = m_tmpSolverBodyPool[side.body];
    if (!body.m_originalBody) continue;
    const btVector3 &v = body.getDeltaLinearVelocity(), &w = body.getDeltaAngularVelocity();
    for (int a = 0; a < 2; ++a) slip[a] += static_cast<double>(side.axis[a].dot(v) + side.moment[a].dot(w));
  }
  return slip;
}

double BristleSolver::normal_impulse(const Contact& contact) const {
  const auto of_row = [&](int row) {
    return std::max(static_cast<double>(m_tmpSolverContactConstraintPool[row].m_appliedImpulse), 0.0);
  };
  if (contact.surfaces < 0) return of_row(contact.row);
  double sum = 0.0;
  for (const int row : rows_[static_cast<std::size_t>(contact.surfaces)]) sum += of_row(row);
  return contact.share * sum;
}

void BristleSolver::list_unknowns(double dt_s) {
  System& system = *system_;
  const auto& bodies = m_tmpSolverBodyPool;
  system.column.assign(static_cast<std::size_t>(bodies.size()), -1);
  int unknowns = 0;
  for (int b = 0; b < bodies.size(); ++b) {
    if (!bodies[b].m_originalBody || bodies[b].m_originalBody->getInvMass() == btScalar(0)) continue;
    system.column[static_cast<std::size_t>(b)] = unknowns;
    unknowns += 6;
  }
  system.masses.begin(unknowns);
  const auto set_columns = [&](System::Line& line, int side, int body) {
    line.first[side] = system.column[static_cast<std::size_t>(body)];
  };

  // Adds a slight softness to Bullet's normal impulses. The load is then shared by all four corners of a
  // body, where three would carry it.
  constexpr double softness = 3e-3;  // softness of a normal row, relative to the inverse mass that the row
                                     // feels
  system.rows.clear();
  for (btConstraintArray* pool : {&m_tmpSolverContactConstraintPool, &m_tmpSolverNonContactConstraintPool}) {
    for (int i = 0; i < pool->size(); ++i) {
      btSolverConstraint& constraint = (*pool)[i];
      System::Row& row = system.rows.emplace_back();
      row.constraint = &constraint;
      const int on[2] = {constraint.m_solverBodyIdA, constraint.m_solverBodyIdB};
      row.line.along << from(constraint.m_contactNormal1), from(constraint.m_relpos1CrossNormal),
          from(constraint.m_contactNormal2), from(constraint.m_relpos2CrossNormal);
      double moving = 0.0;
      for (int side = 0; side < 2; ++side) {
        set_columns(row.line, side, on[side]);
        const btSolverBody& body = bodies[on[side]];
        Eigen::Matrix<double, 6, 1> change;
        change << from(body.getDeltaLinearVelocity()), from(body.getDeltaAngularVelocity());
        moving += row.line.along.segment<6>(6 * side).dot(change);
      }
      const double mobility = 1.0 / static_cast<double>(constraint.m_jacDiagABInv);
      const btScalar applied = constraint.m_appliedImpulse;
      row.before = row.impulse = static_cast<double>(applied);
      row.own = mobility * static_cast<double>(constraint.m_cfm);
      row.softness = row.own + mobility * softness;
      row.wanted = mobility * static_cast<double>(constraint.m_rhs) - row.own * row.before - moving;
      row.active = row.before > 0.0 || row.wanted > 0.0 || pool == &m_tmpSolverNonContactConstraintPool;
    }
  }
  system.frictions.clear();
  for (std::size_t i = first_of_group_; i < solved_.size(); ++i) {
    Contact& contact = *solved_[i];
    System::Friction& f = system.frictions.emplace_back();
    f.contact = &contact;
    for (int a = 0; a < 2; ++a)
      for (int side = 0; side < 2; ++side) {
        set_columns(f.lines[a], side, contact.sides[side].body);
        f.lines[a].along.segment<6>(6 * side) << from(contact.sides[side].axis[a]),
            from(contact.sides[side].moment[a]);
      }
    f.before = slip_of(contact);
    f.model = contact.answer;
    f.share = contact.normal_load > 0.0 ? dt_s : 0.0;
  }
}

/// Solves normal impulses, joints and friction of a group in one linear system, with whose solution Bullet's
/// iterations begin. Iterations alone leave an error in each step, by which a stack creeps or falls. Patches
/// have the loads of the last step. Returns whether the solution needs no iteration.
bool BristleSolver::solve_at_once(double dt_s) {
  System& system = *system_;
  list_unknowns(dt_s);
  system.set_shape();
  // Leaves large systems to the iterations: a direct solve would take longer.
  if (system.masses.entries() > 400 * system.rows.size()) return false;
  system.set_masses(m_tmpSolverBodyPool);
  constexpr int passes = 8;
  for (int pass = 0; pass < passes; ++pass) {
    system.solve();
    if (!system.drop()) break;
  }
  system.refine();
  system.drop();

  // Applies the impulses one after the other, so that the velocities match the impulses even if the solution
  // has an error.
  for (const System::Row& row : system.rows) {
    btSolverConstraint& to = *row.constraint;
    btSolverBody &a = m_tmpSolverBodyPool[to.m_solverBodyIdA], &b = m_tmpSolverBodyPool[to.m_solverBodyIdB];
    const auto change = static_cast<btScalar>(row.impulse - row.before);
    to.m_appliedImpulse = static_cast<btScalar>(row.impulse);
    a.internalApplyImpulse(to.m_contactNormal1 * a.internalGetInvMass(), to.m_angularComponentA, change);
    b.internalApplyImpulse(to.m_contactNormal2 * b.internalGetInvMass(), to.m_angularComponentB, change);
  }
  for (const System::Friction& f : system.frictions)
    push(*f.contact, f.share * f.model.force(system.slip(f)));
  // Takes forces from the patches themselves in the later iterations, because the linear models may be wrong
  // there.
  const auto bends = [&](const Contact* c) {
    const double change = dt_s * c->response.stiffness * axes_of(*c).cwiseProduct(slip_of(*c)).norm();
    return c->scale * change > most_bent * c->answer.limit;
  };
  return !system.frictions.empty() && m_tmpSolverContactRollingFrictionConstraintPool.size() == 0 &&
         system.error() < row_error * dt_s && rub_all(dt_s) < slip_error * slip_error * dt_s * dt_s &&
         std::none_of(solved_.begin() + static_cast<std::ptrdiff_t>(first_of_group_), solved_.end(), bends);
}

/// Corrects the friction impulse of each contact of a group once. Returns the largest squared change of a
/// slip.
double BristleSolver::rub_all(double dt_s) {
  double change = 0.0;
  for (std::size_t i = first_of_group_; i < solved_.size(); ++i)
    change = std::max(change, rub(*solved_[i], dt_s));
  return change;
}

btScalar BristleSolver::solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                             btPersistentManifold** manifolds, int manifold_count,
                                             btTypedConstraint** constraints, int constraint_count,
                                             const btContactSolverInfo& info, btIDebugDraw* drawer) {
  const double dt_s = static_cast<double>(info.m_timeStep);
  if (iteration == 0 && solve_at_once(dt_s)) return 0;
  double residual = static_cast<double>(btSequentialImpulseConstraintSolver::solveSingleIteration(
      iteration, bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info, drawer));
  const int half = info.m_numIterations / 2;
  const bool ask = iteration >= half && (iteration - half) % 2 == 0 && iteration + 1 < info.m_numIterations;
  if (ask)
    for (std::size_t i = first_of_group_; i < solved_.size(); ++i) ask_patch(*solved_[i], dt_s);
  for (int sweep = 0; sweep < friction_sweeps_; ++sweep) residual = std::max(residual, rub_all(dt_s));
  // Reports a residual of at least 1 until the patches have been evaluated, because Bullet stops its
  // iterations at a small residual.
  const bool asked = iteration > half || first_of_group_ == solved_.size();
  return static_cast<btScalar>(asked ? residual : std::max(residual, 1.0));
}

/// Reads the impulses at the end of a step, before Bullet moves the bodies and deletes its constraints.
btScalar BristleSolver::solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                                      const btContactSolverInfo& info) {
  const double dt_s = static_cast<double>(info.m_timeStep);
  share_loads(dt_s);
  for (std::size_t i = first_of_group_; i < solved_.size(); ++i) {
    Contact& contact = *solved_[i];
    for (int a = 0; a < 2; ++a) contact.force[a] = contact.impulse[a] / dt_s;
    contact.by_velocity = slip_of(contact) - contact.arc;
    for (int k = 0; k < 2; ++k) {
      const btSolverBody& body = m_tmpSolverBodyPool[contact.sides[k].body];
      if (body.m_originalBody)
        contact.turns[k] = dt_s * from(body.m_angularVelocity + body.getDeltaAngularVelocity() +
                                       body.m_externalTorqueImpulse);
    }
  }
  return btSequentialImpulseConstraintSolver::solveGroupCacheFriendlyFinish(bodies, count, info);
}

/// Sets the normal load of each contact of a group, from the normal impulses of this step.
void BristleSolver::share_loads(double dt_s) {
  const auto load_of = [&](int row) {
    return std::max(static_cast<double>(m_tmpSolverContactConstraintPool[row].m_appliedImpulse), 0.0) / dt_s;
  };
  for (std::size_t i = first_of_group_; i < solved_.size(); ++i)
    solved_[i]->on_points = solved_[i]->is_listed ? load_of(solved_[i]->row) : 0.0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    double& now = surfaces_[static_cast<int>(i)].now = 0.0;
    for (const int row : rows_[i]) {
      now += load_of(row);
      const Listed* const listed = find_listed(
          *static_cast<const btManifoldPoint*>(m_tmpSolverContactConstraintPool[row].m_originalContactPoint));
      if (listed->joined) known_[listed->contact].on_points += load_of(row);
    }
  }
  for (std::size_t i = first_of_group_; i < solved_.size(); ++i) {
    Contact& contact = *solved_[i];
    contact.normal_load = surfaces_.held_load(contact.surfaces, contact.normal_load, contact.on_points);
    if (!contact.is_listed && !surfaces_.presses(contact.surfaces, contact.normal_load))
      matcher_.release(contact.key);
  }
}

/// Collects the contacts of all islands that are awake, for contacts().
void BristleSolver::allSolved(const btContactSolverInfo&, btIDebugDraw*) {
  listed_.assign(solved_.begin(), solved_.end());
}

}  // namespace bullet_example
