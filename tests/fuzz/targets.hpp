// The fuzz targets. Each takes any bytes whatever, and stops the program where something does not hold.
#pragma once

#include <cstdint>

#include "bristle/span.hpp"

namespace fuzz {

using Bytes = bristle::Span<const std::uint8_t>;

void scene(Bytes bytes);    ///< a scene file, read and, where it is small, stepped
void motion(Bytes bytes);   ///< a motion file
void fit(Bytes bytes);      ///< a file of measured friction, and what is found out before the fit
void sweep(Bytes bytes);    ///< a range of a parameter study
void state(Bytes bytes);    ///< a saved state, its checksums put right in every second run
void batch(Bytes bytes);    ///< a sequence of calls of PatchBatch beside a model of it
void kernels(Bytes bytes);  ///< one patch under any material and motion, on every instruction set
// As kernels(), for the models beyond the paper; work and energies balance too.
void cohorts(Bytes bytes);      ///< the infinite brush, rubbed
void rubbing(Bytes bytes);      ///< representatives with residual and shared renewal
void ageing(Bytes bytes);       ///< either, ageing, over any times
void extended(Bytes bytes);     ///< patches with an extent, spinning
void populations(Bytes bytes);  ///< many representatives beside the infinite brush, in small steps
void record(Bytes bytes);       ///< a recording of the virtual room: its settings and what happens when

}  // namespace fuzz
