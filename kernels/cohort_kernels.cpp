// The infinite brush's kernel table of one instruction set. Compiled once per set, see CMakeLists.txt;
// everything but the table has internal linkage.
#include "cohort_step.hpp"

#define BRISTLE_JOIN2(a, b) a##b
#define BRISTLE_JOIN(a, b) BRISTLE_JOIN2(a, b)

namespace bristle::detail {

extern const CohortKernels BRISTLE_JOIN(cohort_kernels_, BRISTLE_KERNEL_ISA);
const CohortKernels BRISTLE_JOIN(cohort_kernels_, BRISTLE_KERNEL_ISA) = {
    {&move_cohorts<VectorEngine, 1, false, false>, &move_cohorts<VectorEngine, 2, false, false>,
     &move_cohorts<VectorEngine, 1, true, false>, &move_cohorts<VectorEngine, 2, true, false>,
     &move_cohorts<VectorEngine, 1, true, true>, &move_cohorts<VectorEngine, 2, true, true>},
    &find_slack_at<VectorEngine>,
    {&make_room<VectorEngine, false>, &make_room<VectorEngine, true>},
    &mass_above,
    {&enter<false>, &enter<true>},
    &renew,
};

}  // namespace bristle::detail
