// Functions that register one suite of benchmarks each, in the file of its name; main calls each once.
#pragma once

namespace bristle_bench {

void register_kernels();
void register_batches();
void register_beds();  // not built in the minimal library
void register_cohorts();
void register_extended();  // built only if tools/rivals is built
void register_scaling();
void register_joints();
void register_keys();
void register_long_motion();
void register_presliding();
void register_rivals();
void register_threads();

}  // namespace bristle_bench
