// Materials and patches with what came after the paper: rubbing, ageing, strengthening with speed, the
// infinite brush.
#pragma once

#include "steps.hpp"

namespace fuzz {

enum class Brush { rubbed, aged };

/// Residual and shared renewal, mostly of a few values: a material takes milliseconds to set up, and a batch
/// knows the last 64.
inline void rub(Input& input, bristle::Material& m) {
  constexpr double residuals[] = {0.0, 0.1111111111111111, 0.5, 20.0};
  constexpr double renewals[] = {0.0, 1.0, 0.3, 8.0};
  const unsigned kind = input.choice(32);
  m.residual_length = residuals[kind % 4] * m.snap_length.mean();
  m.shared_renewal = renewals[kind / 4 % 4];
  if (kind == 31) m.residual_length = input.number(m.snap_length.mean());
  if (kind == 30) m.shared_renewal = input.number(1.0);
}

inline void let_age(Input& input, bristle::Material& m) {
  constexpr double strengths[] = {0.05, 0.005, 0.5, 1.0};
  constexpr double times[] = {1.0, 1e-3, 1e3, 1e-9};
  const unsigned kind = input.choice(64);
  m.ageing_form = kind % 2 == 0 ? bristle::AgeingForm::logarithmic : bristle::AgeingForm::saturating;
  m.ageing_strength = strengths[kind / 2 % 4];
  m.ageing_time = times[kind / 8 % 4];
  if (kind == 63) m.ageing_strength = input.number(0.1);
  if (kind == 62) m.ageing_time = input.number(1.0);
}

/// Throws bristle::Error where it is refused.
inline bristle::Material any_brush(Input& input, Brush brush) {
  using bristle::SnapLength;
  bristle::Material m;
  const unsigned kind = input.choice(64);
  const SnapLength known[] = {SnapLength::lognormal(1e-5, 0.15), SnapLength::uniform(5e-6, 15e-6),
                              SnapLength::single(1e-5), SnapLength::exponential(1e-5)};
  m.snap_length = kind == 63 ? any_law(input) : known[kind % 4];
  m.snap_rule = kind % 8 < 5 ? bristle::SnapRule::redraw : bristle::SnapRule::keep;
  if (brush == Brush::rubbed || kind >= 32) rub(input, m);
  if (brush == Brush::aged) let_age(input, m);
  const unsigned more = input.choice(8);
  if (more == 6) m.bristle_damping = std::fabs(input.number(0.01));
  if (more == 7) m.with_speed_strengthening(std::fabs(input.number(0.01)), 1e-6);
  return m;
}

/// Like any_options; `infinite`: mostly the infinite brush.
inline bristle::PatchOptions any_brush_options(Input& input, unsigned most_bristles, bool infinite) {
  bristle::PatchOptions o = any_options(input, most_bristles);
  o.step_rule = bristle::StepRule::exact;
  if (input.choice(16) == (infinite ? 15u : 0u)) infinite = !infinite;
  if (!infinite) return o;
  o.population = bristle::Population::infinite;
  o.bristles = 0;
  const unsigned kind = input.choice(16);
  if (kind % 4 == 1) o.resolution = 2.0;
  if (kind == 14) o.resolution = input.number(4.0);
  if (kind == 15) o.cohorts = input.byte();
  if (kind >= 12) o.fluctuation = 1 + static_cast<std::uint32_t>(input.bits(2));
  return o;
}

/// Times from a millionth to a million seconds, and what is none.
inline double any_span(Input& input) {
  constexpr double spans[] = {1e-3, 1e-6, 1.0, 1e-4, 1e3, 1e6, 1e-12, 1e15};
  const unsigned kind = input.choice(16);
  return kind == 15 ? input.number(1.0) : spans[kind % 8];
}

}  // namespace fuzz
