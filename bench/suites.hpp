// Functions that register one suite of benchmarks each. Each is in the file of its name; main calls each
// once.
#pragma once

namespace bristle_bench {

void register_kernels();
void register_beds();
void register_cohorts();
void register_joints();
void register_keys();
void register_long_motion();
void register_presliding();
void register_threads();

}  // namespace bristle_bench
