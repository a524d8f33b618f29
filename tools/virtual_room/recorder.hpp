// Writes what happens to files, behind the haptic loop's back: it pushes rows, another thread drains them.
//
//   BASE.csv       forces, as `bristle run --out` writes them: a row per tick and patch
//   BASE.hand.csv  the hand: a row per tick
//   BASE.toml      a script that plays it again: settings, their changes, the hand
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
  double time = 0.0;  ///< s, at the start of the tick
  double dt = 0.0;    ///< s
  Hand hand;
  bool device_there = true;
  std::uint64_t revision = 0;  ///< of the settings in force
  std::size_t patches = 0;
  std::array<World::PatchForce, patch_count> patch{};
};

class Recorder {
 public:
  /// Haptic thread.
  void push(const RecordRow& row) noexcept { rows_.push(row); }

  /// @name The thread that writes. All throw cli::UserError.
  ///@{
  void start_forces(const std::string& path);  ///< forces alone
  void start_all(const std::string& base, const Settings& settings, std::uint64_t revision);
  void know(std::uint64_t revision, const Settings& settings);  ///< before rows of it are drained
  void drain();
  void finish();            ///< drains, and closes; nothing when not started
  void abandon() noexcept;  ///< closes what there is as it is
  ///@}
  bool is_open() const noexcept { return forces_.has_value(); }
  bool has_hand() const noexcept { return hand_.has_value(); }  ///< begun by start_all
  std::uint64_t rows_written() const noexcept { return written_; }
  /// Rows that found the ring full since the recording began.
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

/// "floor_corner_3" and the like, as the CSV's column `patch` has it.
std::string patch_name(int touch_key);

}  // namespace room
