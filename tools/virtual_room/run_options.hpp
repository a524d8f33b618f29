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
  double scale = 0.0;  ///< of type and panels, 1 = 96 dots an inch; 0 = the display's
  bool panels = true;  ///< without a window: settings and plots beside the room
  std::vector<double>
      eye;  ///< azimuth, elevation (degrees), distance, x, y, z of the target (m); empty = usual
};

struct RunOptions {
  bool headless = false;
  bool virtual_clock = false;
  DeviceKind device = DeviceKind::mouse;
  std::string script;           ///< TOML; empty = none
  std::string motion;           ///< CSV, for the device `file`
  int udp_port = 47800;         ///< on loopback
  std::uint64_t udp_token = 0;  ///< that packets must carry; 0 = none
  std::string frames;           ///< folder for pictures; empty = none
  double frames_per_second = 30.0;
  double seconds = 0.0;  ///< of the simulation; 0 = to the end of the script, or until the window closes
  std::string csv;       ///< forces; empty = none
  bool tour = false;     ///< the window opens on the tour
  PictureOptions picture;
  double stall_graphics_ms = 0.0;  ///< for tests: the graphic loop stands still so long, once a second
  LoopOptions loop;
};

}  // namespace room
