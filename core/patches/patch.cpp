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
  // Limits prefetching to the first 40 cache lines of a record. What lies behind them the processor
  // prefetches by itself.
  p.fetched_lines = static_cast<std::uint8_t>(std::min<std::size_t>(record.bytes / 64, 40));
  return p;
}

double damping_of(const Material& m, bool damps, double zeta, double load, double speed) noexcept {
  if (!(load > 0.0)) return 0.0;
  if (!damps) return m.viscous_friction;
  return zeta * m.damping_at(speed) + m.viscous_friction + load * m.strengthening_damping(speed);
}

double damping_at(const Patch& p, double speed) noexcept {
  return damping_of(p.material().material, p.damps, p.zeta, p.normal_load, speed);
}

void find_velocity(const Motion& motion, double dt_s, double (&velocity)[2]) noexcept {
  for (int axis = 0; axis < 2; ++axis)
    velocity[axis] = std::clamp(
        motion.has_velocity ? motion.velocity[axis] : motion.displacement[axis] / std::max(dt_s, 1e-300),
        -1e150, 1e150);
}

void note_contact(Patch& p) noexcept {
  const CompiledMaterial& m = p.material();
  p.rests = false;
  p.overloaded = p.overload > 1.0;
  p.damps = damps(m.material);
  p.stiffness = p.zeta * m.material.bristle_stiffness * p.record->lay.stiffest;
  p.force_limit = m.peak_coefficient * p.normal_load * p.record->lay.strongest;
  p.rest_damping = damping_at(p, 0.0);
}

}  // namespace bristle::detail
