#include "core/patches/patch.hpp"

#include <algorithm>

namespace bristle::detail {

Patch make_shared_part(PatchRecord& record, const ContactModel& model) noexcept {
  Patch p;
  p.record = &record;
  p.model = &model;
  p.axes = static_cast<std::uint8_t>(record.options.axes);
  p.outputs = record.options.outputs;
  p.ages = record.material->material.ageing_strength != 0.0 || record.material->material.drop != 0.0;
  record.lay = map_of(record.options.lay);
  p.laid = !record.lay.is_isotropic();
  p.lengths_per_metre = record.material->lengths_per_metre;
  // The first 40 cache lines of a record are prefetched; behind them the processor prefetches by itself.
  p.fetched_lines = static_cast<std::uint8_t>(std::min<std::size_t>(record.bytes / 64, 40));
  return p;
}

double damping_at(const Patch& p, double speed) noexcept {
  const Material& m = p.material().material;
  return p.zeta * m.damping_at(speed) + m.viscous_friction + p.normal_load * m.strengthening_damping(speed);
}

void note_contact(Patch& p) noexcept {
  const CompiledMaterial& m = p.material();
  p.rests = false;
  p.overloaded = p.overload > 1.0;
  p.damps = m.material.bristle_damping != 0.0 || m.material.speed_strengthening != 0.0;
  p.stiffness = p.zeta * m.material.bristle_stiffness * p.record->lay.stiffest;
  p.force_limit = m.peak_coefficient * p.normal_load * p.record->lay.strongest;
  p.rest_damping = 0.0;
  if (p.normal_load > 0.0) p.rest_damping = p.damps ? damping_at(p, 0.0) : m.material.viscous_friction;
}

}  // namespace bristle::detail
