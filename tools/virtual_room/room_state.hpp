// Data that the haptic loop and the graphic loop exchange: plain, copied whole (exchange.hpp).
//
// Axes are the room's: x along the floor (the way the block is pushed), y to the left, z off the floor; the
// origin is the middle of the floor. A slope tilts the whole room about y, so that in these axes gravity is
// g (sin slope, 0, -cos slope): a positive slope lets the block slide towards the wall at +x. SI units.
#pragma once

#include <cstddef>
#include <cstdint>

#include <bristle/material.hpp>

namespace room {

enum class FrictionModel : unsigned char { brush, lugre, coulomb };

/// Blocks that stand beside the first and move as it does (compared.hpp).
enum class Comparison : unsigned char { none, models, rubbing, rest };

/// Settings that a person can change while the loops run. The graphic loop sends it whole; the desk makes
/// patches and materials of the newest and hands them to the haptic loop (haptic_loop.cpp).
struct Settings {
  FrictionModel model = FrictionModel::brush;
  double kinetic = 0.40, peak = 0.46;  ///< friction over load
  double presliding_length = 1e-3;     ///< m, mean snap length
  double damping_per_newton = 0.0;     ///< s/m
  double viscous_friction = 0.0;       ///< N s/m, lubrication
  double stribeck_velocity = 1e-3;     ///< m/s
  double residual_share = bristle::Coefficients{}.residual_share;
  double shared_renewal = bristle::Coefficients{}.shared_renewal;
  double growth_per_decade = 0.0;  ///< of static friction at rest, over kinetic; 0: it does not age
  double ageing_time = 0.1;        ///< s, from which on it grows
  bool keep = false;               ///< SnapRule::keep instead of redraw
  bool infinite = false;           ///< Population::infinite: `bristles` is not used
  std::uint32_t bristles = 4096;   ///< representatives of one patch under the block
  double mass = 0.25;              ///< kg, of the block
  double extra_load = 0.0;         ///< N, pressed down on the block beside its weight
  double slope = 0.0;              ///< rad, of the room about y; positive: down towards +x
  double tapping = 0.0;            ///< N, amplitude of a disturbance along the slope
  double hand_stiffness = 400.0;   ///< N/m, virtual spring between device and tool
  double hand_damping = 2.0;       ///< N s/m
  double pad_radius = 0.0;         ///< m, of the tool's contact, a disc under uniform pressure; 0: a point
  double pad_friction = 0.0;  ///< kinetic friction of the tool over its load; 0: as of the other surfaces
  Comparison compare = Comparison::none;

  bool operator==(const Settings&) const = default;
};

/// The mouse as a device: where the person drags the tool to.
struct MouseHand {
  bool holds = false;              ///< the button is down: the spring pulls; else the tool is let go
  double position[3] = {0, 0, 0};  ///< m
  double press = 0.0;              ///< N, down on the tool (the wheel)
};

/// `record` and `replay` begin with a reset, so that a replay gives the same bits.
/// `slow_pull` too: a hand of the room's own draws the tool against the block until that has broken away.
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
  slow_pull
};

inline constexpr std::size_t most_contacts = 32;
inline constexpr std::size_t bristles_shown = 400;

/// Where two bodies touch.
enum class Between : unsigned char { block_floor, block_wall, block_roof, block_tool };

/// One contact patch, as it is drawn.
struct ContactView {
  std::uint64_t key = 0;
  Between between = Between::block_floor;
  double point[3] = {0, 0, 0}, normal[3] = {0, 0, 1};  ///< m; unit, out of the other body into the block
  double along[3] = {1, 0, 0}, aside[3] = {0, 1, 0};   ///< the patch's axes in the world
  double load = 0.0;                                   ///< N
  double friction[3] = {0, 0, 0};                      ///< N, on the block
  double limit = 0.0;                                  ///< N, highest elastic force under this load
  double torque = 0.0,
         torque_limit = 0.0;  ///< N m, on the block about the normal; of a contact with an extent
};

