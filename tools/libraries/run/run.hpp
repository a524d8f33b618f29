// Steps a scene and reports forces and step times, for the command `bristle run`.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <bristle/deadline_monitor.hpp>
#include <bristle/patch.hpp>

#include "tools/libraries/run/realtime.hpp"
#include "tools/libraries/scene/body_motion.hpp"
#include "tools/libraries/scene/scene.hpp"

namespace cli {

class ForceFile;
class SceneStepper;

struct RunOptions {
  std::string scene;
  std::string trace;       ///< motion file that moves all patches; empty: as the scene says
  double clip_load = 0.0;  ///< loads from -clip_load to 0 count as 0, N
  std::string out;         ///< force file to write (CSV); empty: none
  std::string json;        ///< JSON report to write; empty: none, "-": stdout
  std::string plot;        ///< picture of the forces to draw; empty: none
  std::string html;        ///< page with report and picture to write; empty: none
  std::optional<int> threads;
  std::string isa;  ///< instruction set, such as "avx2"; empty: the library's choice
  std::optional<std::uint64_t> steps;
  std::optional<std::uint32_t> bristles;    ///< bristles of every patch; none: as the scene says
  std::optional<RealtimeOptions> realtime;  ///< pace of steps in real time; none: without pauses
  std::string restore_state;                ///< file of a saved state to start from; empty: none
  std::string save_state;                   ///< file to which the final state is saved; empty: none
  std::string drawn;                        ///< file for the forces that a picture shows; empty: none
  SceneLimits limits;
  bool quiet = false;  ///< whether the terminal shows no progress
};

/// Statistics of one force component over many steps: sum, sum of squares, lowest and highest (N).
struct ForceStatistics {
  double sum = 0.0, square_sum = 0.0;
  double min = 0.0, max = 0.0;
  std::uint64_t count = 0;

  void add(double value) noexcept {
    min = count ? (value < min ? value : min) : value;
    max = count ? (value > max ? value : max) : value;
    sum += value;
    square_sum += value * value;
    ++count;
  }
  double mean() const noexcept { return count ? sum / static_cast<double>(count) : 0.0; }
  double rms() const noexcept;
};
void to_json(nlohmann::ordered_json& json, const ForceStatistics& statistics);

/// First loading of a patch: its motion from straight bristles on, until it turns back or passes its peak.
struct FirstLoading {
  double x = 0.0, y = 0.0;                   ///< displacement since contact began, m
  double longest_step = 0.0;                 ///< displacement in the longest step of it, m
  double least_load = 0.0, most_load = 0.0;  ///< N
  bool turned = false;                       ///< whether the motion turned back
  bool over = false;                         ///< whether it turned back, or went two mean snap lengths
  double path() const noexcept;
};

/// Results of one patch of the scene, over all its copies and all steps.
struct PatchResult {
  bristle::PatchInfo info;  ///< facts of the patch's first copy at the end of the run
  std::uint64_t memory_bytes = 0;
  ForceStatistics force[2];       ///< force on the body at the end of each step, by axis, N
  ForceStatistics mean_force[2];  ///< force on the body averaged over each step, by axis, N
  ForceStatistics load;
  double sliding_force = 0.0;  ///< elastic force summed over the sliding steps, N
  double sliding_load = 0.0;   ///< normal load summed over the sliding steps, N
  std::uint64_t sliding_steps = 0;
  /// Highest elastic force over load, among steps whose load is at least a tenth of max_normal_load.
  double highest_coefficient = 0.0;
  /// First loading of that copy of the patch which moved farthest in it; empty in a run that continues
  /// another.
  FirstLoading first_loading;
  std::uint64_t overload_steps = 0, bad_steps = 0, steps_in_contact = 0;
  std::uint64_t snaps = 0;
  double dissipated = 0.0, contact_loss = 0.0, damper_work = 0.0, work = 0.0, stored = 0.0;  // energies, J
};

/// Break-away of a body, and how long it sticks. A body counts as sliding while it is faster than one mean
/// snap length (the longest of its patches') per second, and farther than ten such lengths from where it last
/// stuck.
struct Sticking {
  bool broke_away = false;
  /// Time of the first break-away (s), and force then (N): one mean snap length from where the body stuck or,
  /// if its friction has no peak, two.
  double time = 0.0, applied = 0.0;
  double stuck = 0.0;  ///< total time in which the body stuck, s
};

struct BodyResult {
  double position[2], velocity[2], highest_speed;
  SolveStatistics solve;
  Sticking sticking;
};

struct RunResult {
  std::uint64_t steps = 0;
  std::uint64_t steps_before = 0;  ///< number of steps that had led to the restored state
  double seconds = 0.0;            ///< wall time of the steps, without the bare loop, s
  bristle::DeadlineMonitor monitor;
  std::string isa;
  int threads = 1;
  std::uint64_t bristles = 0;          ///< number of representatives in all patches together
  std::uint64_t infinite_patches = 0;  ///< number of patches with an infinite brush
  std::uint64_t memory_bytes = 0;
  std::uint64_t state_hash = 0;
  std::size_t patches_written = 0;  ///< number of patches whose forces were written
  std::vector<PatchResult> patches;
  std::vector<BodyResult> bodies;
  std::optional<RealtimeResult> realtime;
  std::shared_ptr<ForceFile> drawn;  ///< unfinished file of the forces that a picture shows; null: none

  /// Reason why the final state could not be saved, such as a full disk; empty if it was saved or was not to
  /// be.
  std::string save_failure;
};

/// Makes the options of a scene's batch: threads and instruction set.
bristle::BatchOptions batch_options(const Scene& scene, const RunOptions& options);

/// Sets a scene's time step to 1 / rate_hz, and its deadline to the time step if it is longer.
void set_rate(Scene& scene, double rate_hz);

/// Function that is called after every step, outside the timed part. It may read motions and responses.
using StepObserver = std::function<void(const SceneStepper&)>;

/// Runs a scene to its end. Throws UserError, and whatever `observer` throws.
RunResult run_scene(const Scene& scene, const RunOptions& options, const StepObserver& observer = {});

/// Lists the features that a patch does not use, such as "second axis", which its kernel leaves out to be
/// faster.
std::vector<std::string> left_out(const ScenePatch& patch, const bristle::Material& material);

/// Compares the friction over load that a patch reached with its material's peak. Returns the figure and the
/// reason if they differ by more than 2 %, otherwise an empty text.
std::string missed_peak(const Scene& scene, const PatchResult& result, std::size_t patch);

/// Returns the results of a run as the part of its JSON report that does not name the machine.
nlohmann::ordered_json run_results(const Scene& scene, const RunResult& result);
std::string run_table(const Scene& scene, const RunOptions& options, const RunResult& result);
std::string run_json(const Scene& scene, const RunOptions& options, const RunResult& result);

/// Runs the command `bristle run`: reads the scene, steps it, and writes the reports.
void run_command(const RunOptions& options);

}  // namespace cli
