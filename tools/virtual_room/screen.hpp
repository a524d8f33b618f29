// Screen output: the window, and pictures without a window. Builds without OpenGL have neither
// (BRISTLE_ROOM_SCREEN = 0).
#pragma once

#include "tools/virtual_room/headless.hpp"
#include "tools/virtual_room/run_options.hpp"

namespace room {

/// Shows the room until the person closes the window (or options.seconds are over). Starts and stops the
/// loop. Returns the exit code. Throws cli::UserError where there is no display or no OpenGL, naming
/// --headless.
int show_window(const RunOptions& options, HapticLoop& loop);

/// Returns functions that draw PNG files into the folder options.frames, without a window. For the calling
/// thread only. Throws cli::UserError.
DrawFrame draw_into(const RunOptions& options);

}  // namespace room
