// Exports the page's block to JavaScript, as plain functions and arrays of numbers.
#include <emscripten.h>

#include <algorithm>
#include <string>

#include "block.hpp"
#include "fixed_scene.hpp"

namespace {

page::Block& block() {
  static page::Block it;
  return it;
}

// Indices of the numbers that state() returns.
enum StateField {
  position,
  velocity,
  hand,
  held,
  friction,
  kinetic,
  peak,
  steps,
  bristles,
  active,
  state_fields
};

}  // namespace

extern "C" {

EMSCRIPTEN_KEEPALIVE const char* version() { return bristle::library_version(); }

EMSCRIPTEN_KEEPALIVE const char* instruction_set() { return bristle::PatchBatch().isa(); }

EMSCRIPTEN_KEEPALIVE const char* fixed_scene_hash() {
  static const std::string text = page::fixed_scene_hash();
  return text.c_str();
}

/// Applies the page's settings. `contact` is 0 for bristles that snap, 1 for the infinite brush, 2 for
/// bristles that slide. Returns an empty text, or the library's error message, after which the settings are
/// unchanged.
EMSCRIPTEN_KEEPALIVE const char* configure(int contact, int bristle_count, double normal_load,
                                           double spring_stiffness, double kinetic_coefficient,
                                           double peak_coefficient, double presliding_length,
                                           double residual_share, double shared_renewal,
                                           double growth_per_decade, double damping_per_newton) {
  static std::string refusal;
  refusal.clear();
  page::BlockSettings settings;
  settings.infinite = contact == 1;
  settings.bristles = static_cast<std::uint32_t>(bristle_count);
  settings.normal_load = normal_load;
  settings.spring_stiffness = spring_stiffness;
  settings.coefficients.with_rule(contact == 2 ? bristle::SnapRule::slide : bristle::SnapRule::redraw)
      .with_kinetic(kinetic_coefficient)
      .with_peak(peak_coefficient)
      .with_presliding_length(presliding_length)
      .with_residual_share(residual_share)
      .with_shared_renewal(shared_renewal)
      .with_growth_per_decade(growth_per_decade)
      .with_damping_per_newton(damping_per_newton)
      .with_stribeck_velocity(0.02);  // m/s, speed up to which the material's damper acts
  try {
    block().set(settings);
  } catch (const bristle::Error& error) {
    refusal = error.what();
  }
  return refusal.c_str();
}

EMSCRIPTEN_KEEPALIVE void reset() { block().reset(); }
EMSCRIPTEN_KEEPALIVE void grab() { block().grab(); }
EMSCRIPTEN_KEEPALIVE void move_hand(double position_m) { block().move_hand(position_m); }
EMSCRIPTEN_KEEPALIVE void release() { block().release(); }

EMSCRIPTEN_KEEPALIVE void step(int count) {
  for (int i = 0; i < count; ++i) block().step();
}

EMSCRIPTEN_KEEPALIVE const double* state() {
  static double values[state_fields];
  const page::Block& now = block();
  const bristle::PatchInfo info = now.info();
  values[position] = now.position();
  values[velocity] = now.velocity();
  values[hand] = now.hand();
  values[held] = now.held() ? 1.0 : 0.0;
  values[friction] = now.response().end[0];
  values[kinetic] = now.kinetic_friction();
  values[peak] = now.peak_friction();
  values[steps] = static_cast<double>(now.steps());
  values[bristles] = info.bristles;
  values[active] = info.active;
  return values;
}

/// Returns the ring buffer of samples, four numbers each: time (s), position (m), friction (N), spring force
/// (N).
EMSCRIPTEN_KEEPALIVE const double* samples() { return &block().samples().front().time; }
EMSCRIPTEN_KEEPALIVE int samples_remembered() { return static_cast<int>(page::Block::remembered); }

/// Returns the bends of `count` bristles, m; bristles that the patch lacks have 0.
EMSCRIPTEN_KEEPALIVE const double* bends(int count) {
  static double values[512];
  const auto wanted = static_cast<std::size_t>(std::clamp(count, 0, 512));
  const std::size_t written = block().read_bends({values, wanted});
  std::fill(values + written, values + wanted, 0.0);
  return values;
}
}
