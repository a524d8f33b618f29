// Reads scripts of the room: settings, their changes, the hand's motion. The README.md beside this file
// describes the format.
#pragma once

#include <string>
#include <vector>

#include "tools/products/virtual_room/hand_motion.hpp"
#include "tools/products/virtual_room/room_state.hpp"

namespace room {

struct Change {
  double t = 0.0;  ///< time of the change, s
  Settings settings;
};

struct Script {
  Settings settings;            ///< settings of the room at time 0
  std::vector<Change> changes;  ///< changes in order of time, each with all settings
  HandMotion hand;
  std::string title;                        ///< line in the pictures; empty: that of the scene
  double seconds = 0.0;                     ///< length of the run, s; default: up to the last row or change
  double lost_at = 1e300, back_at = 1e300;  ///< times between which the device is lost, s
};

/// Parses a script. Throws cli::UserError naming file, line and key. A script with a table [material] but
/// without [settings] changes only the material; other settings stay as in `before`.
Script parse_script(const std::string& text, const std::string& path, const RoomMeasures& measures,
                    const Settings& before = {});
Script read_script(const std::string& path, const RoomMeasures& measures, const Settings& before = {});

/// Returns settings as lines of a TOML table, exact to the bit, for parse_script() to read.
std::string settings_as_toml(const Settings& settings);
/// Returns those settings that describe the surface, as lines for the table [material].
std::string material_as_toml(const Settings& settings);

}  // namespace room
