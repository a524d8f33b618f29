// A script: settings, when they change, and what the hand does. TOML; format: README.md of this folder.
#pragma once

#include <string>
#include <vector>

#include "tools/virtual_room/hand_motion.hpp"
#include "tools/virtual_room/room_state.hpp"

namespace room {

struct Change {
  double t = 0.0;  ///< s
  Settings settings;
};

struct Script {
  Settings settings;            ///< to begin with
  std::vector<Change> changes;  ///< by time; all settings each
  HandMotion hand;
  double seconds = 0.0;                     ///< length; by default to the last row or change
  double lost_at = 1e300, back_at = 1e300;  ///< s: the device fails for a while
};

/// Throws cli::UserError naming file, line and key. Where there is a table [material] and no [settings], all
/// but the material stays as in `before`.
Script parse_script(const std::string& text, const std::string& path, const RoomMeasures& measures,
                    const Settings& before = {});
Script read_script(const std::string& path, const RoomMeasures& measures, const Settings& before = {});

/// Settings as a TOML table's lines, exact to the bit: what parse_script reads.
std::string settings_as_toml(const Settings& settings);
/// Settings of the surface, for the table [material].
std::string material_as_toml(const Settings& settings);

}  // namespace room
