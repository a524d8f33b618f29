// Makes discs that slide and spin, of infinite brushes and of LuGre elements, to compare their times
// (`bristle capacity --targets`).
#pragma once

#include "tools/libraries/capacity/capacity.hpp"

namespace cli {

/// Makes a disc of infinite brushes in 6 rings; its force and torque are within 1 % of a continuous disc's.
/// In a step its rim moves `path` mean snap lengths and its centre half as far; with `there_and_back` the
/// direction alternates from step to step. Throws bristle::Error if the machine lacks the instruction set.
Contestant brush_disc(double path, bool there_and_back, const std::string& isa);
/// Makes a disc of 21 x 21 elements of the LuGre friction model (tools/libraries/rivals/lugre_grid.hpp), with
/// equal friction and the motion of brush_disc().
Contestant lugre_disc(double path, bool there_and_back);

}  // namespace cli
