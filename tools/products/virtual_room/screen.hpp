// Screen output of the room: the window, and pictures without a window. A build without OpenGL has neither
// (BRISTLE_ROOM_SCREEN = 0).
#pragma once

#include "tools/products/virtual_room/headless.hpp"
#include "tools/products/virtual_room/run_options.hpp"

namespace room {

/// Shows the room in a window until the user closes it or options.seconds are over. Starts and stops the
/// haptic loop. Returns the exit code. Throws a cli::UserError that names --headless where there is no
/// display or no OpenGL.
int show_window(const RunOptions& options, HapticLoop& loop);

/// Returns functions that draw the pictures of a run without a window into PNG files in the folder
/// options.frames. Only the calling thread may use them. Throws cli::UserError.
DrawFrame draw_into(const RunOptions& options);

}  // namespace room
