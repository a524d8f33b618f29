// The fuzz targets. Each accepts any bytes, and stops the program if a check fails.
#pragma once

#include <cstdint>

#include "bristle/span.hpp"

namespace fuzz {

using Bytes = bristle::Span<const std::uint8_t>;

void scene(Bytes bytes);    ///< a scene file: read and, if small, stepped
void motion(Bytes bytes);   ///< reads a motion file
void fit(Bytes bytes);      ///< a file of measured friction, with everything found before the fit
void sweep(Bytes bytes);    ///< a range of a parameter study
void state(Bytes bytes);    ///< a saved state, with its checksum corrected in every second run
void batch(Bytes bytes);    ///< a sequence of calls of PatchBatch, compared with a model of it
void kernels(Bytes bytes);  ///< one patch under any material and motion, on every instruction set
// Work as kernels(), for the models beyond the paper, and check that work and energies balance:
void cohorts(Bytes bytes);      ///< the infinite brush, with rubbing
void rubbing(Bytes bytes);      ///< representatives with residual and shared renewal
void ageing(Bytes bytes);       ///< either population with ageing, over any times
void extended(Bytes bytes);     ///< patches with an extent, spinning
void populations(Bytes bytes);  ///< many representatives compared with the infinite brush, in small steps
void record(Bytes bytes);       ///< a recording of the virtual room: its settings and timed events

}  // namespace fuzz
