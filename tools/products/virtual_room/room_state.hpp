// Data that the haptic loop and the graphic loop exchange, as plain structs that are copied whole
// (exchange.hpp).
// Axes are the room's: x along the floor (the direction of the push), y to the left, z off the floor; the
// origin is the middle of the floor. A slope tilts the whole room about y, so that in these axes gravity is g
// (sin slope, 0, -cos slope): a positive slope lets the block slide towards the wall at +x. SI units.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <bristle/fields.hpp>

namespace room {

enum class FrictionModel : unsigned char { brush, lugre, coulomb };

/// Scenes in which further blocks stand beside the first and are moved alike (compared.hpp).
enum class Comparison : unsigned char { none, models, rubbing, rest, ratchet };

/// The surfaces in contact, by the library's coefficients.
struct SurfaceSettings : bristle::Coefficients {
  bool operator==(const SurfaceSettings& other) const {
    bool same = true;
    bristle::for_each_field<bristle::Coefficients>(
        [&](const auto& field) { same = same && this->*field.member == other.*field.member; });
    return same;
  }
};

/// Settings of the room that a user can change while the loops run. The graphic loop sends them whole. The
/// desk (a thread that may allocate) makes patches and materials of the newest settings for the haptic loop.
struct Settings : SurfaceSettings {
  /// A presliding length that a hand feels, and rests that one can wait for.
  Settings() {
    presliding_length = 1e-3;
    ageing_time = 0.1;
  }
  FrictionModel model = FrictionModel::brush;
  /// Friction towards +x over friction towards -x, on a floor with a nap, as hair and cloth have
  /// (bristle::Lay::to_over_fro). A nap other than 1 needs the rule slide; then peak and growth_per_decade
  /// are ignored.
  double nap = 1.0;

  /// Whether the patches have infinite brushes (Population::infinite); `bristles` is then ignored.
  bool infinite = false;
  std::uint32_t bristles = 4096;  ///< number of representatives of a floor patch
  double mass = 0.25;             ///< mass of the block, kg
  double extra_load = 0.0;        ///< load on the block besides its weight, N
  double slope = 0.0;             ///< tilt of the room about y, rad; positive: down towards +x
  double tapping = 0.0;           ///< force of the taps along the slope, N
  double hand_stiffness = 400.0;  ///< stiffness of the spring between hand and tool, N/m
  double hand_damping = 2.0;      ///< damping between hand and tool, N s/m

  /// Radius of the tool's contact, a disc under uniform pressure, m. 0: the tool touches at a point.
  double pad_radius = 0.0;
  double pad_friction = 0.0;  ///< kinetic friction coefficient of the tool; 0: that of the surfaces
  Comparison compare = Comparison::none;

  bool operator==(const Settings&) const = default;
};

inline constexpr double gravity = 9.80665;  ///< m/s^2
/// Returns the load of the block at rest on the floor, N.
inline double load_at_rest(const Settings& s) { return s.mass * gravity * std::cos(s.slope) + s.extra_load; }

/// Hand of a user who drags the tool by mouse, as the graphic loop sends it.
struct MouseHand {
  /// Whether the mouse button is down, so that the spring pulls the tool; if not, the tool is free.
  bool holds = false;
  double position[3] = {0, 0, 0};  ///< position of the hand, m
  double press = 0.0;              ///< downward force on the tool, set by the wheel, N
  bool turns = false;              ///< whether keys turn the block
  double angle = 0.0;              ///< angle to which keys turn the block, rad
};

/// Requests that a user can make. `record`, `replay`, `slow_pull` and `tour` begin with a reset, so that a
/// replay gives the same bits. In `slow_pull` a hand of the program pulls the block until it breaks away; in
/// `tour` that hand first pushes below the peak and lets go (slow_pull.hpp).
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

/// Stiffness of the torsion spring by which a hand turns the block, N m/rad.
inline constexpr double turn_stiffness = 0.2;

/// Returns the angle (rad) by which a body with this orientation, a unit quaternion, is turned about the
/// floor's normal.
inline double heading(double w, double x, double y, double z) noexcept {
  return std::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
}

inline constexpr std::size_t most_contacts = 32;
inline constexpr std::size_t bristles_shown = 400;

/// Kinds of pairs of bodies that can touch with friction.
enum class Between : unsigned char { block_floor, block_wall, block_roof, block_tool };

/// Contact between two bodies, with all that its drawing needs.
struct ContactView {
  std::uint64_t key = 0;
  Between between = Between::block_floor;
  /// Position of the contact, m, and unit normal from the other body into the block.
  double point[3] = {0, 0, 0}, normal[3] = {0, 0, 1};
  double along[3] = {1, 0, 0}, aside[3] = {0, 1, 0};  ///< tangent axes of the patch, in the room's axes
  double load = 0.0;                                  ///< normal load, N
  double friction[3] = {0, 0, 0};                     ///< friction on the block, N
  double limit = 0.0;                                 ///< highest elastic friction at this load, N

