// Records a run to files without delaying the haptic loop, which pushes rows that another thread writes.
//
//   BASE.csv       forces, as `bristle run --out` writes them: a row per tick and patch
//   BASE.hand.csv  the hand: a row per tick
//   BASE.toml      a script that replays it: settings, their changes, the hand
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/files/force_file.hpp"
#include "tools/files/output_file.hpp"
#include "tools/virtual_room/exchange.hpp"
#include "tools/virtual_room/script.hpp"
#include "tools/virtual_room/world.hpp"

namespace room {

struct RecordRow {
  double time = 0.0;  ///< s, time at the start of the tick
  double dt = 0.0;    ///< s, duration of the tick
  Hand hand;
  bool device_there = true;
  std::uint64_t revision = 0;  ///< running number of the settings under which the tick ran
  std::size_t patches = 0;
  std::array<World::PatchForce, patch_count> patch{};
};

class Recorder {
 public:
  /// Adds a row, on the haptic thread.
  void push(const RecordRow& row) noexcept { rows_.push(row); }

  /// @name Writing thread. All throw cli::UserError. @{
  void start_forces(const std::string& path);  ///< starts a recording of forces without the hand
  void start_all(const std::string& base, const Settings& settings, std::uint64_t revision);
  /// Announces settings, before rows that use them are drained.
  void know(std::uint64_t revision, const Settings& settings);
  void drain();
  void finish();            ///< writes the remaining rows and closes; no effect if not started
  void abandon() noexcept;  ///< closes the files without writing the remaining rows
  ///@}
  bool is_open() const noexcept { return forces_.has_value(); }
  /// Whether the recording has the hand, as start_all() began it.
  bool has_hand() const noexcept { return hand_.has_value(); }
  std::uint64_t rows_written() const noexcept { return written_; }
  /// Returns the number of rows dropped because the ring was full, since the recording began.
  std::uint64_t lost() const noexcept { return rows_.dropped() - lost_before_; }

 private:
  void write(const RecordRow& row);

  SpscRing<RecordRow, 1 << 12> rows_;
  std::optional<cli::ForceFile> forces_;
  std::optional<cli::OutputFile> hand_;
  std::string base_, hand_text_, script_text_;
  std::vector<std::pair<std::uint64_t, Settings>> settings_;
  std::uint64_t revision_ = 0, written_ = 0, lost_before_ = 0;
  double end_ = 0.0;
};

/// Returns a place's name, such as "floor_corner_3", for the CSV's column `patch`.
std::string patch_name(int touch_key);

}  // namespace room
