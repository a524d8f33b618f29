// The kernels of joints for one instruction set. Everything but the table has internal linkage, so that the
// linker cannot use code of one instruction set in another.
#include "joint_step.hpp"
#include "tables.hpp"

namespace bristle::detail {
namespace {

template <int variant = 0>
constexpr void fill_variants(JointKernels& kernels) {
  // Serves all steps with gradients by one kernel, which computes every output and the derivatives by all
  // parameters.
  constexpr bool gradients = (variant & joint_gradients) != 0;
  constexpr int computed = gradients ? joint_variants - 1 : variant;
  kernels.step[variant] = &step_joints<JointEngine, computed>;
  if constexpr (variant + 1 < joint_variants) fill_variants<variant + 1>(kernels);
}

constexpr JointKernels make_joint_kernels() {
  JointKernels kernels{};
  fill_variants(kernels);
  return kernels;
}

}  // namespace

extern const JointKernels BRISTLE_TABLE(joint_kernels_);
constinit const JointKernels BRISTLE_TABLE(joint_kernels_) = make_joint_kernels();

}  // namespace bristle::detail
