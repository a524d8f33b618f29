// The contact model of infinitely many bristles (Population::infinite; core/patches/COHORTS.md): a list of
// cohorts, each of all bristles that were last straight at about one position and have been bent alike since.
// Each contact is in a lane of a block; kernels/lane_brush.hpp moves the cohorts.
#pragma once

#include <memory>

#include "core/patches/contact_model.hpp"
#include "core/patches/lanes/lane_block.hpp"

namespace bristle::detail {

/// Pieces into which a path of one mean snap length is divided, unless the options say otherwise.
constexpr double default_resolution = 8.0;
constexpr double highest_resolution = 128.0;
/// Least spread (cv) of a snap-length law for an infinite brush. With less spread too many bristles would
/// snap at once for cohorts to resolve.
constexpr double least_brush_spread = 0.05;

template <class T>
struct BrushBlock : LaneBlock {
  BrushLaw<T> law{};
  BrushSurvival<T> survival{};
  BrushColumns<T> columns{};
  std::uint32_t used = 0;  ///< BrushColumns::used
  typename LaneKernels<T>::Brush kernel = nullptr;

  /// Lists the columns of a block for contacts like `like` (allocate_block()).
  template <class Visit>
  static void list(BrushBlock& b, const LaneRecord& like, Visit&& visit) {
    b.columns.list(like.springs(), like.options.axes == 2, like.material->material.ageing_strength != 0.0,
                   visit);
  }
};

/// Returns whether bristles of this material can be computed as an infinite brush, by rule and law.
bool allows_brush(const Material& material) noexcept;

/// Makes an infinite brush out of contact; it has no lane yet. With `weight` above 0 it replaces a patch
/// whose options these are: `options.bristles` is then its number of cohorts, which stays. Throws
/// bristle::Error.
Patch make_brush(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight);

}  // namespace bristle::detail
