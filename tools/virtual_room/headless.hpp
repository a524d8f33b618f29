// Runs the room without a window to its end, records, and prints a summary.
#pragma once

#include <functional>

#include "tools/virtual_room/haptic_loop.hpp"
#include "tools/virtual_room/run_options.hpp"

namespace room {

/// Drawing functions, called by a headless run; both empty where nothing is drawn.
struct DrawFrame {
  std::function<void(const PlotPoint& point)> see;  ///< called for each tick, in order

  /// Called for each picture; `frame` counts them from 0.
  std::function<void(const Snapshot& room, long frame)> draw_frame;
};

/// Runs the room for options.seconds by the chosen clock; `draw` sees frames_per_second snapshots per
/// simulated second. Prints a table to stdout. Throws cli::UserError.
void run_headless(const RunOptions& options, HapticLoop& loop, const DrawFrame& draw);

}  // namespace room
