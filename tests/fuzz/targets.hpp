// The fuzz targets. Each takes any bytes whatever, and stops the program where something does not hold.
#pragma once

#include <cstdint>

#include "bristle/span.hpp"

namespace fuzz {

using Bytes = bristle::Span<const std::uint8_t>;

void scene(Bytes bytes);    ///< a scene file, read and, where it is small, stepped
void motion(Bytes bytes);   ///< a motion file
void fit(Bytes bytes);      ///< a file of measured friction, and what is found out before the fit
void state(Bytes bytes);    ///< a saved state, its checksums put right in every second run
void batch(Bytes bytes);    ///< a sequence of calls of PatchBatch beside a model of it
void kernels(Bytes bytes);  ///< one patch under any material and motion, on every instruction set

}  // namespace fuzz
