// The infinite brush's kernel table of one instruction set. This file is compiled once for each set
// (CMakeLists.txt). Everything but the table has internal linkage, so that the linker cannot use code of one
// instruction set in another.
#include "cohort_step.hpp"
#include "tables.hpp"

namespace bristle::detail {

extern const CohortKernels BRISTLE_TABLE(cohort_kernels_);
const CohortKernels BRISTLE_TABLE(cohort_kernels_) = {
    {&move_cohorts<1, false, false>, &move_cohorts<2, false, false>, &move_cohorts<1, true, false>,
     &move_cohorts<2, true, false>, &move_cohorts<1, true, true>, &move_cohorts<2, true, true>},
    &find_slack_at,
    {&make_room<false>, &make_room<true>},
    &mass_above,
    {&enter<false>, &enter<true>},
    &renew,
};

}  // namespace bristle::detail
