// The haptic loop: steps the room's world at a fixed rate on a thread of its own, or on the caller's thread
// without waiting.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tools/products/virtual_room/device.hpp"
#include "tools/products/virtual_room/exchange.hpp"
#include "tools/products/virtual_room/room_state.hpp"
#include "tools/products/virtual_room/script.hpp"

namespace room {

struct LoopOptions {
  double rate_hz = 1000.0;      ///< rate of ticks, 1000 to 10000 Hz
  Settings settings;            ///< settings of the room at time 0
  std::vector<Change> changes;  ///< changes of settings at given times, from a script
  RoomMeasures measures;
  std::string record_to = "recording";  ///< file name, without ending, of what Act::record writes

  /// Path of a CSV file that records all forces from the start; empty: no file.
  std::string forces_csv;
};

/// Owner of the world and of its exchange with the graphic loop. Call start, stop and advance on the same
/// thread.
class HapticLoop {
 public:
  /// Allocates all patches. A null `device` means the mouse, whose hand arrives by exchange().mouse. Throws
  /// bristle::Error or cli::UserError.
  explicit HapticLoop(const LoopOptions& options, std::unique_ptr<Device> device = nullptr);
  ~HapticLoop();  ///< stops the loop, if it runs
  HapticLoop(const HapticLoop&) = delete;
  HapticLoop& operator=(const HapticLoop&) = delete;

  /// Starts ticking by the real clock, on a thread of its own, until stop() is called.
  void start();
  void stop();

  /// Closes the recording. Call it only while the loop is not running. Throws cli::UserError if the disk is
  /// full, or was full earlier so that the loop went on without recording.
  void finish_recording();
  /// Runs a number of ticks by the virtual clock, on this thread and without waiting. Equal inputs give equal
  /// bits. Call it only while the loop is not running.
  void advance(std::uint64_t ticks);

  /// Returns the channels to the haptic loop. Only the thread that shows the room may use them.
  Exchange& exchange() noexcept;
  double rate_hz() const noexcept;
  /// Returns the times of ticks. Call it after stop() or between calls of advance().
  LoopStatistics statistics() const noexcept;
  /// Returns a hash of the block's place, motion and bristles. Call it only while the loop is not running.
  std::uint64_t state_hash() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace room
