#include "tools/products/virtual_room/world.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <Eigen/Cholesky>

#include "tools/libraries/scene/waveform.hpp"
#include "tools/products/virtual_room/compared.hpp"

namespace room {
namespace {

using Vector9 = Eigen::Matrix<double, velocities, 1>;
using Matrix9 = Eigen::Matrix<double, velocities, velocities>;

constexpr double tool_mass = 0.05;   // mass of the tool that the hand moves, kg
constexpr double air_damping = 0.5;  // damping of the tool's motion by air, N s/m

// Normal stiffness of one contact, N/m, with which a block at rest sinks in by a few micrometres.
constexpr double normal_stiffness = 1e5;
constexpr double fastest_target = 2.0;  // limit of the speed of the spring's hand end, m/s

// Speed, m/s, at which the spring's end at the hand moves towards the hand if the two are apart at the
// beginning.
constexpr double catching_up = 0.15;
// Time from one tap on the block to the next, and duration of a tap, s. Taps go alternately down and up the
// slope.
constexpr double tap_period = 0.5 * tap_pair, tap_length = 0.02;
// Distance from the middle of the room, m, beyond which the block counts as lost and the room is reset.
constexpr double far_away = 5.0;
// Relative change of load below which a patch keeps its load. Otherwise rounding alone would make the patch
// visit its bristles.
constexpr double load_grain = 1e-9;
// Stiffness (N/m) and largest force (N) with which the carriage moves a compared block.
constexpr double carriage_stiffness = 1e5, carriage_force = 20.0;

// Returns the force of the taps at a time, over their amplitude: half sine waves, down and up the slope.
double tap(double time) {
  const double count = std::floor(time / tap_period);
  const double into = time - count * tap_period;
  if (into >= tap_length) return 0.0;
  const double size = cli::sine_of_turns(0.5 * into / tap_length);
  return std::fmod(count, 2.0) == 0.0 ? size : -size;
}

// Returns the first tangent axis of a flat surface of the room. It is parallel to an axis of the room.
Vector3 along_of(Surface surface) {
  return surface == Surface::end_wall ? Vector3(0, 1, 0) : Vector3(1, 0, 0);
}

Vector9 row_along(const Touch& touch, const Vector3& arm, const Vector3& axis) {
  Vector9 row = Vector9::Zero();
  if (touch.pair != Touch::Pair::tool_surface) {
    row.head<3>() = axis;
    row.segment<3>(3) = arm.cross(axis);
  }
  if (touch.pair == Touch::Pair::block_tool) row.tail<3>() = -axis;
  if (touch.pair == Touch::Pair::tool_surface) row.tail<3>() = axis;
  return row;
}

// Returns the row vector that gives the block's spin against the tool from the nine velocities. The tool
// itself does not turn.
Vector9 spin_row(const Touch& touch) {
  Vector9 row = Vector9::Zero();
  if (touch.pair == Touch::Pair::block_tool) row.segment<3>(3) = touch.normal;
  return row;
}

Between between_of(const Touch& touch) {
  if (touch.pair == Touch::Pair::block_tool) return Between::block_tool;
  if (touch.surface == Surface::floor) return Between::block_floor;
  return touch.surface == Surface::roof ? Between::block_roof : Between::block_wall;
}

void copy(const Vector3& from, double (&to)[3]) {
  for (int i = 0; i < 3; ++i) to[i] = from[i];
}

}  // namespace

World::World(const RoomMeasures& measures, bristle::PatchBatch& batch)
    : measures_(measures), friction_(batch), batch_(batch) {
  reset();
}

void World::take(const Parameters& parameters) noexcept {
  parameters_ = parameters;
  friction_.take(parameters);
}

void World::reset() noexcept {
  time_ = 0.0;
  block_ = {};
  block_.position.z() =
      0.5 * measures_.block[2] - 0.25 * load_at_rest(parameters_.settings) / normal_stiffness;
  tool_ = Vector3(-0.5 * measures_.block[0] - 0.05, 0.0, 0.5 * measures_.block[2]);
  target_ = tool_;
  target_velocity_.setZero();
  held_ = caught_up_ = false;
  body_ = {};
  kept_contacts_ = {};
  patch_used_ = {};
  contact_count_ = 0;
  device_force_.setZero();
  axis_ = {};
  path_ = 0.0;
  touches_.count = 0;
  find_touches(measures_, block_, tool_, found_);
}

void World::step(double dt, const Hand& hand, double grip, double force_limit) noexcept {
  // 1. New velocity and position, from forces, loads and friction at the contacts found last tick.
  std::swap(touches_, found_);
  move_target(dt, hand, grip);
  refresh_mass();
  Velocity external = force_beside_contacts(hand);
  add_hand_spring(dt, grip, force_limit, external);
  if (hand.turns) add_turn(dt, hand.angle, external);
  if (scene_of(parameters_.settings.compare).driven) add_carriage(dt, external);
  find_loads(dt, external);
  collect_patches();
  const bristle::Span<PatchContact> contacts{contacts_.data(), contact_count_};
  const Velocity mean = friction_.find_motion(dt, coupled_, external, {contacts.data(), contacts.size()});
  move(dt, mean);

  // 2. Collision detection: finds the contacts that act in the next tick.
  find_touches(measures_, block_, tool_, found_);

  // 3. Friction: steps every patch along its displacement in this tick, then sets the velocity that the
  // forces cause.
  friction_.step(dt, coupled_, external, contacts);
  body_.velocity = coupled_.velocity;
  keep_forces(dt, mean);

  // 4. Feedback: computes the force that the hand feels, that of the spring between it and the tool.
  const Vector3 tool_velocity = body_.velocity.tail<3>();
  device_force_ = spring_ * (tool_ - target_) + damper_ * (tool_velocity - target_velocity_);
  const double size = device_force_.norm();
  if (size > force_limit) device_force_ *= force_limit / size;
  time_ += dt;
}

// Moves the hand's end of the spring towards the hand, at most as fast as a hand moves, since a mouse may
// jump. A tool that is far away is fetched slowly: the force limit bounds the spring, but not the impact of a
// fast tool.
void World::move_target(double dt, const Hand& hand, double grip) noexcept {
  if (!hand.holds || grip <= 0.0) {
    target_ = tool_;
    target_velocity_.setZero();
    caught_up_ = false;
    return;
  }
  const Vector3 wanted(hand.position[0], hand.position[1], hand.position[2]);
  if (!held_) put_tool(wanted);
  const Vector3 before = target_;
  const Vector3 missing = wanted - target_;
  const double length = missing.norm(), longest = (caught_up_ ? fastest_target : catching_up) * dt;
  caught_up_ = caught_up_ || length <= longest;
  target_ += length > longest ? Vector3(missing * (longest / length)) : missing;
  target_velocity_ = (target_ - before) / dt;
}

// Puts the tool at the hand's position when the hand first takes hold of it after the reset, unless that
// is inside the block.
void World::put_tool(const Vector3& hand) noexcept {
  held_ = true;
  const Vector3 half(0.5 * measures_.block[0], 0.5 * measures_.block[1], 0.5 * measures_.block[2]);
  const Vector3 out =
      ((block_.orientation.conjugate() * (hand - block_.position)).cwiseAbs() - half).cwiseMax(0.0);
  if (out.norm() < measures_.tool_radius) return;
  tool_ = target_ = hand;
  caught_up_ = true;
  body_.velocity.tail<3>().setZero();
  find_touches(measures_, block_, tool_, touches_);
}

void World::refresh_mass() noexcept {
  const Settings& s = parameters_.settings;
  const auto& b = measures_.block;
  const Eigen::Vector3d inertia =
      (s.mass / 12.0) *
      Eigen::Vector3d(b[1] * b[1] + b[2] * b[2], b[0] * b[0] + b[2] * b[2], b[0] * b[0] + b[1] * b[1]);
  const Eigen::Matrix3d turn = block_.orientation.toRotationMatrix();
  body_.mass.setZero();
  body_.mass.diagonal().head<3>().setConstant(s.mass);
  body_.mass.block<3, 3>(3, 3) = turn * inertia.asDiagonal() * turn.transpose();
  body_.mass.diagonal().tail<3>().setConstant(tool_mass);
  coupled_ = body_;
}

Velocity World::force_beside_contacts(const Hand& hand) const noexcept {
  const Settings& s = parameters_.settings;
  Velocity f = Vector9::Zero();
  f[0] = s.mass * gravity * std::sin(s.slope) + s.tapping * tap(time_);
  f[2] = -load_at_rest(s);
  const Eigen::Vector3d spin = body_.velocity.segment<3>(3);
  f.segment<3>(3) = -spin.cross(Eigen::Vector3d(body_.mass.block<3, 3>(3, 3) * spin));
  for (int i = 0; i < 3; ++i) f[6 + i] = hand.force[i];
  return f;
}

// Adds the hand's spring and damper to mass and forces implicitly, so that even a stiff spring is stable.
void World::add_hand_spring(double dt, double grip, double force_limit, Velocity& external) noexcept {
  spring_ = grip * parameters_.settings.hand_stiffness;
  damper_ = grip * parameters_.settings.hand_damping;
  const Vector3 velocity = body_.velocity.tail<3>();
  Vector3 stretch = target_ - tool_;
  if (spring_ * stretch.norm() > force_limit) stretch *= force_limit / (spring_ * stretch.norm());
  const double gain = dt * spring_ + damper_ + air_damping;
  external.tail<3>() += spring_ * stretch + damper_ * target_velocity_ - gain * velocity;
  coupled_.mass.diagonal().tail<3>().array() += dt * gain;
}

// Adds a torsion spring between hand and block about the floor's normal, implicitly. Its damping is about
// critical for the default block.
void World::add_turn(double dt, double angle, Velocity& external) noexcept {
  constexpr double damper = 0.015;  // damping of the torsion spring, N m s/rad
  constexpr double full_turn = 6.28318530717959;
  const double gain = dt * turn_stiffness + damper;
  const Rotation& q = block_.orientation;
  const double behind = std::remainder(angle - heading(q.w(), q.x(), q.y(), q.z()), full_turn);
  external[5] += turn_stiffness * behind - gain * body_.velocity[5];
  coupled_.mass(5, 5) += dt * gain;
}

// Adds a stiff spring from the block's centre to a carriage on rails, implicitly. The force is limited, so
// that a block far from the carriage is moved gently.
void World::add_carriage(double dt, Velocity& external) noexcept {
  const Settings& s = parameters_.settings;
  const double damper = 2.0 * std::sqrt(carriage_stiffness * s.mass), gain = dt * carriage_stiffness + damper;
  const double now = carriage_position(s, time_), next = carriage_position(s, time_ + dt);
  const double target[2] = {now, 0.0}, speed[2] = {(next - now) / dt, 0.0};
  for (int axis = 0; axis < 2; ++axis) {
    const double longest = carriage_force / carriage_stiffness;
    const double stretch = std::clamp(target[axis] - block_.position[axis], -longest, longest);
    external[axis] += carriage_stiffness * stretch + gain * (speed[axis] - body_.velocity[axis]);
    coupled_.mass(axis, axis) += dt * gain;
  }
}

// Finds the normal loads of the next step. A pressing contact is a spring with a damper that is critical for
// a quarter of the block's mass, evaluated at the end of the step. Contacts switch between pressing and open
// until all are consistent, in at most 12 passes; friction is that of the last tick. Afterwards mass and
// `external` include the pressing contacts.
void World::find_loads(double dt, Velocity& external) noexcept {
  const double damper = 2.0 * std::sqrt(0.25 * normal_stiffness * parameters_.settings.mass);
  Vector9 push = external;
  for (std::size_t i = 0; i < touches_.count; ++i) {
    const Touch& touch = touches_.list[i];
    KeptContact& kept = kept_contacts_[static_cast<std::size_t>(touch.key())];
    const Vector3 arm = touch.point - block_.position;
    NormalContact& c = normals_[i];
    c.row = row_along(touch, arm, touch.normal);
    c.depth = -touch.gap;
    c.damping = c.depth > 0.0 ? damper : 0.0;
    c.presses = c.depth > 0.0;
    turn_axes(touch, kept);
    for (int axis = 0; axis < 3; ++axis) {
      if (kept.force[axis] == 0.0) continue;
      push += kept.force[axis] * row_along(touch, arm, Vector3::Unit(axis));
    }
    if (kept.torque != 0.0) push += kept.torque * spin_row(touch);
  }
  const Vector9 start = body_.velocity;
  const Vector9 momentum = coupled_.mass * start + dt * push;
  const auto gain_of = [&](const NormalContact& c) { return dt * normal_stiffness + c.damping; };
  Vector9 u = start;
  for (int pass = 0; pass < 12; ++pass) {
    Matrix9 a = coupled_.mass;
    Vector9 b = momentum;
    for (std::size_t i = 0; i < touches_.count; ++i) {
      const NormalContact& c = normals_[i];
      if (!c.presses) continue;
      a += (dt * gain_of(c)) * c.row * c.row.transpose();
      b += (dt * normal_stiffness * c.depth) * c.row;
    }
    u = a.llt().solve(b);
    bool changed = false;
    for (std::size_t i = 0; i < touches_.count; ++i) {
      NormalContact& c = normals_[i];
      const double load = normal_stiffness * c.depth - gain_of(c) * c.row.dot(u);
      if (c.presses == (load > 0.0)) continue;
      c.presses = load > 0.0;
      changed = true;
    }
    if (!changed) break;
  }
  for (std::size_t i = 0; i < touches_.count; ++i) {
    const NormalContact& c = normals_[i];
    KeptContact& kept = kept_contacts_[static_cast<std::size_t>(touches_.list[i].key())];
    const double gain = gain_of(c);
    const double load = c.presses ? std::max(normal_stiffness * c.depth - gain * c.row.dot(u), 0.0) : 0.0;
    if (load == 0.0 || std::fabs(load - kept.load) > load_grain * load) kept.load = load;
    if (!c.presses) continue;
    coupled_.mass += (dt * gain) * c.row * c.row.transpose();
    external += (normal_stiffness * c.depth - gain * c.row.dot(start)) * c.row;
  }
}

void World::turn_axes(const Touch& touch, KeptContact& kept) const noexcept {
  // Turns the tangent axes of a contact with its normal, so that bristles keep their directions.
  if (touch.pair == Touch::Pair::block_surface) kept.along = along_of(touch.surface);
  Vector3 along = kept.along - touch.normal * touch.normal.dot(kept.along);
  if (along.norm() < 0.1) along = touch.normal.unitOrthogonal();
  kept.along = along.normalized();
  kept.aside = touch.normal.cross(kept.along);
}

int World::free_patch(const Touch& touch) const noexcept {
  std::size_t first = tool_patch, last = tool_patch;
  if (touch.pair == Touch::Pair::block_surface) {
    const std::size_t group = touch.surface == Surface::floor      ? 0
                              : touch.surface == Surface::end_wall ? 1
                              : touch.surface == Surface::roof     ? 3
                                                                   : 2;
    first = 4 * group;
    last = first + 3;
  }
  for (std::size_t p = first; p <= last; ++p) {
    if (!patch_used_[p]) return static_cast<int>(p);
  }
  return -1;
}

TangentRows World::tangent_rows(const Touch& touch, const KeptContact& kept) const noexcept {
  const Vector3 arm = touch.point - block_.position;
  TangentRows rows;
  rows.row(0) = row_along(touch, arm, kept.along).transpose();
  rows.row(1) = row_along(touch, arm, kept.aside).transpose();
  return rows;
}

// Lists the contacts of this step. A contact gets a patch when it first presses, and returns it one step
// after it stopped pressing: in that step, the load of zero resets the bristles.
void World::collect_patches() noexcept {
  std::array<bool, touch_keys> near{};
  contact_count_ = 0;
  const auto add = [&](int patch, const TangentRows& rows, const Velocity& spin, double load,
                       std::size_t touch) {
    PatchContact& c = contacts_[contact_count_];
    c = {};
    c.patch = static_cast<std::size_t>(patch);
    c.rows = rows;
    c.spin = spin;
    c.load = load;
    contact_touch_[contact_count_++] = touch;
  };
  for (std::size_t i = 0; i < touches_.count; ++i) {
    const Touch& touch = touches_.list[i];
    if (touch.pair == Touch::Pair::tool_surface) continue;
    KeptContact& kept = kept_contacts_[static_cast<std::size_t>(touch.key())];
    near[static_cast<std::size_t>(touch.key())] = true;
    if (kept.patch < 0 && kept.load > 0.0) {
      kept.patch = free_patch(touch);
      kept.moved[0] = kept.moved[1] = 0.0;
      if (kept.patch >= 0) patch_used_[static_cast<std::size_t>(kept.patch)] = true;
    }
    if (kept.patch >= 0) add(kept.patch, tangent_rows(touch, kept), spin_row(touch), kept.load, i);
  }
  for (std::size_t k = 0; k < touch_keys; ++k) {
    KeptContact& kept = kept_contacts_[k];
    if (near[k]) continue;
    kept.load = 0.0;
    if (kept.patch >= 0) add(kept.patch, TangentRows::Zero(), Velocity::Zero(), 0.0, touches_.count);
    if (kept.patch >= 0) patch_used_[static_cast<std::size_t>(kept.patch)] = false;
    kept = {};
  }
}

void World::move(double dt, const Velocity& mean) noexcept {
  block_.position += dt * mean.head<3>();
  axis_.move(dt * mean[0], dt * mean[1], parameters_.settings.presliding_length);
  path_ += axis_.along(dt * mean[0], dt * mean[1]);
  const Eigen::Vector3d turn = dt * mean.segment<3>(3);
  const double angle = turn.norm();
  if (angle > 0.0) {
    const Eigen::Quaterniond by(Eigen::AngleAxisd(angle, turn / angle));
    block_.orientation = by * block_.orientation;
    block_.orientation.normalize();
  }
  tool_ += dt * mean.tail<3>();
}

void World::keep_forces(double dt, const Velocity& mean) noexcept {
  for (std::size_t i = 0; i < contact_count_; ++i) {
    const PatchContact& c = contacts_[i];
    if (contact_touch_[i] >= touches_.count) continue;
    KeptContact& kept = kept_contacts_[static_cast<std::size_t>(touches_.list[contact_touch_[i]].key())];
    const Eigen::Vector2d moved = dt * c.rows * mean;
    kept.moved[0] += moved[0];
    kept.moved[1] += moved[1];
    kept.axis.move(moved[0], moved[1], parameters_.settings.presliding_length);
    kept.force = c.force[0] * kept.along + c.force[1] * kept.aside;
    kept.limit = c.limit;
    kept.torque = c.torque;
    kept.torque_limit = c.torque_limit;
    if (c.load > 0.0) continue;
    patch_used_[c.patch] = false;
    kept.patch = -1;
    kept.force.setZero();
    kept.torque = 0.0;
  }
}

Vector3 World::friction() const noexcept {
  Vector3 sum = Vector3::Zero();
  for (std::size_t k = 0; k < surfaces * corners; ++k) sum += kept_contacts_[k].force;
  return sum;
}

void World::plot(PlotPoint& to) const noexcept {
  double friction = 0.0, holds = 0.0;
  for (std::size_t corner = 0; corner < corners; ++corner) {  // the corners on the floor come first
    const KeptContact& kept = kept_contacts_[corner];
    friction += kept.axis.along(kept.force.dot(kept.along), kept.force.dot(kept.aside));
    if (kept.patch >= 0) holds += kept.limit;
  }
  const Vector3 force = applied();
  to.time = static_cast<float>(time_);
  to.displacement = static_cast<float>(path_);
  to.friction = static_cast<float>(friction);
  to.applied = static_cast<float>(axis_.along(force.x(), force.y()));
  to.snaps = static_cast<float>(friction_.snaps());
  to.holds = static_cast<float>(holds);
}

Vector3 World::applied() const noexcept {
  const KeptContact& kept = kept_contacts_[surfaces * corners];
  Vector3 force = kept.force;
  for (std::size_t i = 0; i < touches_.count; ++i) {
    if (touches_.list[i].pair == Touch::Pair::block_tool) force += kept.load * touches_.list[i].normal;
  }
  return force;
}

bool World::is_sound() const noexcept {
  return block_.position.allFinite() && block_.orientation.coeffs().allFinite() && tool_.allFinite() &&
         body_.velocity.allFinite() && block_.position.norm() < far_away;
}

std::uint64_t World::state_hash() const noexcept {
  std::uint64_t hash = friction_.state_hash();
  const auto mix = [&](double value) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 32;
  };
  for (int i = 0; i < 3; ++i) mix(block_.position[i]);
  for (int i = 0; i < 4; ++i) mix(block_.orientation.coeffs()[i]);
  for (int i = 0; i < 3; ++i) mix(tool_[i]);
  for (int i = 0; i < velocities; ++i) mix(body_.velocity[i]);
  return hash;
}

