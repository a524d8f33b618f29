// The world of the virtual room: a rigid block, a tool, walls, and the tick in the paper's four steps. It has
// no threads and reads no clock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "tools/products/virtual_room/collision.hpp"
#include "tools/products/virtual_room/device.hpp"
#include "tools/products/virtual_room/friction.hpp"
#include "tools/products/virtual_room/motion_axis.hpp"
#include "tools/products/virtual_room/parameters.hpp"
#include "tools/products/virtual_room/room_state.hpp"

namespace room {

/// World of the virtual room, stepped by one thread (the haptic thread). take(), reset() and step() do not
/// allocate, lock or throw.
class World {
 public:
  /// Binds the world to the patches in `batch`, which it steps once per tick.
  World(const RoomMeasures& measures, bristle::PatchBatch& batch);

  void take(const Parameters& parameters) noexcept;
  /// Puts the block at rest in the middle of the floor and sets the time to 0. No patch may carry
  /// load.
  void reset() noexcept;

  /// Runs one tick. `grip` (0 to 1) is the share of the hand's spring that pulls the tool (0: released).
  void step(double dt_s, const Hand& hand, double grip, double force_limit) noexcept;

  /// Copies the block's position (m) and orientation (a quaternion w, x, y, z).
  void show_pose(double (&position)[3], double (&orientation)[4]) const noexcept;
  /// Fills in those fields of the room's snapshot that the world knows.
  void show(Snapshot& to) const noexcept;
  /// Copies a sample of bristles from the patch under the highest load, for the magnifying glass. It visits
  /// bristles, which is too slow for every tick.
  void show_bristles(BristleView& to) noexcept;

  double time() const noexcept { return time_; }
  const Settings& settings() const noexcept { return parameters_.settings; }
  const Vector3& block_position() const noexcept { return block_.position; }
  const Vector3& tool() const noexcept { return tool_; }
  Vector3 friction() const noexcept;  ///< friction of all patches but the tool's on the block, N
  Vector3 applied() const noexcept;   ///< force of the tool on the block, N

  /// Fills in time, displacement, forces and snaps of the last tick. Friction is that of each floor patch
  /// along its own motion, summed, so that a block that turns while it slides shows its kinetic friction too.
  void plot(PlotPoint& to) const noexcept;
  const Vector3& device_force() const noexcept { return device_force_; }
  /// Whether all numbers of the state are finite and the block is within 5 m of the middle; if not, the room
  /// must be reset.
  bool is_sound() const noexcept;
  std::uint64_t state_hash() const noexcept;

  /// Force of one contact in the last tick, for recordings. Friction is along the patch's axes.
  struct PatchForce {
    std::size_t patch;
    int key;
    double force[2], load;  ///< friction and normal load of the contact, N
    double point[2];        ///< displacement of the block along the patch's axes since the touch began, m
    double bristles;        ///< number of representatives in contact; NaN for an infinite brush
    bristle::Status status;
  };
  std::size_t patch_forces(std::array<PatchForce, patch_count>& to) const noexcept;

 private:
  // State of a contact (a corner on a surface, or the tool), kept for as long as it touches.
  struct KeptContact {
    int patch = -1;
    Vector3 along = Vector3::UnitX(), aside = Vector3::UnitY();
    Vector3 force = Vector3::Zero();  // friction of its patch on the block, N
    double load = 0.0, limit = 0.0;   // normal load, and highest elastic friction under it, N

    // Torque that the tool's pad exerts on the block about the normal, and its highest value, N m.
    double torque = 0.0, torque_limit = 0.0;
    double moved[2] = {0, 0};  // displacement along the tangent axes since the touch began, m
    MotionAxis axis;           // axis of that displacement, in the tangent axes
  };
  struct NormalContact {
    Velocity row;  // row whose product with the nine velocities is the speed of the opening gap
    double depth, damping;
    bool presses;
  };

  void move_target(double dt_s, const Hand& hand, double grip) noexcept;
  void put_tool(const Vector3& hand) noexcept;
  void refresh_mass() noexcept;
  Velocity force_beside_contacts(const Hand& hand) const noexcept;
  void add_hand_spring(double dt_s, double grip, double force_limit, Velocity& external) noexcept;
  void add_turn(double dt_s, double angle, Velocity& external) noexcept;
  void add_carriage(double dt_s, Velocity& external) noexcept;
  void find_loads(double dt_s, Velocity& external) noexcept;
  void collect_patches() noexcept;
  int free_patch(const Touch& touch) const noexcept;
  void turn_axes(const Touch& touch, KeptContact& kept) const noexcept;
  void move(double dt_s, const Velocity& mean) noexcept;
  void keep_forces(double dt_s, const Velocity& mean) noexcept;
  TangentRows tangent_rows(const Touch& touch, const KeptContact& kept) const noexcept;

  RoomMeasures measures_;
  Friction friction_;
  bristle::PatchBatch& batch_;
  Parameters parameters_;

  double time_ = 0.0;
  Pose block_;
  Vector3 tool_ = Vector3::Zero(), target_ = Vector3::Zero(), target_velocity_ = Vector3::Zero();
  bool held_ = false;       // whether the hand has held the tool since the reset
  bool caught_up_ = false;  // whether the spring's end has reached the hand
  Body body_;               // nine velocities of block and tool, and their mass
  Body coupled_;            // body_ plus the hand's spring and normal contacts in its mass
  // Contacts that act in this tick, and contacts found at its end, which act in the next.
  Touches touches_, found_;
  std::array<KeptContact, touch_keys> kept_contacts_{};
  std::array<NormalContact, touch_keys> normals_{};
  std::array<bool, patch_count> patch_used_{};
  std::array<PatchContact, patch_count> contacts_{};
  std::array<std::size_t, patch_count> contact_touch_{};  // for each contact, the index of its touch
  std::size_t contact_count_ = 0;
  double spring_ = 0.0, damper_ = 0.0;  // hand's spring (N/m) and damper (N s/m) in this tick
  Vector3 device_force_ = Vector3::Zero();
  std::uint64_t shown_key_ = 0;
  MotionAxis axis_;    // axis along which the block's centre moves over the floor
  double path_ = 0.0;  // displacement of the block along axis_ since the reset, m
};

}  // namespace room
