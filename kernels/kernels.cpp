// The kernel table of one instruction set. Compiled once per set, see CMakeLists.txt; everything but
// the table has internal linkage.
#include "block_squares.hpp"
#include "slide_step.hpp"
#include "step.hpp"
#include "variants.hpp"

#define BRISTLE_JOIN2(a, b) a##b
#define BRISTLE_JOIN(a, b) BRISTLE_JOIN2(a, b)
#define BRISTLE_TEXT2(a) #a
#define BRISTLE_TEXT(a) BRISTLE_TEXT2(a)

namespace bristle::detail {
namespace {

/// Samples snap lengths from draw states.
template <class T>
struct FreshLengths {
  static constexpr bool by_columns = Lanes<float>::size == lane_count;
  static void fill(const KernelLaw& law, const std::uint32_t* states, std::uint32_t count, T* lengths) {
    alignas(64) T shares[draws_together] = {};
    for (std::uint32_t k = 0; k < draws_together; ++k)
      shares[k] = k < count ? share_of<T>(mix(states[k])) : T(0.5);
    for (std::uint32_t k = 0; k < count; k += Lanes<T>::size)
      length_at<T>(law, load(shares + k)).store_aligned(lengths + k);
  }
};

template <class T>
void rewrite_block(const PatchView<T>& patch, std::uint32_t b, const std::int64_t at[2]) {
  Block& block = patch.blocks[b];
  const std::uint32_t start = b * block_size;
  const std::uint32_t padded = (patch.bristles + lane_count - 1) / lane_count * lane_count;
  const std::uint32_t end = start + block_size < padded ? start + block_size : padded;
  T* const columns[2] = {patch.zx, patch.zy};
  for (int axis = 0; axis < 2; ++axis) {
    T* const z = columns[axis];
    const Lanes<T> shift(static_cast<T>(displacement(at[axis], block.position[axis])));
    block.position[axis] = at[axis];
    block.stored[axis] = 0;
    if (z == nullptr) continue;
    alignas(64) T lanes[lane_count] = {};
    for (std::uint32_t i = start; i < end; i += lane_count) {
      alignas(64) T weights[lane_count];
      for (std::uint32_t k = 0; k < lane_count; ++k)
        weights[k] = i + k < patch.whole ? T(1) : i + k == patch.whole ? patch.fraction : T(0);
      for (std::uint32_t k = 0; k < lane_count; k += Lanes<T>::size) {
        const Lanes<T> weight = load(weights + k);
        Lanes<T> now = (block.zero ? Lanes<T>(T(0)) : load(z + i + k)) + shift;
        now = select_lanes(weight > Lanes<T>(T(0)), now, Lanes<T>(T(0)));
        now.store_aligned(z + i + k);
        (load(lanes + k) + now * weight).store_aligned(lanes + k);
      }
    }
    block.stored[axis] = to_integer(static_cast<double>(tree_sum(lanes)) * fixed_per_length);
  }
  if (block.zero && patch.draw != nullptr)
    for (std::uint32_t i = start; i < end; ++i) patch.delta[i] = patch.first[i];
  block.zero = 0;
  block.reach = -1.0f;
}

}  // namespace

#if BRISTLE_MINIMAL
constexpr const CohortKernels* cohorts = nullptr;
constexpr const BedKernels* beds = nullptr;
#else
extern const CohortKernels BRISTLE_JOIN(cohort_kernels_, BRISTLE_KERNEL_ISA);
extern const BedKernels BRISTLE_JOIN(bed_kernels_, BRISTLE_KERNEL_ISA);
constexpr const CohortKernels* cohorts = &BRISTLE_JOIN(cohort_kernels_, BRISTLE_KERNEL_ISA);
constexpr const BedKernels* beds = &BRISTLE_JOIN(bed_kernels_, BRISTLE_KERNEL_ISA);
#endif
extern const KernelTable BRISTLE_JOIN(kernels_, BRISTLE_KERNEL_ISA);
constexpr KernelTable table {
  BRISTLE_TEXT(BRISTLE_KERNEL_ISA), cohorts, beds,
      make_kernel_set<float, StepOf, ForeseeOf, FreshLengths<float>>(&rewrite_block<float>,
                                                                     &block_squares<float>),
#if BRISTLE_WITH_DOUBLE
      make_kernel_set<double, StepOf, ForeseeOf, FreshLengths<double>>(&rewrite_block<double>,
                                                                       &block_squares<double>)
#else
  {
  }
#endif
};
const KernelTable BRISTLE_JOIN(kernels_, BRISTLE_KERNEL_ISA) = table;

}  // namespace bristle::detail
