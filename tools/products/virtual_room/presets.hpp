// Presets of the room: pairs of surfaces to start from, and the scenes that compare blocks.
#pragma once

#include <array>
#include <cstring>

#include <bristle/typical_materials.hpp>

#include "tools/products/virtual_room/room_state.hpp"

namespace room {

/// Pair of surfaces by its entry in bristle::typical_materials() (`typical`), with the name that the room
/// shows.
struct Preset {
  const char* name;
  const char* typical;
  unsigned bristles;
};

/// Presets of surfaces. Coefficients are mid-range handbook values for dry wood, rubber on a smooth dry
/// floor, and ice near freezing. Presliding lengths are so large that a hand feels them: real wood slides
/// after tens of micrometres. Ageing of wood and rubber is estimated in core/guides/MATERIALS.md. The last
/// preset is a demonstration after Zhang and Phillips (2004): 900 bristles that keep their snap lengths.
inline constexpr std::array<Preset, 4> presets = {{{"Wood", "room wood", 4096},
                                                   {"Rubber", "room rubber", 4096},
                                                   {"Ice", "room ice", 4096},
                                                   {"Paper", "room paper", 900}}};

/// Returns a sentence that says where a preset's coefficients come from.
inline const char* source_of(const Preset& preset) {
  for (const bristle::TypicalMaterial& typical : bristle::typical_materials())
    if (std::strcmp(typical.name, preset.typical) == 0) return typical.about;
  return "";
}

/// Returns the settings of the scene that tells friction models apart within a minute: on a tapped slope the
/// brush stays, LuGre and Coulomb creep.
inline Settings comparison() {
  Settings s;
  s.slope = 10.0 * 3.14159265358979323846 / 180.0;
  s.tapping = 0.2;
  s.compare = Comparison::models;
  return s;
}

/// Returns the settings of a scene that compares blocks: those of the default surface, changed so that the
/// effect shows.
inline Settings settings_of(Comparison scene) {
  Settings s;
  if (scene == Comparison::models) return comparison();
  s.compare = scene;
  if (scene == Comparison::rubbing) s.presliding_length = 3e-3;
  // Makes static friction grow twice as fast as wood's, so that the growth is visible. An infinite brush has
  // no noise that would hide it.
  if (scene == Comparison::rest) s.growth_per_decade = 0.10;
  s.infinite = scene == Comparison::rest;
  if (scene == Comparison::ratchet) {
    s.rule = bristle::SnapRule::slide;
    s.nap = 2.0;
    s.bristles = 256;
    s.tapping = 1.5;
  }
  return s;
}

inline void apply(const Preset& preset, Settings& s) {
  static_cast<bristle::Coefficients&>(s) = bristle::typical_coefficients(preset.typical);
  s.nap = 1.0;
  if (s.rule != bristle::SnapRule::redraw) s.infinite = false;
  s.bristles = preset.bristles;
}

}  // namespace room
