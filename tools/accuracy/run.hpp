// Runs a scene under a setting, and records its forces and time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <bristle/patch.hpp>

#include "tools/scene/scene.hpp"

namespace cli {

/// Setting of a run, applied to all patches alike, that trades error for time.
struct Setting {
  bool as_scene = false;       ///< whether the scene's own options are kept and the members below ignored
  std::uint32_t bristles = 0;  ///< number of representatives in each patch

  /// Resolution of the infinite brush, which replaces representatives if this is above 0.
  double resolution = 0.0;
  std::uint32_t parts = 1;  ///< number of reference steps that make one step of this setting
  bristle::Precision precision = bristle::Precision::single;
  bristle::detail::ComparisonModes compared;
  bool mean = false;  ///< whether the recorded force is the mean over a step; if not, the force at its end

  bool is_infinite() const noexcept { return resolution > 0.0; }
};

/// Returns the name, in scene files, of how a patch treats snaps (`rule`) or chooses snap lengths
/// (`sampling`).
inline const char* rule_name(const bristle::detail::ComparisonModes& modes) {
  return modes.literal ? "literal" : "exact";
}
inline const char* sampling_name(const bristle::detail::ComparisonModes& modes) {
  return modes.random_lengths ? "random" : "stratified";
}

/// Returns the scene with steps of `dt_s` and the setting applied to every patch. `round` selects the seeds;
/// 0 keeps the scene's own.
Scene apply(const Scene& scene, const Setting& setting, double dt_s, std::uint32_t round);

/// Returns the scene with at most `most` copies of each patch on a prescribed motion, spread evenly over all
/// its copies.
Scene cut_copies(const Scene& scene, std::uint32_t most);

/// Forces on the moving body, N, in the scene's axes, for each step and copy of a patch.
struct ForceRecord {
  std::size_t steps = 0, copies = 0;
  std::vector<std::size_t> patch_of;        ///< by copy: index of its patch in Scene::patches
  std::vector<double> end, mean;            ///< N, [step][copy][axis]; `mean` may be empty
  std::vector<double> position;             ///< m, [step][copy][axis]; empty in scenes without bodies
  std::vector<double> work_end, work_mean;  ///< J, [copy], work of the end and the mean force

  std::size_t at(std::size_t step, std::size_t copy) const noexcept { return 2 * (step * copies + copy); }
};

struct RunTime {
  double cpu_s = 0.0;   ///< CPU seconds of the calling thread, for steps and bodies
  double wall_s = 0.0;  ///< wall seconds of those steps and bodies
  std::uint64_t steps = 0;
};

struct SettingRun {
  ForceRecord record;
  RunTime time;
};

/// Runs the whole scene, or only its first `steps`. Records forces only if `keep` is set.
SettingRun run_setting(const Scene& scene, int threads, const std::string& isa, bool keep,
                       std::uint64_t steps = ~std::uint64_t{0});

}  // namespace cli
