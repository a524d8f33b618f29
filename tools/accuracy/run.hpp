// Runs a scene under a setting, and records its forces and time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <bristle/patch.hpp>

#include "tools/scene/scene.hpp"

namespace cli {

/// Setting that trades error for time; the same for all patches.
struct Setting {
  bool as_scene = false;       ///< uses the scene's options; the members below are ignored
  std::uint32_t bristles = 0;  ///< number of each patch's representatives
  /// If above 0, the infinite brush with that resolution instead of representatives.
  double resolution = 0.0;
  std::uint32_t parts = 1;  ///< length of a step, in steps of the reference
  bristle::Precision precision = bristle::Precision::single;
  bristle::detail::ComparisonModes compared;
  bool mean = false;  ///< whether the force is averaged over the step, instead of taken at its end

  bool is_infinite() const noexcept { return resolution > 0.0; }
};

/// Returns the name that scenes use for a patch's or a setting's comparison modes.
inline const char* rule_name(const bristle::detail::ComparisonModes& modes) {
  return modes.literal ? "literal" : "exact";
}
inline const char* sampling_name(const bristle::detail::ComparisonModes& modes) {
  return modes.random_lengths ? "random" : "stratified";
}

/// Returns the scene with steps of `dt_s` and every patch under the setting. `round` selects the seeds; 0
/// keeps the scene's.
Scene apply(const Scene& scene, const Setting& setting, double dt_s, std::uint32_t round);

/// Returns the scene with at most `most` copies of each prescribed patch, spread evenly over all.
Scene cut_copies(const Scene& scene, std::uint32_t most);

/// Record of the forces on the body, N, in the scene's axes, for every step and patch.
struct ForceRecord {
  std::size_t steps = 0, copies = 0;
  std::vector<std::size_t> patch_of;        ///< [copy], index into Scene::patches
  std::vector<double> end, mean;            ///< [step][copy][axis]; `mean` is empty if a patch computes none
  std::vector<double> position;             ///< [step][copy][axis], m; empty in scenes without bodies
  std::vector<double> work_end, work_mean;  ///< [copy], J, work done on the patch by end and by mean force

  std::size_t at(std::size_t step, std::size_t copy) const noexcept { return 2 * (step * copies + copy); }
};

struct RunTime {
  double cpu_s = 0.0;   ///< CPU time of the calling thread, in steps and in solving bodies
  double wall_s = 0.0;  ///< wall time of the same work
  std::uint64_t steps = 0;
};

struct SettingRun {
  ForceRecord record;
  RunTime time;
};

/// Runs the whole scene, or its first `steps`. Records forces only with `keep`.
SettingRun run_setting(const Scene& scene, int threads, const std::string& isa, bool keep,
                       std::uint64_t steps = ~std::uint64_t{0});

}  // namespace cli
