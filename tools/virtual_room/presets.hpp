// Presets: pairs of surfaces to start from.
#pragma once

#include <array>

#include "tools/virtual_room/room_state.hpp"

namespace room {

struct Preset {
  const char* name;
  const char* says;  ///< sentence on the source of the preset's figures
  double kinetic, peak_over_kinetic, presliding_length, damping_per_newton, viscous_friction,
      stribeck_velocity;
  double growth_per_decade, ageing_time;
  bool keep;
  unsigned bristles;
};

/// Presets. Coefficients are mid-range handbook values for dry wood, rubber on a smooth dry floor, and ice
/// near freezing. Presliding lengths are as large as a hand can feel: real wood slides after tens of
/// micrometres. The ageing of wood and rubber is the estimate of core/guides/MATERIALS.md. The last preset is
/// a demonstration in the spirit of Zhang and Phillips: 900 bristles that keep their snap lengths.
inline constexpr std::array<Preset, 4> presets = {{
    {"Wood", "wood on wood, dry: 0.40; presliding enlarged to 1 mm; at rest it grows by 5 % per decade", 0.40,
     1.15, 1e-3, 0.0, 0.0, 1e-3, 0.05, 0.1, false, 4096},
    {"Rubber",
     "rubber on a smooth floor: 0.90; long, damped presliding of 4 mm; at rest it grows by 6 % per decade",
     0.90, 1.30, 4e-3, 1.5, 0.0, 5e-2, 0.06, 0.1, false, 4096},
    {"Ice", "ice near freezing: 0.03, with a film of water", 0.03, 1.40, 0.3e-3, 0.0, 0.20, 1e-2, 0.0, 0.1,
     false, 4096},
    {"Paper", "900 bristles that keep their snap lengths, the number of Zhang and Phillips (2004)", 0.40,
     1.50, 2e-3, 0.5, 0.0, 1e-2, 0.0, 0.1, true, 900},
}};

/// Returns the settings of the scene that tells the models apart in a minute: on a tapped slope the brush
/// stays, the others creep.
inline Settings comparison() {
  Settings s;
  s.slope = 10.0 * 3.14159265358979323846 / 180.0;
  s.tapping = 0.2;
  s.compare = Comparison::models;
  return s;
}

/// Returns the settings of a comparing scene: the default surface, changed to bring out its effect.
inline Settings settings_of(Comparison scene) {
  Settings s;
  if (scene == Comparison::models) return comparison();
  s.compare = scene;
  if (scene == Comparison::rubbing) s.presliding_length = 3e-3;
  // Ages twice as fast as wood, to be visible, and uses cohorts, which have no sampling noise.
  if (scene == Comparison::rest) s.growth_per_decade = 0.10;
  s.infinite = scene == Comparison::rest;
  return s;
}

inline void apply(const Preset& p, Settings& s) {
  s.kinetic = p.kinetic;
  s.peak = p.kinetic * p.peak_over_kinetic;
  s.presliding_length = p.presliding_length;
  s.damping_per_newton = p.damping_per_newton;
  s.viscous_friction = p.viscous_friction;
  s.stribeck_velocity = p.stribeck_velocity;
  // Sets no residual and no shared renewal for the keep rule: the paper's law has neither.
  s.residual_share = p.keep ? 0.0 : bristle::Coefficients{}.residual_share;
  s.shared_renewal = p.keep ? 0.0 : bristle::Coefficients{}.shared_renewal;
  s.growth_per_decade = p.growth_per_decade;
  s.ageing_time = p.ageing_time;
  s.keep = p.keep;
  if (p.keep) s.infinite = false;
  s.bristles = p.bristles;
}

}  // namespace room
