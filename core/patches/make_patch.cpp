// Chooses the contact model of a patch.
#include "bristle/patch_batch.hpp"
#include "core/common/range_check.hpp"
#include "core/patches/cohorts/cohorts.hpp"
#include "core/patches/contact_model.hpp"
#include "core/patches/representatives/representatives.hpp"
#include "core/patches/sliders/sliders.hpp"

namespace bristle::detail {

Patch make_patch(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight) {
  constexpr const char* where = "PatchOptions";
  require_within(where, "max_normal_load", options.max_normal_load, 1e-15, highest_load, "N");
  if (options.axes != 1 && options.axes != 2) refuse(where, "axes", options.axes, "1 or 2");
  if (options.bristles > max_bristles_per_patch)
    refuse(where, "bristles", options.bristles, "0 (automatic) to 67108864");
  PatchOptions chosen = options;
  chosen.population = choose_population(material->material, options);
  check_lay(material->material, chosen);
  if (material->material.snap_rule == SnapRule::slide)
    return make_sliders(std::move(material), chosen, kernels, weight);
  if (chosen.population == Population::infinite)
    return make_cohorts(std::move(material), chosen, kernels, weight);
  return make_representatives(std::move(material), chosen, kernels, weight);
}

}  // namespace bristle::detail

namespace bristle {

Population choose_population(const Material& material, const PatchOptions& options) noexcept {
  if (options.population != Population::automatic) return options.population;
  const bool wants_bristles =
      options.bristles != 0 || options.compared.literal || options.compared.random_lengths;
  return wants_bristles || !detail::allows_cohorts(material) ? Population::representatives
                                                             : Population::infinite;
}

}  // namespace bristle
