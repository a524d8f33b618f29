// Materials and patches with the features beyond the paper: rubbing, ageing, strengthening with speed, the
// infinite brush.
#pragma once

#include <cstdio>
#include <cstdlib>

#include "steps.hpp"

namespace fuzz {

/// Whether BRISTLE_FUZZ_TRACE is set, so that a run prints its materials and options.
inline bool traces() {
  static const bool on = std::getenv("BRISTLE_FUZZ_TRACE") != nullptr;
  return on;
}
inline void trace(const bristle::Material& m, const bristle::PatchOptions& o) {
  if (!traces()) return;
  std::fprintf(
      stderr,
      "law %d (%g, %g) rule %d residual %g renewal %g ageing %d %g %g s strengthening %g damping %g\n",
      static_cast<int>(m.snap_length.law()), m.snap_length.first_parameter(),
      m.snap_length.second_parameter(), static_cast<int>(m.snap_rule), m.residual_length, m.shared_renewal,
      static_cast<int>(m.ageing_form), m.ageing_strength, m.ageing_time, m.speed_strengthening,
      m.bristle_damping);
  std::fprintf(stderr,
               "population %d bristles %u axes %d outputs %d precision %d max load %g resolution %g\n",
               static_cast<int>(o.population), o.bristles, o.axes, static_cast<int>(o.outputs),
               static_cast<int>(o.precision), o.max_normal_load, o.resolution);
}
inline void trace(double dt, const bristle::Motion& m, const bristle::Response& r, double stored) {
  if (!traces()) return;
  std::fprintf(
      stderr,
      "dt %g moved %.17g %.17g load %.17g: status %u elastic %.17g %.17g mean %g %g dissipated %g loss %g "
      "damper %g snaps %llu stored %g limit %.17g\n",
      dt, m.displacement[0], m.displacement[1], m.normal_load, static_cast<unsigned>(r.status), r.elastic[0],
      r.elastic[1], r.mean[0], r.mean[1], r.dissipated, r.contact_loss, r.damper_work,
      static_cast<unsigned long long>(r.snaps), stored, r.force_limit);
}

enum class Brush { rubbed, aged };

/// Gives a material one of five kinds of rubbing (residual, renewal) or ageing, or rarely numbers at random.
/// This saves set-up: a material takes milliseconds, and a batch remembers the last 64.
inline void rub(Input& input, bristle::Material& m, unsigned choice) {
  constexpr double residuals[] = {1.0 / 9.0, 0.0, 0.5, 0.0, 1.0 / 9.0};
  constexpr double renewals[] = {1.0, 0.3, 0.0, 0.0, 8.0};
  m.residual_length = residuals[choice % 5] * m.snap_length.mean();
  m.shared_renewal = renewals[choice % 5];
  const unsigned kind = input.choice(64);
  if (kind == 63) m.residual_length = input.number(m.snap_length.mean());
  if (kind == 62) m.shared_renewal = input.number(1.0);
}

inline void let_age(Input& input, bristle::Material& m, unsigned choice) {
  constexpr double strengths[] = {0.05, 0.5, 0.005, 1.0, 0.3};
  constexpr double times[] = {1e-3, 1.0, 1e-9, 1e3, 1e-3};
  m.ageing_form = choice % 2 == 0 ? bristle::AgeingForm::logarithmic : bristle::AgeingForm::saturating;
  m.ageing_strength = strengths[choice % 5];
  m.ageing_time = times[choice % 5];
  const unsigned kind = input.choice(64);
  if (kind == 63) m.ageing_strength = input.number(0.1);
  if (kind == 62) m.ageing_time = input.number(1.0);
}

/// Returns a material of the kind `brush`. Throws bristle::Error if its numbers are refused.
inline bristle::Material any_brush(Input& input, Brush brush) {
  using bristle::SnapLength;
  bristle::Material m;
  const unsigned kind = input.choice(20);
  const SnapLength known[] = {SnapLength::lognormal(1e-5, 0.15), SnapLength::uniform(5e-6, 15e-6),
                              SnapLength::single(1e-5), SnapLength::exponential(1e-5)};
  m.snap_length = input.choice(64) == 63 ? any_law(input) : known[kind % 4];
  m.snap_rule = kind % 5 < 3 ? bristle::SnapRule::redraw : bristle::SnapRule::keep;
  if (brush == Brush::rubbed || kind % 3 == 0) rub(input, m, kind / 4);
  if (brush == Brush::aged) let_age(input, m, kind / 4);
  const unsigned more = input.choice(64);
  if (more == 62) m.bristle_damping = std::fabs(input.number(0.01));
  if (more == 63) m.with_speed_strengthening(std::fabs(input.number(0.01)), 1e-6);
  return m;
}

/// Returns patch options as any_options() does, but with `infinite` mostly those of the infinite brush.
inline bristle::PatchOptions any_brush_options(Input& input, unsigned most_bristles, bool infinite) {
  bristle::PatchOptions o = any_options(input, most_bristles);
  if (input.choice(16) == (infinite ? 15u : 0u)) infinite = !infinite;
  if (!infinite) return o;
  o.population = bristle::Population::infinite;
  o.bristles = 0;
  const unsigned kind = input.choice(16);
  if (kind % 4 == 1) o.resolution = 2.0;
  if (kind >= 14) o.resolution = input.number(4.0);
  return o;
}

/// Returns a random duration of a step, s: from a picosecond to thirty years, rarely any other number, even
/// an invalid one.
inline double any_span(Input& input) {
  constexpr double spans[] = {1e-3, 1e-6, 1.0, 1e-4, 1e3, 1e6, 1e-12, 1e9};
  const unsigned kind = input.choice(16);
  return kind == 15 ? input.number(1.0) : spans[kind % 8];
}

}  // namespace fuzz
