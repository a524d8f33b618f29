// The kernel table of one instruction set ("scalar" is one of them), and with it the one list of the variants
// of a step that a build has: to leave a feature out of a build, change this list only. This file is compiled
// once for each set (CMakeLists.txt). Everything but the table has internal linkage, so that the linker
// cannot use code of one instruction set in another.
#include "corner.hpp"
#include "renew.hpp"
#include "step.hpp"
#include "tables.hpp"

#define BRISTLE_TEXT2(a) #a
#define BRISTLE_TEXT(a) BRISTLE_TEXT2(a)

namespace bristle::detail {
namespace {

/// Samples snap lengths, each from the random state of a bristle.
template <class T>
struct FreshLengths {
  static constexpr bool by_columns = width_of<float> == lane_count;
  static void fill(const KernelLaw& law, const std::uint32_t* states, std::uint32_t count, T* lengths) {
    alignas(64) T shares[selections_at_once] = {};
    for (std::uint32_t k = 0; k < selections_at_once; ++k)
      shares[k] = k < count ? share_of<T>(mix(states[k])) : T(0.5);
    for (std::uint32_t k = 0; k < count; k += width_of<T>)
      put_lanes(lengths + k, length_at<T>(law, load(shares + k)));
  }
};

template <class T, int axes, bool redraw>
constexpr void fill_steps(KernelSet<T>& set) {
  const auto at = [&set](bool mean, bool energy, bool residual) -> auto& {
    return set.step[variant_index(axes, redraw, mean, energy, residual)];
  };
  at(false, false, false) = &step_blocks<T, axes, redraw, false, false, false, false>;
  at(true, false, false) = &step_blocks<T, axes, redraw, true, false, false, false>;
  at(false, true, false) = &step_blocks<T, axes, redraw, false, true, false, false>;
  at(true, true, false) = &step_blocks<T, axes, redraw, true, true, false, false>;
  // Uses variants with energy for all patches with a residual. Most of them have shared renewal, which needs
  // the number of snaps, and only variants with energy count snaps.
  at(false, false, true) = at(false, true, true) = &step_blocks<T, axes, redraw, false, true, true, false>;
  at(true, false, true) = at(true, true, true) = &step_blocks<T, axes, redraw, true, true, true, false>;
  set.step[aged_variant_index(axes, redraw)] = &step_blocks<T, axes, redraw, true, true, true, true>;
  set.foresee[0][axes - 1][redraw] = &foresee_blocks<T, axes, redraw, false>;
  set.foresee[1][axes - 1][redraw] = &foresee_blocks<T, axes, redraw, true>;
  set.renew[0][axes - 1][redraw] = &renew_bristles<T, axes, redraw, false, FreshLengths<T>>;
  set.renew[1][axes - 1][redraw] = &renew_bristles<T, axes, redraw, true, FreshLengths<T>>;
}

template <class T>
constexpr KernelSet<T> make_kernel_set() {
  KernelSet<T> set{};
  fill_steps<T, 1, false>(set);
  fill_steps<T, 1, true>(set);
  fill_steps<T, 2, false>(set);
  fill_steps<T, 2, true>(set);
  set.drag[0] = &drag_blocks<T, false>;
  set.drag[1] = &drag_blocks<T, true>;
  set.rewrite = &rewrite_block<T>;
  set.squares = &block_squares<T>;
  return set;
}

}  // namespace

extern const LaneTable BRISTLE_TABLE(lane_kernels_);
#if BRISTLE_WITH_BEDS
extern const BedKernels BRISTLE_TABLE(bed_kernels_);
#endif
#if BRISTLE_WITH_JOINTS
extern const JointKernels BRISTLE_TABLE(joint_kernels_);
#endif
extern const KernelTable BRISTLE_TABLE(kernels_);
constinit const KernelTable BRISTLE_TABLE(kernels_) = {
    .name = BRISTLE_TEXT(BRISTLE_TABLE()),
    .lanes = &BRISTLE_TABLE(lane_kernels_),
#if BRISTLE_WITH_BEDS
    .beds = &BRISTLE_TABLE(bed_kernels_),
#else
    .beds = nullptr,
#endif
#if BRISTLE_WITH_JOINTS
    .joints = &BRISTLE_TABLE(joint_kernels_),
#else
    .joints = nullptr,
#endif
    .f32 = make_kernel_set<float>(),
#if BRISTLE_WITH_DOUBLE
    .f64 = make_kernel_set<double>(),
#else
    .f64 = {},
#endif
};

}  // namespace bristle::detail
