// Runs a scene under a setting (bristles, precision, time step), and records its forces and run time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <bristle/patch.hpp>

#include "tools/libraries/scene/scene.hpp"

namespace cli {

/// Setting that trades error for time, applied to all patches of a scene alike.
struct Setting {
  bool as_scene = false;       ///< whether the scene's own options are kept and the members below ignored
  std::uint32_t bristles = 0;  ///< number of representatives in each patch

  /// Pieces of path per mean snap length of the infinite brush. If above 0, the infinite brush replaces
  /// representatives.
  double resolution = 0.0;
  std::uint32_t parts = 1;  ///< length of a time step, in steps of the reference run
  bristle::Precision precision = bristle::Precision::single;
  bool paper_loop =
      false;          ///< whether the paper's loop (rivals/paper_loop.hpp) steps the patches, not the library
  bool mean = false;  ///< whether forces are recorded as means over a step; if not, at its end

  bool is_infinite() const noexcept { return resolution > 0.0; }
};

/// Returns the scene with steps of `dt_s` and the setting applied to every patch. `round` selects the seeds;
/// 0 keeps the scene's own.
Scene apply(const Scene& scene, const Setting& setting, double dt_s, std::uint32_t round);

/// Returns the scene with at most `most` copies of each patch on a prescribed motion, taken at even distances
/// from the original ones. Fewer copies run faster.
Scene cut_copies(const Scene& scene, std::uint32_t most);

/// Recorded forces on the moving body, N, along the scene's axes, for each step and copy of a patch.
struct ForceRecord {
  std::size_t steps = 0, copies = 0;
  std::vector<std::size_t> patch_of;        ///< [copy], index of the copy's patch in Scene::patches
  std::vector<double> end, mean;            ///< forces by [step][copy][axis], N; `mean` may be empty
  std::vector<double> position;             ///< positions by [step][copy][axis], m; empty without bodies
  std::vector<double> work_end, work_mean;  ///< [copy], work of the end and of the mean force, J

  std::size_t at(std::size_t step, std::size_t copy) const noexcept { return 2 * (step * copies + copy); }
};

struct RunTime {
  double cpu_s = 0.0;   ///< CPU time of the calling thread in steps and bodies, s
  double wall_s = 0.0;  ///< wall time of the timed steps and bodies, s
  std::uint64_t steps = 0;
};

struct SettingRun {
  ForceRecord record;
  RunTime time;
};

/// Runs the whole scene, or only its first `steps` steps. Records forces only if `keep` is set. `paper_loop`:
/// as in Setting; the scene's patches then have prescribed motions.
SettingRun run_setting(const Scene& scene, int threads, const std::string& isa, bool keep,
                       std::uint64_t steps = ~std::uint64_t{0}, bool paper_loop = false);

}  // namespace cli
