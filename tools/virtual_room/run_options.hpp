// Options of bristle-room on the command line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/virtual_room/haptic_loop.hpp"

namespace room {

enum class DeviceKind : unsigned char { mouse, script, file, udp };

struct PictureOptions {
  int width = 1280, height = 800;
  double scale = 0.0;  ///< scale of fonts and panels, 1 = 96 dots an inch; 0 = the display's
  bool panels = true;  ///< without a window: draws settings and plots beside the room

  /// Camera: azimuth and elevation (degrees); distance and x, y, z of the target (m); empty = default.
  std::vector<double> eye;
};

struct RunOptions {
  bool headless = false;
  bool virtual_clock = false;
  DeviceKind device = DeviceKind::mouse;
  std::string script;           ///< script to run, a TOML file; empty = none
  std::string floor;            ///< mesh of the floor, an OBJ file; empty = flat
  std::string motion;           ///< motion of the hand, a CSV file, for the device `file`
  int udp_port = 47800;         ///< port of the device `udp` on loopback
  std::uint64_t udp_token = 0;  ///< key of the tags that packets must carry; 0 = none
  std::string frames;           ///< folder into which pictures are written; empty = none
  double frames_per_second = 30.0;
  double seconds = 0.0;  ///< s, simulated time; 0 = to the end of the script, or until the window closes
  std::string csv;       ///< CSV file for forces; empty = none
  bool tour = false;     ///< whether the window opens on the tour
  PictureOptions picture;
  /// ms, time for which the graphic loop stands still once a second; for tests
  double stall_graphics_ms = 0.0;
  LoopOptions loop;
};

}  // namespace room
