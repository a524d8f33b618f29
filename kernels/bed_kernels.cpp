// The kernels of beds for one instruction set. Everything but the table has internal linkage, so that the
// linker cannot use code of one instruction set in another.
#include "bed_step.hpp"
#include "tables.hpp"

namespace bristle::detail {
namespace {

template <int variant = 0>
constexpr void fill_variants(BedKernels& kernels) {
  kernels.step[variant] = &step_bed<BedEngine, variant>;
  if constexpr (variant + 1 < bed_variants) fill_variants<variant + 1>(kernels);
}

constexpr BedKernels make_bed_kernels() {
  BedKernels kernels{};
  fill_variants(kernels);
  kernels.set_positions = &set_bed_positions<BedEngine>;
  kernels.set_rows = &roll_bed<BedEngine, false>;
  kernels.roll = &roll_bed<BedEngine, true>;
  kernels.rebase = &rebase_bed<BedEngine>;
  return kernels;
}

}  // namespace

extern const BedKernels BRISTLE_TABLE(bed_kernels_);
constinit const BedKernels BRISTLE_TABLE(bed_kernels_) = make_bed_kernels();

}  // namespace bristle::detail
