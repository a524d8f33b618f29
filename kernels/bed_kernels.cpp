// The kernels of beds and joints for one instruction set or for the scalar reference, which takes one bristle
// or joint at a time. Everything but the table has internal linkage.
#include "bed_step.hpp"
#include "joint_step.hpp"
#include "tables.hpp"

namespace bristle::detail {
namespace {

template <int variant = 0>
constexpr void fill_variants(BedKernels& kernels) {
  static_assert(int{bed_variants} == int{joint_variants});
  kernels.step[variant] = &step_bed<BedEngine, variant>;
  // Joints have one kernel for steps with gradients: it computes every output, and derivatives by all
  // parameters.
  constexpr bool gradients = (variant & joint_gradients) != 0;
  constexpr int computed = gradients ? joint_variants - 1 : variant;
  kernels.joint[variant] = &step_joints<JointEngine, computed>;
  if constexpr (variant + 1 < bed_variants) fill_variants<variant + 1>(kernels);
}

constexpr BedKernels make_bed_kernels() {
  BedKernels kernels{};
  fill_variants(kernels);
  kernels.place = &place_bed<BedEngine>;
  kernels.place_rows = &roll_bed<BedEngine, false>;
  kernels.roll = &roll_bed<BedEngine, true>;
  kernels.rebase = &rebase_bed<BedEngine>;
  return kernels;
}

}  // namespace

extern const BedKernels BRISTLE_TABLE(bed_kernels_);
constinit const BedKernels BRISTLE_TABLE(bed_kernels_) = make_bed_kernels();

}  // namespace bristle::detail
