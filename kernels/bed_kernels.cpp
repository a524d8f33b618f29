// The kernels of beds and joints for one instruction set. All but the table has internal linkage.
#include "bed_step.hpp"
#include "joint_step.hpp"

#define BRISTLE_JOIN2(a, b) a##b
#define BRISTLE_JOIN(a, b) BRISTLE_JOIN2(a, b)

namespace bristle::detail {

extern const BedKernels BRISTLE_JOIN(bed_kernels_, BRISTLE_KERNEL_ISA);
const BedKernels BRISTLE_JOIN(bed_kernels_, BRISTLE_KERNEL_ISA) = BRISTLE_BED_KERNELS(BRISTLE_JOINT_STEPS);

}  // namespace bristle::detail
