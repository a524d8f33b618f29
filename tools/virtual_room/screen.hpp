// The screen: the window, and pictures without a window. In builds without OpenGL neither is there
// (BRISTLE_ROOM_SCREEN = 0).
#pragma once

#include "tools/virtual_room/headless.hpp"
#include "tools/virtual_room/run_options.hpp"

namespace room {

/// Shows the room until the person closes the window (or options.seconds are over). Starts and stops the
/// loop. Returns the exit code. Throws cli::UserError where there is no display or no OpenGL, naming
/// --headless.
int show_window(const RunOptions& options, HapticLoop& loop);

/// Draws pictures into the folder options.frames, as PNG files, without a window. To be used on the calling
/// thread. Throws cli::UserError.
DrawFrame draw_into(const RunOptions& options);

}  // namespace room