/// Some bristles of one patch, for the magnifying glass. Deflections in the patch's axes.
struct BristleView {
  std::uint64_t key = 0;    ///< of their contact; 0 = none
  std::uint32_t total = 0;  ///< in the patch
  std::size_t count = 0;    ///< of those shown
  float zx[bristles_shown] = {}, zy[bristles_shown] = {}, snap_length[bristles_shown] = {};  ///< m
};

/// A block of Settings::compare. They stand in rooms of their own, nobody touches them.
inline constexpr std::size_t most_compared = 2;
struct ComparedBlock {
  FrictionModel model = FrictionModel::lugre;
  double position[3] = {0, 0, 0}, orientation[4] = {1, 0, 0, 0};  ///< m; quaternion w, x, y, z
  double moved = 0.0;                                             ///< m, as Snapshot::moved
  double strength = 0.0, strength_beside = 0.0;                   ///< as Snapshot's
};

struct LoopStatistics {
  std::uint64_t ticks = 0, late_ours = 0, late_machine = 0;
  double deadline = 1e-3, p50 = 0.0, p99 = 0.0, max = 0.0;      ///< s, computing time of a tick
  double period_p50 = 0.0, period_p99 = 0.0, period_max = 0.0;  ///< s, from tick to tick
};

/// The room at the end of a tick.
struct Snapshot {
  std::uint64_t tick = 0;
  double time = 0.0;   ///< s, simulated
  double speed = 1.0;  ///< of the simulation, over real time: below 1 in slow motion
  bool paused = false, recording = false;
  bool held = false;  ///< the hand pulls the tool; else `device` is where the tool is
  double block_position[3] = {0, 0, 0}, block_orientation[4] = {1, 0, 0, 0};  ///< m; quaternion w, x, y, z
  double block_velocity[3] = {0, 0, 0}, block_spin[3] = {0, 0, 0};            ///< m/s, rad/s
  double moved = 0.0;  ///< m, down the slope between taps, since six seconds, when the block has settled
  double strength = 0.0, strength_beside = 0.0;  ///< N, and what compared.hpp says; of the block itself
  std::size_t compared = 0;
  ComparedBlock beside[most_compared];
  double tool[3] = {0, 0, 0}, device[3] = {0, 0, 0};  ///< m: the sphere that touches; the hand that pulls it
  double applied[3] = {0, 0, 0};                      ///< N, of the tool on the block
  double friction[3] = {0, 0, 0};      ///< N, of all patches on the block, those of the tool left out
  double device_force[3] = {0, 0, 0};  ///< N, to the hand
  bool device_lost = false;
  std::size_t contacts = 0;
  ContactView contact[most_contacts];
  BristleView bristles;
  std::uint64_t bristles_total = 0;
  double kinetic_coefficient = 0.0, peak_coefficient = 0.0;  ///< as they follow from the settings
  double presliding_length = 0.0;                            ///< m, the same
  double stiffness_per_newton = 0.0;                         ///< 1/m, the same
  double bristle_stiffness = 0.0;                            ///< N/m, of one: sigma0
  Settings settings;                                         ///< those in force
  char message[128] = {};                                    ///< one line for the person, or empty
  LoopStatistics loop;
};

/// A point of the plots: one per tick.
struct PlotPoint {
  float time = 0.0f, displacement = 0.0f, friction = 0.0f, applied = 0.0f;  ///< s, m, N, N along the floor
  float step_time = 0.0f;                                                   ///< s
  float snaps = 0.0f;  ///< of bristles on the floor, in this tick
  float holds = 0.0f;  ///< N: highest elastic friction of the floor under the present load
  float beside_displacement[most_compared] = {}, beside_friction[most_compared] = {};
};

/// The room's fixed measures, m.
struct RoomMeasures {
  double length = 0.60, width = 0.40, height = 0.30;  ///< x, y, z; walls at x = length/2 and y = +-width/2
  double block[3] = {0.10, 0.08, 0.06};
  double tool_radius = 0.008;
};

}  // namespace room
