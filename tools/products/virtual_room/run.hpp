// Options of the program bristle-room, and its two ways to run: in a window, and without one. A build without
// OpenGL has neither window nor pictures (BRISTLE_ROOM_SCREEN = 0).
#pragma once

#include <functional>
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

/// Shows the room in a window until the user closes it or options.seconds are over. Starts and stops the
/// haptic loop. Returns the exit code. Throws a cli::UserError that names --headless where there is no
/// display or no OpenGL.
int show_window(const RunOptions& options, HapticLoop& loop);

/// Functions that draw pictures of a run without a window; both empty if none are drawn.
struct DrawFrame {
  std::function<void(const PlotPoint& point)> see;  ///< takes the point of each tick, in order

  /// Draws a picture of the room; `frame` is its number, from 0.
  std::function<void(const Snapshot& room, long frame)> draw_frame;
};

/// Returns functions that draw the pictures of a run without a window into PNG files in the folder
/// options.frames. Only the calling thread may use them. Throws cli::UserError.
DrawFrame draw_into(const RunOptions& options);

/// Runs the room for options.seconds by the chosen clock. `draw` gets frames_per_second states of the room
/// per simulated second. Prints a table to stdout. Throws cli::UserError.
void run_headless(const RunOptions& options, HapticLoop& loop, const DrawFrame& draw);

}  // namespace room
