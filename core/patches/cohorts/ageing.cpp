// The clock of an infinite brush whose bristles age. Each cohort stores the time of its birth, when its
// bristles were last straight, as seconds after a base that follows the clock.
#include <algorithm>

#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {
namespace {

/// Longest time between base and present, in ageing times. After it the base is moved, so that the ages of
/// the newest cohorts keep 32 bits.
constexpr double farthest_time = 0x1p20;

Int128 patch_time(const PatchRecord& r) noexcept { return r.clock == nullptr ? 0 : *r.clock - r.epoch; }

}  // namespace

CohortTimes times_of(const Patch& p) noexcept {
  const Cohorts& r = cohorts(p);
  if (r.ageing == nullptr) return {};
  const Material& m = r.material->material;
  // Subtracts times as integers of the clock, so that no digit is lost however long the patch has existed.
  const double now = static_cast<double>(patch_time(r) - r.ageing->base) / clock_units_per_second;
  return {r.births(),
          now,
          0.0,
          m.ageing_strength,
          1.0 / m.ageing_time,
          m.ageing_form == AgeingForm::saturating ? 1u : 0u};
}

void begin_time(const Patch& p) noexcept {
  const Cohorts& r = cohorts(p);
  if (r.ageing == nullptr) return;
  *r.ageing = CohortAgeing{};
  r.ageing->base = patch_time(r);
  std::fill_n(r.births(), r.capacity, 0.0);
}

void follow_time(const Patch& p) noexcept {
  const Cohorts& r = cohorts(p);
  const double shift = times_of(p).now;
  if (!(shift > farthest_time * r.material->material.ageing_time)) return;
  r.ageing->base = patch_time(r);
  r.ageing->until -= shift;
  r.ageing->oldest -= shift;
  for (std::uint32_t i = 0; i < r.count; ++i) r.births()[i] -= shift;
}

double find_oldest(const Cohorts& r) noexcept {
  double oldest = r.births()[0];
  for (std::uint32_t i = 1; i < r.count; ++i) oldest = std::min(oldest, r.births()[i]);
  return oldest;
}

double strength_of(const Patch& p, const CohortTimes& times, std::uint32_t i) noexcept {
  if (times.births == nullptr) return 1.0;
  return p.material().material.ageing_factor(times.now - times.births[i]);
}

}  // namespace bristle::detail
