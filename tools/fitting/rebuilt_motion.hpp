// Rebuilds the motion of a record whose file has only the force: from a stated speed, or from the file of
// another logger.
#pragma once

#include "tools/fitting/data.hpp"

namespace cli {

/// Rebuilds the positions of a file without position: one speed (m/s), one direction. Throws UserError where
/// the force has both signs.
void rebuild_slide(FitColumns& data, double speed);

/// Rebuilds strokes to and fro of one length (m) at one speed (m/s; the sign is that of the first stroke),
/// with a rest after each. Each turn is where the force begins to change its sign. Throws UserError where the
/// force does not turn, or its turns contradict the length and the speed.
void rebuild_strokes(FitColumns& data, double speed, double stroke);

/// Adds the motion of another logger, `clock` seconds later than its file says, to the rows of `data` within
/// its times; others are left out. Throws UserError where the two records have no time in common.
void merge_motion(FitColumns& data, const FitColumns& motion, double clock);

}  // namespace cli
