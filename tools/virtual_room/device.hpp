// Device that the hand holds: position in, force out. The interface of every device, from a mouse to a driver
// for a six-axis arm.
#pragma once

namespace room {

/// State of the hand at a tick, in the room's axes.
struct Hand {
  bool holds = true;               ///< whether the virtual spring connects hand and tool
  double position[3] = {0, 0, 0};  ///< m, position of the hand
  double force[3] = {0, 0, 0};     ///< N, force on the tool besides the spring
  bool turns = false;              ///< whether a torsion spring connects hand and block
  double angle = 0.0;  ///< rad, angle about the floor's normal to which that spring turns the block
};

struct DeviceLimits {
  double force = 20.0;  ///< N, largest force that the device is asked for
};

/// Device, called by the haptic thread alone. It calls read and write once a tick each, also in a pause;
/// neither may wait, lock, allocate or throw.
class Device {
 public:
  virtual ~Device() = default;
  virtual const char* name() const noexcept = 0;
  virtual DeviceLimits limits() const noexcept = 0;
  /// Reads the hand at the simulated time `time_s`. Returns false, and leaves `hand` alone, if the device is
  /// lost or not there yet.
  virtual bool read(double time_s, Hand& hand) noexcept = 0;
  /// Sends a force on the hand, N. It is zero while the room pauses, and in the last call before the room
  /// changes the device or ends.
  virtual void write(const double (&force)[3]) noexcept = 0;
  /// Tells the device that the simulation restarts at time 0.
  virtual void restart() noexcept {}
};

}  // namespace room
