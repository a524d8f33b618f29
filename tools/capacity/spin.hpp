// A disc that slides and spins, as the brush and as the rival it is measured against: for `--targets`.
#pragma once

#include "tools/capacity/capacity.hpp"

namespace cli {

/// A disc of the infinite brush cut into 6 rings, within 1 % of the limit surface; its rim goes `way` mean
/// snap lengths a step, the centre half as far; to and fro where `there_and_back`. Throws bristle::Error on
/// an instruction set that is not there.
Contestant brush_disc(double way, bool there_and_back, const std::string& isa);
/// A disc of 21 x 21 LuGre elements in the same motion (tools/rivals/lugre_grid.hpp), of the same friction.
Contestant lugre_disc(double way, bool there_and_back);

}  // namespace cli
