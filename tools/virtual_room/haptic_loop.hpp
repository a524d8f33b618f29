// Haptic loop: steps the world at a fixed rate on a thread of its own, or without waiting on the caller's
// thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tools/virtual_room/device.hpp"
#include "tools/virtual_room/exchange.hpp"
#include "tools/virtual_room/room_state.hpp"
#include "tools/virtual_room/script.hpp"

namespace room {

struct LoopOptions {
  double rate_hz = 1000.0;      ///< Hz, rate of ticks, 1000 to 10000
  Settings settings;            ///< settings at time 0
  std::vector<Change> changes;  ///< changes of the settings at given times
  RoomMeasures measures;
  std::string record_to = "recording";  ///< name without ending of the files that Act::record writes

  /// File in which all forces are recorded from the start; empty = none.
  std::string forces_csv;
};

/// Owner of the world and its exchange. One thread at a time calls start, stop and advance.
class HapticLoop {
 public:
  /// Allocates all patches. A null `device` means the mouse, fed through exchange().mouse. Throws
  /// bristle::Error or cli::UserError.
  explicit HapticLoop(const LoopOptions& options, std::unique_ptr<Device> device = nullptr);
  ~HapticLoop();  ///< stops the loop
  HapticLoop(const HapticLoop&) = delete;
  HapticLoop& operator=(const HapticLoop&) = delete;

  /// Starts ticking by the real clock, at the rate, on a thread of its own, until stop().
  void start();
  void stop();

  /// Closes the recording. Only while the loop is not started. Throws cli::UserError if the disk is full or
  /// was full earlier, when the loop continued without recording.
  void finish_recording();
  /// Runs this many ticks by the virtual clock, on this thread without waiting; equal inputs give equal bits.
  /// Only while the loop is not started.
  void advance(std::uint64_t ticks);

  /// Returns the exchange, for the one thread that shows the room.
  Exchange& exchange() noexcept;
  double rate_hz() const noexcept;
  /// Returns the statistics. Call it after stop() or between calls of advance().
  LoopStatistics statistics() const noexcept;
  /// Returns a hash of the block's place, motion and bristles. Only while the loop is not started.
  std::uint64_t state_hash() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace room
