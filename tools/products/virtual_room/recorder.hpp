// Records a run of the room to files. The haptic loop only hands over rows; another thread writes them.
//   BASE.csv       forces, as `bristle run --out` writes them: a row per tick and patch
//   BASE.hand.csv  the hand: a row per tick
//   BASE.toml      a script that replays it: settings, their changes, the hand
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/libraries/files/force_file.hpp"
#include "tools/libraries/files/output_file.hpp"
#include "tools/products/virtual_room/exchange.hpp"
#include "tools/products/virtual_room/script.hpp"
#include "tools/products/virtual_room/world.hpp"

namespace room {

struct RecordRow {
  double time = 0.0;  ///< time at the start of the tick, s
  double dt = 0.0;    ///< duration of the tick, s
  Hand hand;
  bool device_there = true;
  std::uint64_t revision = 0;  ///< number of the settings in force in the tick
  std::size_t patches = 0;
  std::array<World::PatchForce, patch_count> patch{};
};

class Recorder {
 public:
  /// Adds the row of a tick to the recording; for the haptic thread. Does not wait.
  void push(const RecordRow& row) noexcept { rows_.push(row); }

  /// @name For the writing thread. All throw cli::UserError.
  /// @{
  void start_forces(const std::string& path);  ///< starts a recording of forces, without the hand
  void start_all(const std::string& base, const Settings& settings, std::uint64_t revision);
  /// Tells the recorder which settings a revision stands for. Call it before drain() meets rows of that
  /// revision.
  void know(std::uint64_t revision, const Settings& settings);
  void drain();
  void finish();            ///< writes the rows left, and closes; no effect if not started
  void abandon() noexcept;  ///< closes the files without writing the rows left
  ///@}
  bool is_open() const noexcept { return forces_.has_value(); }
  /// Whether the recording includes the hand, as one does that start_all() began.
  bool has_hand() const noexcept { return hand_.has_value(); }
  std::uint64_t rows_written() const noexcept { return written_; }
  /// Returns how many rows were lost since the recording began, because the ring between threads was full.
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

/// Returns the name of a contact place, such as "floor_corner_3", for the column `patch` of the CSV file.
std::string patch_name(int touch_key);

}  // namespace room
