// Which contact model a patch gets.
#include <algorithm>

#include "core/common/range_check.hpp"
#include "core/patches/cohorts/cohorts.hpp"
#include "core/patches/contact_model.hpp"
#include "core/patches/representatives/representatives.hpp"
#include "core/patches/sliders/sliders.hpp"

namespace bristle::detail {

Patch make_shared_part(PatchRecord& record, const ContactModel& model) noexcept {
  Patch p;
  p.record = &record;
  p.model = &model;
  p.axes = static_cast<std::uint8_t>(record.options.axes);
  p.outputs = record.options.outputs;
  p.ages = record.material->material.ageing_strength != 0.0 || record.material->material.drop != 0.0;
  p.literal = record.options.step_rule == StepRule::literal;
  p.lengths_per_metre = record.material->lengths_per_metre;
  // More than this streams by itself.
  p.fetched_lines = static_cast<std::uint8_t>(std::min<std::size_t>(record.bytes / 64, 40));
  return p;
}

Patch make_patch(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight) {
  constexpr const char* where = "PatchOptions";
  require_within(where, "max_normal_load", options.max_normal_load, 1e-15, highest_load, "N");
  if (options.axes != 1 && options.axes != 2) refuse(where, "axes", options.axes, "1 or 2");
  if (options.bristles > max_bristles_per_patch)
    refuse(where, "bristles", options.bristles, "0 (automatic) to 67108864");
  if (material->material.snap_rule == SnapRule::slide)
    return make_sliders(std::move(material), options, kernels, weight);
  if (options.population == Population::infinite)
    return make_cohorts(std::move(material), options, kernels, weight);
  return make_representatives(std::move(material), options, kernels, weight);
}

}  // namespace bristle::detail
