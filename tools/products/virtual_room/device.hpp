// The interface of a device that the hand holds (position in, force out): the mouse, a recording, or a driver
// for a six-axis arm.
#pragma once

namespace room {

/// State of the hand at one tick of the haptic loop, in the room's axes.
struct Hand {
  bool holds = true;               ///< whether a virtual spring connects hand and tool
  double position[3] = {0, 0, 0};  ///< position of the hand, m
  double force[3] = {0, 0, 0};     ///< force on the tool besides the spring's, N
  bool turns = false;              ///< whether a torsion spring turns the block
  double angle = 0.0;              ///< angle of the torsion spring's end about the floor's normal, rad
};

struct DeviceLimits {
  double force = 20.0;  ///< largest force that may be sent to the device, N
};

/// Device called by the haptic thread alone, which calls read() and write() once each per tick, also while
/// the room pauses. Neither may wait, lock, allocate or throw.
class Device {
 public:
  virtual ~Device() = default;
  virtual const char* name() const noexcept = 0;
  virtual DeviceLimits limits() const noexcept { return {}; }
  /// Reads the hand at the simulated time `time_s`. Returns false, without changing `hand`, if the device is
  /// lost or not connected yet.
  virtual bool read(double time_s, Hand& hand) noexcept = 0;
  /// Sends a force to the hand, N. The force is zero while the room pauses, and in the last call before the
  /// room ends or changes the device.
  virtual void write(const double (&force)[3]) noexcept = 0;
};

}  // namespace room