  /// Torque on the block about the normal, and its highest value, N m. Both are 0 for a contact at a point,
  /// which has no torque.
  double torque = 0.0, torque_limit = 0.0;
};

/// Sample of one patch's bristles, for the magnifying glass. Deflections are along the patch's axes.
struct BristleView {
  std::uint64_t key = 0;    ///< key of the contact that is sampled; 0 = none
  std::uint32_t total = 0;  ///< number of bristles in the whole patch
  std::size_t count = 0;    ///< number of bristles in the sample

  /// Deflections of the sampled bristles along the patch's axes, and their snap lengths, m.
  float zx[bristles_shown] = {}, zy[bristles_shown] = {}, snap_length[bristles_shown] = {};
};

/// Figures that are shown for a block in a scene that compares (compared.hpp).
struct Figures {
  double moved = 0.0;     ///< creep down the slope, m, without the swing; counted once the block has settled
  double strength = 0.0;  ///< highest friction of the block's contact, N
  double strength_beside = 0.0;  ///< figure that is shown beside `strength`
};

/// Block beside the first one, in a scene that compares (Settings::compare). It is in a room of its own,
/// without a hand.
inline constexpr std::size_t most_compared = 2;
struct ComparedBlock : Figures {
  FrictionModel model = FrictionModel::lugre;
  /// Position of the block, m, and its orientation as a quaternion w, x, y, z.
  double position[3] = {0, 0, 0}, orientation[4] = {1, 0, 0, 0};
};

struct LoopStatistics {
  std::uint64_t ticks = 0, late_ours = 0, late_machine = 0;
  double deadline = 1e-3, p50 = 0.0, p99 = 0.0, max = 0.0;      ///< computing time of a tick, s
  double period_p50 = 0.0, period_p99 = 0.0, period_max = 0.0;  ///< time from tick to tick, s
};

/// Numbers of the surface that follow from the settings.
struct SurfaceFigures {
  double kinetic_coefficient = 0.0, peak_coefficient = 0.0;
  double presliding_length = 0.0;     ///< mean deflection of a bristle at its snap, m
  double stiffness_per_newton = 0.0;  ///< stiffness of a sticking contact over its load, 1/m
  double bristle_stiffness = 0.0;     ///< stiffness sigma0 of one bristle, N/m
};

/// State of the room at the end of a tick, as the graphic loop shows it, with the first block's figures.
struct Snapshot : Figures, SurfaceFigures {
  std::uint64_t tick = 0;
  double time = 0.0;   ///< simulated time at the end of the tick, s
  double speed = 1.0;  ///< speed of simulated time over real time; below 1: slow motion
  bool paused = false, recording = false;
  bool held = false;  ///< whether the hand's spring pulls the tool; if not, the hand is at the tool

  /// Position of the block, m, and its orientation as a quaternion w, x, y, z.
  double block_position[3] = {0, 0, 0}, block_orientation[4] = {1, 0, 0, 0};
  double block_velocity[3] = {0, 0, 0}, block_spin[3] = {0, 0, 0};  ///< block's velocity, m/s; spin, rad/s

  std::size_t compared = 0;
  ComparedBlock beside[most_compared];
  /// Centre of the tool's sphere, and position of the hand that pulls it, m.
  double tool[3] = {0, 0, 0}, device[3] = {0, 0, 0};
  double applied[3] = {0, 0, 0};       ///< force of the tool on the block, N
  double friction[3] = {0, 0, 0};      ///< friction of all patches but the tool's on the block, N
  double device_force[3] = {0, 0, 0};  ///< force that the device gives to the hand, N
  bool device_lost = false;
  std::size_t contacts = 0;
  ContactView contact[most_contacts];
  BristleView bristles;
  std::uint64_t bristles_total = 0;
  Settings settings;       ///< settings that are in force
  char message[128] = {};  ///< line of text for the user, or ""
  LoopStatistics loop;
};

/// Values of one tick that the plots show. Lengths and forces are along the motion (motion_axis.hpp), with
/// the sign of x.
struct PlotPoint {
  /// Simulated time, s; displacement of the block since the reset, m; friction of the floor and applied
  /// force, N.
  float time = 0.0f, displacement = 0.0f, friction = 0.0f, applied = 0.0f;
  float step_time = 0.0f;  ///< computing time of the tick, s
  float snaps = 0.0f;      ///< number of floor bristles that snapped in this tick
  float holds = 0.0f;      ///< highest elastic friction of the floor at this load, N
  float beside_displacement[most_compared] = {}, beside_friction[most_compared] = {};
};

/// Fixed sizes of room, block and tool, m.
struct RoomMeasures {
  /// Size of the room along x, y and z; walls are at x = length/2 and y = +-width/2.
  double length = 0.60, width = 0.40, height = 0.30;
  double block[3] = {0.10, 0.08, 0.06};
  double tool_radius = 0.008;
};

}  // namespace room
