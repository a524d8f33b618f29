// The contact model of springs that slide at their limit instead of snapping (SnapRule::slide; core/MODEL.md,
// section 30). Each contact is in a lane of a block; kernels/lane_slide.hpp moves the springs.
#pragma once

#include <memory>

#include "core/patches/contact_model.hpp"
#include "core/patches/lanes/lane_block.hpp"

namespace bristle::detail {

constexpr std::uint32_t default_sliders = 32;
/// Largest number of strata (springs) of a contact. More would gain nothing, because the error falls with the
/// square of their number.
constexpr std::uint32_t most_sliders = 4096;

template <class T>
struct SlideBlock : LaneBlock {
  SlideLaw<T> law{};
  SlideColumns<T> columns{};
  typename LaneKernels<T>::Slide kernel = nullptr;
  T *limit = nullptr, *per_limit = nullptr, *weight = nullptr;  ///< columns of the law

  /// Lists the columns of a block for contacts like `like` (allocate_block()).
  template <class Visit>
  static void list(SlideBlock& b, const LaneRecord& like, Visit&& visit) {
    const std::size_t n = like.springs();
    const Material& m = like.material->material;
    visit(b.columns.x, n);
    if (like.options.axes == 2) visit(b.columns.y, n);
    if (m.ageing_strength != 0.0 || m.drop != 0.0) visit(b.columns.since, n);
    for (T** column : {&b.limit, &b.per_limit, &b.weight}) visit(*column, n);
  }
};

/// Makes a patch of springs that slide at their limit; it has no lane yet. Throws bristle::Error.
Patch make_sliders(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                   const KernelTable& kernels, double weight);

}  // namespace bristle::detail
