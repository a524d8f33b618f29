// Runs the virtual room to its end without a window, records it if asked, and prints a summary.
#pragma once

#include <functional>

#include "tools/products/virtual_room/haptic_loop.hpp"
#include "tools/products/virtual_room/run_options.hpp"

namespace room {

/// Functions that draw pictures of a run without a window; both empty if none are drawn.
struct DrawFrame {
  std::function<void(const PlotPoint& point)> see;  ///< takes the point of each tick, in order

  /// Draws a picture of the room; `frame` is its number, from 0.
  std::function<void(const Snapshot& room, long frame)> draw_frame;
};

/// Runs the room for options.seconds by the chosen clock. `draw` gets frames_per_second states of the room
/// per simulated second. Prints a table to stdout. Throws cli::UserError.
void run_headless(const RunOptions& options, HapticLoop& loop, const DrawFrame& draw);

}  // namespace room
