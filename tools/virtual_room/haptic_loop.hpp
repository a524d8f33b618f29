// The haptic loop: the world, stepped at a fixed rate on a thread of its own, or as fast as it goes on the
// caller's.
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
  double rate_hz = 1000.0;      ///< 1000 to 10000
  Settings settings;            ///< to begin with
  std::vector<Change> changes;  ///< of the settings at set times
  RoomMeasures measures;
  std::string record_to = "recording";  ///< name of the files that Act::record writes, without ending
  std::string forces_csv;               ///< forces from the start; empty = none
};

/// Owns the world and its exchange. One thread at a time calls start, stop and advance.
class HapticLoop {
 public:
  /// Takes memory for all patches. `device` null: the mouse, fed through exchange().mouse. Throws
  /// bristle::Error or cli::UserError.
  explicit HapticLoop(const LoopOptions& options, std::unique_ptr<Device> device = nullptr);
  ~HapticLoop();  ///< stops
  HapticLoop(const HapticLoop&) = delete;
  HapticLoop& operator=(const HapticLoop&) = delete;

  /// Real clock: ticks at the rate, on a thread of its own, until stop().
  void start();
  void stop();

  /// Closes what is being recorded. Only while the loop is not started. Throws cli::UserError on a full disk,
  /// also on one that was full earlier: the loop went on without recording.
  void finish_recording();
  /// Virtual clock: so many ticks on this thread, without waiting; the same inputs give the same bits. Only
  /// while the loop is not started.
  void advance(std::uint64_t ticks);

  /// The other side of the exchange belongs to the one thread that shows the room.
  Exchange& exchange() noexcept;
  double rate_hz() const noexcept;
  /// Statistics, at any time after stop() or between calls of advance().
  LoopStatistics statistics() const noexcept;
  /// Hash of the block's place, motion and bristles. Only while the loop is not started.
  std::uint64_t state_hash() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace room
