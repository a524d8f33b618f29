// Settings made safe, and what follows from them.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>

#include <bristle/bristle.hpp>
#include <bristle/extended_patches.hpp>

#include "tools/rivals/pair.hpp"
#include "tools/virtual_room/room_state.hpp"

namespace room {

/// A number of Settings: its range, for sliders, scripts and the check of what comes in.
struct SettingRange {
  const char* name;
  double Settings::*member;
  double min, max;
  const char* unit;
};
inline constexpr std::array<SettingRange, 18> setting_ranges = {{
    {"kinetic", &Settings::kinetic, 0.01, 2.0, ""},
    {"peak", &Settings::peak, 0.01, 3.0, ""},
    {"presliding_length", &Settings::presliding_length, 1e-6, 5e-3, "m"},
    {"damping_per_newton", &Settings::damping_per_newton, 0.0, 100.0, "s/m"},
    {"viscous_friction", &Settings::viscous_friction, 0.0, 100.0, "N s/m"},
    {"stribeck_velocity", &Settings::stribeck_velocity, 0.0, 10.0, "m/s"},
    {"residual_share", &Settings::residual_share, 0.0, 0.95, ""},
    {"shared_renewal", &Settings::shared_renewal, 0.0, 8.0, ""},
    {"growth_per_decade", &Settings::growth_per_decade, 0.0, 0.3, ""},
    {"ageing_time", &Settings::ageing_time, 1e-3, 1e3, "s"},
    {"mass", &Settings::mass, 0.02, 5.0, "kg"},
    {"extra_load", &Settings::extra_load, 0.0, 50.0, "N"},
    {"slope", &Settings::slope, -0.8, 0.8, "rad"},
    {"tapping", &Settings::tapping, 0.0, 20.0, "N"},
    {"hand_stiffness", &Settings::hand_stiffness, 0.0, 5000.0, "N/m"},
    {"hand_damping", &Settings::hand_damping, 0.0, 50.0, "N s/m"},
    {"pad_radius", &Settings::pad_radius, 0.0, 0.02, "m"},
    {"pad_friction", &Settings::pad_friction, 0.0, 2.0, ""},
}};
/// The first so many are of the surface, with the rule.
inline constexpr std::size_t surface_numbers = 10;
static_assert(setting_ranges[surface_numbers - 1].member == &Settings::ageing_time);
constexpr const SettingRange& range_of(double Settings::*member) {
  std::size_t i = 0;
  while (setting_ranges[i].member != member) ++i;
  return setting_ranges[i];
}
inline constexpr std::uint32_t fewest_bristles = 16, most_bristles = 2'000'000;

/// Patches are made before the loop runs and wait for contacts: four for the floor, as many corners as can
/// rest on it; four each for the end wall, the side walls and the roof; one for the tool.
inline constexpr std::size_t patch_count = 17, tool_patch = 16;
/// Representatives of one of them: walls and roof, touched now and then, have fewer.
std::uint32_t bristles_of(const Settings& settings, std::size_t patch) noexcept;
using PatchIds = std::array<bristle::PatchId, patch_count>;
/// The pad of a tool that is no point: a disc of so many cells (three rings: the limit of spin to 1.4 %).
inline constexpr int pad_rings = 3;
inline constexpr std::size_t pad_cells = 27;

/// Data that the haptic loop works with, plain.
struct Parameters {
  Settings settings;
  PatchIds patches;
  bristle::ExtendedPatches* pad =
      nullptr;  ///< holds the tool's patch alone; null: it is a point, in `patches`
  bristle::PatchId pad_id;
  bool new_patches = false;           ///< they hold nothing yet
  rivals::Surface surface;            ///< for LuGre and Coulomb
  rivals::Surface tool_surface;       ///< the same, of the tool
  double kinetic = 0.0, peak = 0.0;   ///< friction over load, as they follow from the bristles
  double presliding_length = 0.0;     ///< m, mean bend at which a bristle snaps
  double stiffness_per_newton = 0.0;  ///< 1/m, of sticking
  double bristle_stiffness = 0.0;     ///< N/m, of one bristle: sigma0
  char message[128] = {};
};

/// `wanted` with every number in its range. What is no number, and a combination that no material has, keeps
/// the value of `before`. `message`: what was changed, or empty.
Settings checked_settings(const Settings& wanted, const Settings& before, std::string& message);

bristle::Material material_of(const Settings& settings);
/// Of the tool: the same with a friction of its own, if it has one.
bristle::Material tool_material_of(const Settings& settings);

/// Makes and changes patches for one batch. Not on the haptic thread: takes memory and time.
class PatchMaker {
 public:
  explicit PatchMaker(bristle::PatchBatch& batch) : batch_(batch) {}
  /// Parameters of checked settings; the materials of the patches change at once. New patches where the
  /// number of bristles or the model changed, the tool's contact became a disc or a point, or `anew`; the old
  /// ones stay until remove_old(), and stay in use when it throws.
  Parameters make(const Settings& wanted, bool anew);
  /// When the haptic loop no longer uses the patches of before.
  void remove_old();

 private:
  struct Made {
    PatchIds ids{};
    std::unique_ptr<bristle::ExtendedPatches> pad;
    bristle::PatchId pad_id;
  };
  Made add_patches(const Settings& settings, const bristle::Material& material,
                   const bristle::Material& of_tool);
  void remove(Made& made);

  bristle::PatchBatch& batch_;
  Parameters now_;
  bristle::Material material_, tool_material_;
  Made made_, old_;
};

}  // namespace room
