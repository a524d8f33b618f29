// Reads scripts: settings, their changes, and the motion of the hand. TOML; format: README.md of this folder.
#pragma once

#include <string>
#include <vector>

#include "tools/virtual_room/hand_motion.hpp"
#include "tools/virtual_room/room_state.hpp"

namespace room {

struct Change {
  double t = 0.0;  ///< s, time of the change
  Settings settings;
};

struct Script {
  Settings settings;            ///< settings at time 0
  std::vector<Change> changes;  ///< changed settings, each complete, in order of time
  HandMotion hand;
  double seconds = 0.0;                     ///< s, length of the run; by default up to the last row or change
  double lost_at = 1e300, back_at = 1e300;  ///< s, times between which the device counts as lost
};

/// Parses a script. Throws cli::UserError naming file, line and key. A table [material] without [settings]
/// changes the material alone and keeps the rest of `before`.
Script parse_script(const std::string& text, const std::string& path, const RoomMeasures& measures,
                    const Settings& before = {});
Script read_script(const std::string& path, const RoomMeasures& measures, const Settings& before = {});

/// Returns settings as lines of a TOML table, exact to the bit, which parse_script reads.
std::string settings_as_toml(const Settings& settings);
/// Returns the surface's settings, for the table [material].
std::string material_as_toml(const Settings& settings);

}  // namespace room
