// Data that the haptic loop and the graphic loop exchange, as plain structs copied whole (exchange.hpp).
//
// Axes are the room's: x along the floor (the direction of the push), y to the left, z off the floor; the
// origin is the middle of the floor. A slope tilts the whole room about y, so that in these axes gravity is g
// (sin slope, 0, -cos slope): a positive slope lets the block slide towards the wall at +x. SI units.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>

#include <bristle/material.hpp>

namespace room {

enum class FrictionModel : unsigned char { brush, lugre, coulomb };

/// Scenes in which other blocks stand beside the first and are moved as it is (compared.hpp).
enum class Comparison : unsigned char { none, models, rubbing, rest, ratchet };

/// Settings that a person can change while the loops run. The graphic loop sends the struct whole; the desk
/// makes patches and materials from the newest and hands them to the haptic loop (haptic_loop.cpp).
struct Settings {
  FrictionModel model = FrictionModel::brush;
  double kinetic = 0.40, peak = 0.46;  ///< coefficients: friction force over load, in sliding and at the peak
  double presliding_length = 1e-3;     ///< m, mean snap length
  double damping_per_newton = 0.0;     ///< s/m, damping of the bristles per newton of load
  double viscous_friction = 0.0;       ///< N s/m, viscous friction of a lubricant
  double stribeck_velocity = 1e-3;     ///< m/s, speed over which the bristles' damping fades
  double residual_share = bristle::Coefficients{}.residual_share;
  double shared_renewal = bristle::Coefficients{}.shared_renewal;
  /// Growth of static friction at rest per decade of time, over kinetic; 0: no ageing.
  double growth_per_decade = 0.0;
  double ageing_time = 0.1;  ///< s, time of rest from which on static friction grows
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  /// Friction of the floor towards +x over that towards -x (bristle::Lay::to_over_fro). Other than 1 it needs
  /// bristles that slide; then peak and growth_per_decade are ignored.
  double nap = 1.0;

  /// Whether the brush is infinite (Population::infinite); `bristles` is then ignored.
  bool infinite = false;
  std::uint32_t bristles = 4096;  ///< number of representatives in a patch under the block
  double mass = 0.25;             ///< kg, mass of the block
  double extra_load = 0.0;        ///< N, load on the block besides its weight
  double slope = 0.0;             ///< rad, tilt of the room about y; positive: down towards +x
  double tapping = 0.0;           ///< N, amplitude of the taps along the slope
  double hand_stiffness = 400.0;  ///< N/m, virtual spring between device and tool
  double hand_damping = 2.0;      ///< N s/m, damper beside the virtual spring

  /// m, radius of the tool's contact, a disc under uniform pressure; 0: the tool touches at a point
  double pad_radius = 0.0;
  double pad_friction = 0.0;  ///< kinetic friction coefficient of the tool; 0: that of the other surfaces
  Comparison compare = Comparison::none;

  bool operator==(const Settings&) const = default;
};

/// Mouse as a device: the place to which the person drags the tool.
struct MouseHand {
  /// Whether the button is down and the spring pulls; else the tool is released.
  bool holds = false;
  double position[3] = {0, 0, 0};  ///< m, position of the hand
  double press = 0.0;              ///< N, downward force on the tool, set by the wheel
  bool turns = false;              ///< whether the keys turn the block
  double angle = 0.0;              ///< rad, angle to which they turn it
};

/// Acts that a person can ask for. `record`, `replay`, `slow_pull` and `tour` begin with a reset, so that a
/// replay gives the same bits. In `slow_pull` a hand of the room's own pulls the block until it has broken
/// away; in `tour` it first pushes below the peak and lets go (slow_pull.hpp).
enum class Act : unsigned char {
  none,
  pause,
  run,
  single_step,
  slower,
  faster,
  reset,
  record,
  stop_recording,
  replay,
  slow_pull,
  tour
};

/// N m/rad, torsion spring by which a hand turns the block.
inline constexpr double turn_stiffness = 0.2;

/// Returns the angle (rad) about the floor's normal of a body with this orientation, a unit quaternion.
inline double heading(double w, double x, double y, double z) noexcept {
  return std::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
}

inline constexpr std::size_t most_contacts = 32;
inline constexpr std::size_t bristles_shown = 400;

/// Pairs of bodies that can touch.
enum class Between : unsigned char { block_floor, block_wall, block_roof, block_tool };

/// Contact patch with all that its drawing needs.
struct ContactView {
  std::uint64_t key = 0;
  Between between = Between::block_floor;
  /// Place of the contact, m; unit vector out of the other body into the block
  double point[3] = {0, 0, 0}, normal[3] = {0, 0, 1};
  double along[3] = {1, 0, 0}, aside[3] = {0, 1, 0};  ///< the patch's tangent axes in room axes
  double load = 0.0;                                  ///< N, normal load
  double friction[3] = {0, 0, 0};                     ///< N, friction on the block
  double limit = 0.0;                                 ///< N, highest elastic force under the present load

