// The room without a window: runs to its end, records, and prints what happened.
#pragma once

#include <functional>

#include "tools/virtual_room/haptic_loop.hpp"
#include "tools/virtual_room/run_options.hpp"

namespace room {

/// Functions that draw, on the graphic side; both empty where nothing is drawn.
struct DrawFrame {
  std::function<void(const PlotPoint& point)> see;                   ///< each tick, in order
  std::function<void(const Snapshot& room, long frame)> draw_frame;  ///< `frame` counts from 0
};

/// Runs options.seconds of the room by the clock asked for; `draw` sees frames_per_second
/// snapshots a second of the simulation. Prints a table to stdout. Throws cli::UserError.
void run_headless(const RunOptions& options, HapticLoop& loop, const DrawFrame& draw);

}  // namespace room
