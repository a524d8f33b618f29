// Device that the hand holds: position in, force out. Every device, from a mouse to a driver for a six-axis
// arm, stands behind this.
#pragma once

namespace room {

/// Where the hand is at a tick, in the room's axes.
struct Hand {
  bool holds = true;               ///< the virtual spring connects hand and tool
  double position[3] = {0, 0, 0};  ///< m
  double force[3] = {0, 0, 0};     ///< N, on the tool beside the spring
};

struct DeviceLimits {
  double force = 20.0;  ///< N, longest force vector that the device is asked for
};

/// Called by the haptic thread alone, once a tick each, in a pause too: neither may wait, lock, allocate or
/// throw.
class Device {
 public:
  virtual ~Device() = default;
  virtual const char* name() const noexcept = 0;
  virtual DeviceLimits limits() const noexcept = 0;
  /// The hand at `time_s` of the simulation. False: the device is lost, or not there yet; `hand` is then
  /// left alone.
  virtual bool read(double time_s, Hand& hand) noexcept = 0;
  /// N, on the hand. Zero while the room pauses, and last of all when it turns to another device or ends.
  virtual void write(const double (&force)[3]) noexcept = 0;
  /// The simulation starts again at time 0.
  virtual void restart() noexcept {}
};

}  // namespace room
