// The scalar reference of beds: one bristle at a time.
#include "bed_step.hpp"
#include "joint_step.hpp"

namespace bristle::detail {

extern const BedKernels bed_kernels_scalar;
const BedKernels bed_kernels_scalar = BRISTLE_BED_KERNELS(BRISTLE_JOINT_STEPS);

}  // namespace bristle::detail
