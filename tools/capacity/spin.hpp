// Makes discs that slide and spin, of the infinite brush and of LuGre elements, for the comparison of
// `--targets`.
#pragma once

#include "tools/capacity/capacity.hpp"

namespace cli {

/// Makes a disc of infinite brushes in 6 rings, whose force and torque are within 1 % of the continuous
/// disc's. Its rim moves `way` mean snap lengths per step, its centre half as far; `there_and_back` reverses
/// the motion. Throws bristle::Error if the machine lacks the instruction set.
Contestant brush_disc(double way, bool there_and_back, const std::string& isa);
/// Makes a disc of 21 x 21 elements of the LuGre friction model (tools/rivals/lugre_grid.hpp) with equal
/// motion and friction.
Contestant lugre_disc(double way, bool there_and_back);

}  // namespace cli