  /// Torque on the block about the normal, and its highest value, N m. Only a contact with an extent has
  /// them.
  double torque = 0.0, torque_limit = 0.0;
};

/// Sample of the bristles of one patch, for the magnifying glass. Deflections are in the patch's axes.
struct BristleView {
  std::uint64_t key = 0;    ///< key of the contact that the patch belongs to; 0 = none
  std::uint32_t total = 0;  ///< number of bristles in the patch
  std::size_t count = 0;    ///< number of bristles in this sample

  /// m, deflections along the patch's axes, and snap length
  float zx[bristles_shown] = {}, zy[bristles_shown] = {}, snap_length[bristles_shown] = {};
};

/// Block beside the first one in a scene of Settings::compare. It stands in a room of its own, and nobody
/// touches it.
inline constexpr std::size_t most_compared = 2;
struct ComparedBlock {
  FrictionModel model = FrictionModel::lugre;
  /// Position, m; orientation, quaternion w, x, y, z.
  double position[3] = {0, 0, 0}, orientation[4] = {1, 0, 0, 0};
  double moved = 0.0;  ///< m, creep of this block, as Snapshot::moved

  /// Strength of the contact and its second figure, as in Snapshot.
  double strength = 0.0, strength_beside = 0.0;
};

struct LoopStatistics {
  std::uint64_t ticks = 0, late_ours = 0, late_machine = 0;
  double deadline = 1e-3, p50 = 0.0, p99 = 0.0, max = 0.0;      ///< s, computing time of a tick
  double period_p50 = 0.0, period_p99 = 0.0, period_max = 0.0;  ///< s, time from tick to tick
};

/// State of the room at the end of a tick, for display.
struct Snapshot {
  std::uint64_t tick = 0;
  double time = 0.0;   ///< s, simulated time at the end of the tick
  double speed = 1.0;  ///< simulated over real time; below 1 in slow motion
  bool paused = false, recording = false;
  bool held = false;  ///< whether the hand pulls the tool; else the hand is where the tool is

  /// Position, m; orientation, quaternion w, x, y, z.
  double block_position[3] = {0, 0, 0}, block_orientation[4] = {1, 0, 0, 0};
  double block_velocity[3] = {0, 0, 0}, block_spin[3] = {0, 0, 0};  ///< velocity, m/s; spin, rad/s

  /// m, creep down the slope between taps, counted from 6 s on, when the block has settled
  double moved = 0.0;
  /// Strength of the first block's contact (N), and its second figure: newton() and beside() of compared.hpp.
  double strength = 0.0, strength_beside = 0.0;
  std::size_t compared = 0;
  ComparedBlock beside[most_compared];
  /// m, centre of the tool's sphere; place of the hand that pulls it
  double tool[3] = {0, 0, 0}, device[3] = {0, 0, 0};
  double applied[3] = {0, 0, 0};       ///< N, force of the tool on the block
  double friction[3] = {0, 0, 0};      ///< N, friction of all patches on the block except the tool's
  double device_force[3] = {0, 0, 0};  ///< N, feedback force on the hand
  bool device_lost = false;
  std::size_t contacts = 0;
  ContactView contact[most_contacts];
  BristleView bristles;
  std::uint64_t bristles_total = 0;
  double kinetic_coefficient = 0.0, peak_coefficient = 0.0;  ///< friction coefficients that follow from the
                                                             ///< settings

  /// m, presliding length that follows from the settings
  double presliding_length = 0.0;
  /// 1/m, sticking stiffness over load that follows from the settings
  double stiffness_per_newton = 0.0;
  double bristle_stiffness = 0.0;  ///< N/m, stiffness of one bristle: sigma0
  Settings settings;               ///< settings in force
  char message[128] = {};          ///< line for the user, or empty
  LoopStatistics loop;
};

/// Point of all plots; there is one per tick.
struct PlotPoint {
  /// Time, s; displacement, m; friction and applied force along x, N.
  float time = 0.0f, displacement = 0.0f, friction = 0.0f, applied = 0.0f;
  float step_time = 0.0f;  ///< s, computing time of the tick
  float snaps = 0.0f;      ///< bristles on the floor that snapped in this tick
  float holds = 0.0f;      ///< N, highest elastic friction of the floor under the present load
  float beside_displacement[most_compared] = {}, beside_friction[most_compared] = {};
};

class FloorMesh;

/// Fixed dimensions of the room, m.
struct RoomMeasures {
  double length = 0.60, width = 0.40, height = 0.30;  ///< m, size of the room along x, y and z; walls stand
                                                      ///< at x = length/2 and y = +-width/2
  double block[3] = {0.10, 0.08, 0.06};
  double tool_radius = 0.008;
  std::shared_ptr<const FloorMesh> floor;  ///< floor in place of the flat one, where it has triangles
};

}  // namespace room
