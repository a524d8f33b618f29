// One run of a scene under one setting: the forces it gives and the time it takes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <bristle/patch.hpp>

#include "tools/scene/scene.hpp"

namespace cli {

/// Settings that trade error for time; the same for all patches.
struct Setting {
  bool as_scene = false;       ///< all as the scene has it, nothing below
  std::uint32_t bristles = 0;  ///< representatives of each patch
  double resolution = 0.0;     ///< more than 0: the infinite brush at that resolution, in their place
  std::uint32_t parts = 1;     ///< length of a step, in steps of the reference
  bristle::Precision precision = bristle::Precision::single;
  bristle::detail::ComparisonModes compared;
  bool mean = false;  ///< the force that is used: averaged over the step, not that at its end

  bool is_infinite() const noexcept { return resolution > 0.0; }
};

/// Of a patch's or a setting's comparison modes, as scenes name them.
inline const char* rule_name(const bristle::detail::ComparisonModes& modes) {
  return modes.literal ? "literal" : "exact";
}
inline const char* sampling_name(const bristle::detail::ComparisonModes& modes) {
  return modes.random_lengths ? "random" : "stratified";
}

/// The scene with its steps of `dt_s` and every patch under the setting. `round` picks the seeds; 0 keeps
/// those of the scene.
Scene apply(const Scene& scene, const Setting& setting, double dt_s, std::uint32_t round);

/// The scene with at most `most` copies of each prescribed patch, spread evenly over them.
Scene cut_copies(const Scene& scene, std::uint32_t most);

/// Forces on the body, N, in the scene's axes, of every step and patch.
struct ForceRecord {
  std::size_t steps = 0, copies = 0;
  std::vector<std::size_t> patch_of;        ///< [copy], index into Scene::patches
  std::vector<double> end, mean;            ///< [step][copy][axis]; `mean` empty where a patch computes none
  std::vector<double> position;             ///< [step][copy][axis], m; empty in scenes without bodies
  std::vector<double> work_end, work_mean;  ///< [copy], J done on the patch by either force

  std::size_t at(std::size_t step, std::size_t copy) const noexcept { return 2 * (step * copies + copy); }
};

struct RunTime {
  double cpu_s = 0.0;   ///< of the calling thread, in steps and bodies' solves
  double wall_s = 0.0;  ///< of the same
  std::uint64_t steps = 0;
};

struct SettingRun {
  ForceRecord record;
  RunTime time;
};

/// Runs the whole scene, or its first `steps`. Without `keep` nothing is recorded.
SettingRun run_setting(const Scene& scene, int threads, const std::string& isa, bool keep,
                       std::uint64_t steps = ~std::uint64_t{0});

}  // namespace cli
