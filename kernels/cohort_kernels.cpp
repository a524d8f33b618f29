// The infinite brush's kernel table of one instruction set. Compiled once per set, see CMakeLists.txt;
// everything but the table has internal linkage.
#include "cohort_step.hpp"

#define BRISTLE_JOIN2(a, b) a##b
#define BRISTLE_JOIN(a, b) BRISTLE_JOIN2(a, b)
#define BRISTLE_TEXT2(a) #a
#define BRISTLE_TEXT(a) BRISTLE_TEXT2(a)

namespace bristle::detail {

extern const CohortKernels BRISTLE_JOIN(cohort_kernels_, BRISTLE_KERNEL_ISA);
const CohortKernels BRISTLE_JOIN(cohort_kernels_, BRISTLE_KERNEL_ISA) = {
    BRISTLE_TEXT(BRISTLE_KERNEL_ISA),
    {&move_cohorts<VectorEngine, 1, false>, &move_cohorts<VectorEngine, 2, false>,
     &move_cohorts<VectorEngine, 1, true>, &move_cohorts<VectorEngine, 2, true>},
    &make_room<VectorEngine>,
    &mass_above,
    &enter,
    &renew,
};

}  // namespace bristle::detail