void World::show_pose(double (&position)[3], double (&orientation)[4]) const noexcept {
  copy(block_.position, position);
  const Rotation& q = block_.orientation;
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  std::copy(wxyz, wxyz + 4, orientation);
}

void World::show(Snapshot& to) const noexcept {
  to.time = time_;
  show_pose(to.block_position, to.block_orientation);
  copy(body_.velocity.head<3>(), to.block_velocity);
  copy(body_.velocity.segment<3>(3), to.block_spin);
  copy(tool_, to.tool);
  copy(applied(), to.applied);
  copy(friction(), to.friction);
  copy(device_force_, to.device_force);
  to.settings = parameters_.settings;
  static_cast<SurfaceFigures&>(to) = parameters_;
  to.contacts = 0;
  to.bristles_total = 0;
  for (std::size_t i = 0; i < touches_.count && to.contacts < most_contacts; ++i) {
    const Touch& touch = touches_.list[i];
    const KeptContact& kept = kept_contacts_[static_cast<std::size_t>(touch.key())];
    if (kept.patch < 0) continue;
    ContactView& view = to.contact[to.contacts++];
    view.key = static_cast<std::uint64_t>(touch.key()) + 1;
    view.between = between_of(touch);
    copy(touch.point, view.point);
    copy(touch.normal, view.normal);
    copy(kept.along, view.along);
    copy(kept.aside, view.aside);
    copy(kept.force, view.friction);
    view.load = kept.load;
    view.limit = kept.limit;
    view.torque = kept.torque;
    view.torque_limit = kept.torque_limit;
    if (parameters_.settings.model == FrictionModel::brush)
      to.bristles_total += bristles_of(parameters_.settings, static_cast<std::size_t>(kept.patch));
  }
}

