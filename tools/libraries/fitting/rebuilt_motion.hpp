// Rebuilds the motion of a record whose file has only the force, from a stated speed or from another logger's
// file.
#pragma once

#include "tools/libraries/fitting/data.hpp"

namespace cli {

/// Rebuilds the positions of a file that has none, as a slide in one direction at one speed (m/s). Throws
/// UserError where the force has both signs.
void rebuild_slide(FitColumns& data, double speed);

/// Rebuilds positions as strokes to and fro of one length (m) at one speed (m/s; its sign is that of the
/// first stroke), each followed by a rest. Turns are where the force begins to change its sign. Throws
/// UserError where the force does not turn, or turns at times that contradict length and speed.
void rebuild_strokes(FitColumns& data, double speed, double stroke);

/// Adds to the rows of `data` the motion from another logger, whose clock is `clock` seconds behind; drops
/// rows outside the motion's times. Throws UserError where the two records have no time in common.
void merge_motion(FitColumns& data, const FitColumns& motion, double clock);

}  // namespace cli
