// Chooses the contact model of a patch from its material and options, and names the kernel that steps it.
#include <array>
#include <string>

#include "bristle/config.hpp"
#include "bristle/error.hpp"
#include "bristle/patch_batch.hpp"
#include "core/common/check_fields.hpp"
#include "core/patches/contact_model.hpp"
#include "core/patches/lanes/brush_block.hpp"
#include "core/patches/lanes/slide_block.hpp"
#include "core/patches/representatives/representatives.hpp"

namespace bristle::detail {
namespace {

struct KindNames {
  const char* kind;
  const char* features[3];
};
constexpr KindNames kind_names[4] = {{", keep", {", residual", ", renewal", ", ageing"}},
                                     {", redraw", {", residual", ", renewal", ", ageing"}},
                                     {", slide", {", timed"}},
                                     {", infinite", {}}};

const std::array<std::string, 512>& kernel_names() {
  static const std::array<std::string, 512> names = [] {
    std::array<std::string, 512> all;
    for (unsigned i = 0; i < all.size(); ++i) {
      const KindNames& words = kind_names[i >> 4 & 3];
      all[i] = std::string(i & 1 ? "2 axes" : "1 axis") + words.kind;
      for (unsigned f = 0; f < 3; ++f)
        if ((i >> (6 + f) & 1) != 0 && words.features[f] != nullptr) all[i] += words.features[f];
      all[i] += i & 2 ? ", end + mean" : ", end";
      if (i & 4) all[i] += ", energy";
      all[i] += i & 8 ? ", double" : ", single";
    }
    return all;
  }();
  return names;
}

}  // namespace

void name_kernels() { kernel_names(); }

const char* kernel_name(const Patch& p, BristleKind kind, unsigned features, bool in_double) noexcept {
  const unsigned index = (p.axes == 2 ? 1u : 0u) | (has(p.outputs, Outputs::mean) ? 2u : 0u) |
                         (has(p.outputs, Outputs::energy) ? 4u : 0u) | (in_double ? 8u : 0u) |
                         static_cast<unsigned>(kind) << 4 | features << 6;
  return kernel_names()[index].c_str();
}

Patch make_patch(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight) {
  require_fields("PatchOptions", options);
  PatchOptions chosen = options;
  chosen.population = choose_population(material->material, options);
#if !BRISTLE_WITH_DOUBLE
  if (options.precision == Precision::double_)
    throw Error(
        "PatchOptions: precision = double_: this build of bristle has no such kernels; build it with "
        "BRISTLE_WITH_DOUBLE=ON");
#endif
  check_lay(material->material, chosen);
  if (material->material.snap_rule == SnapRule::slide)
    return make_sliders(std::move(material), chosen, kernels, weight);
  if (chosen.population == Population::infinite)
    return make_brush(std::move(material), chosen, kernels, weight);
  return make_representatives(std::move(material), chosen, kernels, weight);
}

}  // namespace bristle::detail

namespace bristle {

Population choose_population(const Material& material, const PatchOptions& options) noexcept {
  if (options.population != Population::automatic) return options.population;
  return options.bristles != 0 || !detail::allows_brush(material) ? Population::representatives
                                                                  : Population::infinite;
}

}  // namespace bristle