void World::show_bristles(BristleView& to) noexcept {
  const auto index = [](std::uint64_t key) { return static_cast<std::size_t>(key - 1); };
  if (shown_key_ == 0 || kept_contacts_[index(shown_key_)].patch < 0) {
    shown_key_ = 0;
    double highest = 0.0;
    for (std::size_t k = 0; k <= surfaces * corners; ++k) {
      // Shows bristles of the tool's contact (the last in the list) only if there is no other contact.
      if (k == surfaces * corners && shown_key_ != 0) break;
      if (kept_contacts_[k].patch < 0 || kept_contacts_[k].load <= highest) continue;
      highest = kept_contacts_[k].load;
      shown_key_ = k + 1;
    }
  }
  to.key = shown_key_;
  to.total = 0;
  to.count = 0;
  if (shown_key_ == 0 || parameters_.settings.model != FrictionModel::brush) return;
  double zx[bristles_shown], zy[bristles_shown], delta[bristles_shown];
  const auto patch = static_cast<std::size_t>(kept_contacts_[index(shown_key_)].patch);
  to.total = bristles_of(parameters_.settings, patch);
  to.count = batch_.read_bristles(friction_.patch(patch), zx, zy, delta);
  for (std::size_t i = 0; i < to.count; ++i) {
    to.zx[i] = static_cast<float>(zx[i]);
    to.zy[i] = static_cast<float>(zy[i]);
    to.snap_length[i] = static_cast<float>(delta[i]);
  }
}

std::size_t World::patch_forces(std::array<PatchForce, patch_count>& to) const noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < contact_count_; ++i) {
    if (contact_touch_[i] >= touches_.count) continue;
    const int key = touches_.list[contact_touch_[i]].key();
    const KeptContact& kept = kept_contacts_[static_cast<std::size_t>(key)];
    const PatchContact& c = contacts_[i];
    to[count++] = {c.patch,
                   key,
                   {c.force[0], c.force[1]},
                   c.load,
                   {kept.moved[0], kept.moved[1]},
                   friction_.active_bristles(c.patch),
                   c.status};
  }
  return count;
}

}  // namespace room
