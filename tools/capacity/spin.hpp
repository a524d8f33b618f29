// Makes contestants of a disc that slides and spins, with the brush and with a rival, for `--targets`.
#pragma once

#include "tools/capacity/capacity.hpp"

namespace cli {

/// Makes a disc of the infinite brush, cut into 6 rings, within 1 % of the limit surface. Its rim moves `way`
/// mean snap lengths per step, its centre half as far; to and fro with `there_and_back`. Throws
/// bristle::Error on an instruction set that is not there.
Contestant brush_disc(double way, bool there_and_back, const std::string& isa);
/// Makes a disc of 21 x 21 LuGre elements (tools/rivals/lugre_grid.hpp) in the same motion, with equal
/// friction.
Contestant lugre_disc(double way, bool there_and_back);

}  // namespace cli
