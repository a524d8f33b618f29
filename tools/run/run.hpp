// Steps a scene: the command `bristle run`.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <bristle/deadline_monitor.hpp>
#include <bristle/patch.hpp>

#include "tools/run/overload.hpp"
#include "tools/run/realtime.hpp"
#include "tools/scene/body_motion.hpp"
#include "tools/scene/scene.hpp"

namespace cli {

class SceneStepper;

struct RunOptions {
  std::string scene;
  std::string trace;       ///< motion file that moves the patches; empty: motions of the scene
  double clip_load = 0.0;  ///< N; loads from -clip_load to 0 count as 0
  std::string out;         ///< force file to write; empty: none
  std::string json;        ///< report to write; empty: none, "-": stdout
  std::optional<int> threads;
  std::string isa;  ///< instruction set; empty: the library's choice
  std::optional<std::uint64_t> steps;
  std::optional<std::uint32_t> bristles;    ///< number of bristles of each patch; none: numbers of the scene
  std::optional<RealtimeOptions> realtime;  ///< real-time pacing; none: steps without pauses
  std::string restore_state;                ///< file of the state to start from; empty: none
  std::string save_state;                   ///< file to save the final state to; empty: none
  OverloadOptions overload;
  SceneLimits limits;
  bool quiet = false;  ///< whether no progress is shown on a terminal
};

/// Sum, sum of squares, lowest and highest of a force component, N.
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

/// Results of one [[patch]], over all its copies and all steps.
struct PatchResult {
  bristle::PatchInfo info;  ///< facts of the first copy, at the end of the run
  std::uint64_t memory_bytes = 0;
  ForceStatistics force[2];       ///< N, force at the end of each step, on the body
  ForceStatistics mean_force[2];  ///< N, mean force over each step, on the body, if computed
  ForceStatistics load;
  double sliding_force = 0.0;  ///< N, sum over the sliding steps of the elastic force
  double sliding_load = 0.0;   ///< N, sum over the sliding steps of the normal load
  std::uint64_t sliding_steps = 0;
  /// Highest ratio of elastic force to load, of steps whose load is at least a tenth of max_normal_load.
  double highest_coefficient = 0.0;
  std::uint64_t overload_steps = 0, bad_steps = 0, steps_in_contact = 0;
  std::uint64_t snaps = 0;
  double dissipated = 0.0, contact_loss = 0.0, damper_work = 0.0, work = 0.0, stored = 0.0;  // J
};

/// When a body breaks away and how long it sticks. A body slides while it is farther than ten mean snap
/// lengths (the longest of its patches') from where it last stuck, and faster than one such length per
/// second.
struct Sticking {
  bool broke_away = false;
  double time = 0.0, applied = 0.0;  ///< s, first break-away; N, force applied then
  double stuck = 0.0;                ///< s, total time in which the body was stuck
};

struct BodyResult {
  double position[2], velocity[2], highest_speed;
  SolveStatistics solve;
  Sticking sticking;
};

struct RunResult {
  std::uint64_t steps = 0;
  std::uint64_t steps_before = 0;  ///< number of steps that the restored state had already done
  double seconds = 0.0;            ///< s, wall time of the steps, without the bare sleep loop
  bristle::DeadlineMonitor monitor;
  std::string isa;
  int threads = 1;
  std::uint64_t bristles = 0;          ///< number of representatives in all patches
  std::uint64_t infinite_patches = 0;  ///< number of patches with the infinite brush
  std::uint64_t memory_bytes = 0;
  std::uint64_t state_hash = 0;
  std::size_t patches_written = 0;  ///< number of patches in the force file
  std::vector<PatchResult> patches;
  std::vector<BodyResult> bodies;
  std::optional<RealtimeResult> realtime;
  std::optional<OverloadResult> overload;  ///< set if the run had a time budget or repeated the record of one

  /// Reason why the state could not be saved, such as a full disk; empty if it was saved or not asked for.
  std::string save_failure;
};

/// Sets the scene's time step to one over the rate (Hz), and reduces a longer deadline to the time step.
void set_rate(Scene& scene, double rate_hz);

/// Function called after every step, outside the timed part, with the motions and responses of all patches.
using StepObserver = std::function<void(const SceneStepper&)>;

/// Runs a scene. Throws UserError, and what `observer` throws.
RunResult run_scene(const Scene& scene, const RunOptions& options, const StepObserver& observer = {});

/// Lists the features that a patch does without, such as "second axis", and so its kernel leaves out.
std::vector<std::string> left_out(const ScenePatch& patch, const bristle::Material& material);

std::string run_table(const Scene& scene, const RunOptions& options, const RunResult& result);
std::string run_json(const Scene& scene, const RunOptions& options, const RunResult& result);

/// Runs the subcommand: reads the scene, runs it, writes the reports.
void run_command(const RunOptions& options);

}  // namespace cli
