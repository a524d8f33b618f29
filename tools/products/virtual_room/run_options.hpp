// Options that the program bristle-room takes on the command line.
#pragma once

#include <string>
#include <vector>

#include "tools/products/virtual_room/haptic_loop.hpp"

namespace room {

enum class DeviceKind : unsigned char { mouse, script, file, udp };

struct PictureOptions {
  int width = 1280, height = 800;
  double scale = 0.0;  ///< display scale of fonts and panels, 1 = 96 dots an inch; 0 = the display's
  bool panels = true;  ///< whether pictures without a window show the panels
  std::string title;   ///< line in pictures without a window; empty: that of the scene

  /// Camera: azimuth and elevation (degrees), distance (m) and x, y, z of its target (m); empty = default.
  std::vector<double> eye;
};

struct RunOptions {
  bool headless = false;
  bool virtual_clock = false;
  DeviceKind device = DeviceKind::mouse;
  std::string script;    ///< TOML script to run; empty = none
  std::string motion;    ///< CSV file with the hand's motion, for the device `file`
  int udp_port = 47800;  ///< port on loopback of the device `udp`
  std::string frames;    ///< folder for PNG pictures; empty = none are written
  double frames_per_second = 30.0;
  double seconds = 0.0;  ///< simulated time, s; 0 = until the script ends or the window closes
  std::string csv;       ///< CSV file to record forces in; empty = none
  bool tour = false;     ///< whether the window begins with the tour
  PictureOptions picture;
  /// Time, ms, for which the graphic loop is stopped once a second, to test that the haptic loop does not
  /// wait for it.
  double stall_graphics_ms = 0.0;
  LoopOptions loop;
};

}  // namespace room
