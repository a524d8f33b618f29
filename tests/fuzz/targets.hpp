// The fuzz targets. Each accepts any bytes, and stops the program if a check fails.
#pragma once

#include <cstdint>

#include "bristle/span.hpp"

namespace fuzz {

using Bytes = bristle::Span<const std::uint8_t>;

void scene(Bytes bytes);    ///< reads a scene file and, if it is small, steps it
void motion(Bytes bytes);   ///< reads a motion file
void fit(Bytes bytes);      ///< reads a file of measured friction and prepares it as for a fit
void sweep(Bytes bytes);    ///< reads a range of values of a parameter study
void state(Bytes bytes);    ///< restores a saved state, whose checksum it corrects in every second run
void batch(Bytes bytes);    ///< makes a sequence of calls of PatchBatch, compared with a model of it
void kernels(Bytes bytes);  ///< steps one patch by any motion, on every instruction set; all must agree

// Targets like kernels(), for the models beyond the paper, which also check that energies balance:
void cohorts(Bytes bytes);      ///< steps the infinite brush with residual and shared renewal
void rubbing(Bytes bytes);      ///< steps representatives with residual and shared renewal
void ageing(Bytes bytes);       ///< steps either population with ageing, over any times
void extended(Bytes bytes);     ///< steps patches with an extent, which slide and spin
void populations(Bytes bytes);  ///< compares many representatives with the infinite brush, in small steps
void record(Bytes bytes);       ///< reads a recording of the virtual room: its settings and timed events

}  // namespace fuzz
