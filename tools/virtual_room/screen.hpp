// What is seen: the window, and pictures without a window. In builds without OpenGL neither is there
// (BRISTLE_ROOM_SCREEN = 0).
#pragma once

#include "tools/virtual_room/headless.hpp"
#include "tools/virtual_room/run_options.hpp"

namespace room {

/// Shows the room until the person closes the window (or options.seconds are over). Starts and stops the
/// loop. Returns the exit code. Throws cli::UserError where there is no display or no OpenGL, naming
/// --headless.
int show_window(const RunOptions& options, HapticLoop& loop);

/// Draws options.frames_per_second pictures a second of the simulation into the folder options.frames, as PNG
/// files, without a window. Takes the points of the plots from the loop's exchange. Throws cli::UserError.
DrawFrame draw_into(const RunOptions& options, HapticLoop& loop);

}  // namespace room
