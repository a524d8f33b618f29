// Checks the room's settings, and makes the patches and materials that follow from them.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <type_traits>

#include <bristle/bristle.hpp>
#include <bristle/extended_patches.hpp>

#include "tools/libraries/rivals/pair.hpp"
#include "tools/products/virtual_room/room_state.hpp"

namespace room {

/// Number among the settings, with its name, range and unit, for sliders, scripts and checks.
struct SettingRange {
  const char* name;
  double Settings::*member;
  double min, max;
  const char* unit;
};
/// Returns the range of a number of the surface, with the name and unit that the library gives it.
constexpr SettingRange surface_range(double bristle::Coefficients::*member, double min, double max) {
  SettingRange range{"", member, min, max, ""};
  bristle::for_each_field<bristle::Coefficients>([&](const auto& field) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(field.member)>, decltype(member)>)
      if (field.member == member) range.name = field.name, range.unit = field.about.unit;
  });
  return range;
}
inline constexpr std::array<SettingRange, 19> setting_ranges = {{
    surface_range(&Settings::kinetic, 0.01, 2.0),
    surface_range(&Settings::peak, 0.01, 3.0),
    surface_range(&Settings::presliding_length, 1e-6, 5e-3),
    surface_range(&Settings::damping_per_newton, 0.0, 100.0),
    surface_range(&Settings::viscous_friction, 0.0, 100.0),
    surface_range(&Settings::stribeck_velocity, 0.0, 10.0),
    surface_range(&Settings::residual_share, 0.0, 0.95),
    surface_range(&Settings::shared_renewal, 0.0, 8.0),
    surface_range(&Settings::growth_per_decade, 0.0, 0.3),
    surface_range(&Settings::ageing_time, 1e-3, 1e3),
    {"mass", &Settings::mass, 0.02, 5.0, "kg"},
    {"extra_load", &Settings::extra_load, 0.0, 50.0, "N"},
    {"slope", &Settings::slope, -0.8, 0.8, "rad"},
    {"tapping", &Settings::tapping, 0.0, 20.0, "N"},
    {"hand_stiffness", &Settings::hand_stiffness, 0.0, 5000.0, "N/m"},
    {"hand_damping", &Settings::hand_damping, 0.0, 50.0, "N s/m"},
    {"pad_radius", &Settings::pad_radius, 0.0, 0.02, "m"},
    {"pad_friction", &Settings::pad_friction, 0.0, 2.0, ""},
    {"nap", &Settings::nap, 0.1, 10.0, ""},
}};
/// Number of entries at the beginning of setting_ranges that describe the surface. (The snap rule is not
/// among them.)
inline constexpr std::size_t surface_numbers = 10;
static_assert(setting_ranges[surface_numbers - 1].member == &Settings::ageing_time);
constexpr const SettingRange& range_of(double Settings::*member) {
  std::size_t i = 0;
  while (setting_ranges[i].member != member) ++i;
  return setting_ranges[i];
}
inline constexpr std::uint32_t fewest_bristles = 16, most_bristles = 2'000'000;

/// Number of patches, all of which are made before the loop runs: four for the floor (as many corners as can
/// rest on it), four each for end wall, two side walls and roof, and one for the tool.
inline constexpr std::size_t patch_count = 17, tool_patch = 16;
/// Returns the number of representatives of a patch. Those of walls and roof, which are rarely touched, have
/// fewer.
std::uint32_t bristles_of(const Settings& settings, std::size_t patch) noexcept;
using PatchIds = std::array<bristle::PatchId, patch_count>;
/// Number of rings of cells in the tool's pad, a disc. Three rings give the limit of spin within 1.4 %.
inline constexpr int pad_rings = 3;
inline constexpr std::size_t pad_cells = 27;

/// All that the haptic loop needs to know of the settings, as a plain struct, with the patches made for them.
struct Parameters : SurfaceFigures {
  Settings settings;
  PatchIds patches;
  /// Pad of the tool, a contact with an extent. Null: the tool touches at a point and has an ordinary patch.
  bristle::ExtendedPatches* pad = nullptr;
  bristle::PatchId pad_id;
  bool new_patches = false;      ///< whether the patches were just made, with straight bristles
  rivals::Surface surface;       ///< surface under the block, as the rival models take it
  rivals::Surface tool_surface;  ///< surface under the tool, as the rival models take it
};

/// Returns the settings `wanted` with every number clamped to its range. A NaN, or a combination that no
/// material has, is replaced by the value of `before`. Sets `message` to what was changed, or to "".
Settings checked_settings(const Settings& wanted, const Settings& before, std::string& message);

bristle::Material material_of(const Settings& settings);
/// Returns the tool's material: the surface's, or with the tool's own friction coefficient if it is set.
bristle::Material tool_material_of(const Settings& settings);

/// Maker of the patches of one room, in one batch. It allocates and takes time, so the haptic thread must not
/// call it.
class PatchMaker {
 public:
  explicit PatchMaker(bristle::PatchBatch& batch) : batch_(batch) {}
  /// Makes the parameters of checked settings. Changes materials of existing patches at once. Makes new
  /// patches if the number of bristles, the model or the nap changed, the tool's contact became a disc or a
  /// point, or `anew` is set. Old patches stay until remove_old(), and in use if this throws.
  Parameters make(const Settings& wanted, bool anew);
  /// Returns what make() changed in the settings, or "".
  const std::string& message() const noexcept { return message_; }
  /// Removes the patches that were replaced. Call it once the haptic loop uses the new ones.
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
  std::string message_;
  bristle::Material material_, tool_material_;
  Made made_, old_;
};

}  // namespace room
