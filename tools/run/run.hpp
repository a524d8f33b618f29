// `bristle run`: steps a scene.
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
  std::string trace;       ///< empty: the scene's own motions
  double clip_load = 0.0;  ///< N, of that file: read_motion_file
  std::string out;         ///< force file; empty: none
  std::string json;        ///< report; empty: none, "-": stdout
  std::optional<int> threads;
  std::string isa;  ///< empty: the library's choice
  std::optional<std::uint64_t> steps;
  std::optional<std::uint32_t> bristles;    ///< of each patch, in place of the scene's
  std::optional<RealtimeOptions> realtime;  ///< against the clock; none: back to back
  std::string restore_state;                ///< state file to continue from; empty: the scene's beginning
  std::string save_state;                   ///< state file to write at the end; empty: none
  OverloadOptions overload;
  SceneLimits limits;
  bool quiet = false;  ///< no progress on a terminal
};

/// Sum, square sum and extremes of a force component, N.
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

/// One [[patch]] of the scene, over its copies and all steps.
struct PatchResult {
  bristle::PatchInfo info;  ///< of the first copy, at the end
  std::uint64_t memory_bytes = 0;
  ForceStatistics force[2];       ///< end force on the body
  ForceStatistics mean_force[2];  ///< mean force on the body, where computed
  ForceStatistics load;
  double sliding_force = 0.0;  ///< N, elastic force, summed over sliding steps
  double sliding_load = 0.0;   ///< N, load summed over the same steps
  std::uint64_t sliding_steps = 0;
  double highest_coefficient = 0.0;  ///< elastic force over load, at a tenth of max_normal_load or more
  std::uint64_t overload_steps = 0, bad_steps = 0, steps_in_contact = 0;
  std::uint64_t snaps = 0;
  double dissipated = 0.0, contact_loss = 0.0, damper_work = 0.0, work = 0.0, stored = 0.0;  // J
};

/// When a body broke away and how long it stuck. It slides while it is further from where it last held than
/// ten mean snap lengths (the longest of its patches'), and faster than one of them a second.
struct Sticking {
  bool broke_away = false;
  double time = 0.0, applied = 0.0;  ///< s, N: of the first break-away, as it left the first of these lengths
  double stuck = 0.0;                ///< s, in all
};

struct BodyResult {
  double position[2], velocity[2], highest_speed;
  SolveStatistics solve;
  Sticking sticking;
};

struct RunResult {
  std::uint64_t steps = 0;
  std::uint64_t steps_before = 0;  ///< in the run whose state was restored
  double seconds = 0.0;  ///< wall time of the loop, without that of a bare loop that alternated with it
  bristle::DeadlineMonitor monitor;
  std::string isa;
  int threads = 1;
  std::uint64_t bristles = 0;          ///< representatives of all patches; none of an infinite patch
  std::uint64_t infinite_patches = 0;  ///< Population::infinite
  std::uint64_t memory_bytes = 0;
  std::uint64_t state_hash = 0;
  std::size_t patches_written = 0;  ///< to the force file
  std::vector<PatchResult> patches;
  std::vector<BodyResult> bodies;
  std::optional<RealtimeResult> realtime;
  std::optional<OverloadResult> overload;  ///< where there was a budget, or a replay of one
  std::string save_failure;  ///< why the state could not be saved, on a full disk for instance; empty: it was
};

/// Another time step, one over the rate; a deadline that would be longer becomes as long.
void set_rate(Scene& scene, double rate_hz);

/// Called after every step, outside what is timed: the scene's motions and the responses to them.
using StepObserver = std::function<void(const SceneStepper&)>;

/// Throws UserError, and what the observer throws.
RunResult run_scene(const Scene& scene, const RunOptions& options, const StepObserver& observer = {});

/// Features that the kernel of a patch leaves out, e.g. "second axis".
std::vector<std::string> left_out(const ScenePatch& patch, const bristle::Material& material);

std::string run_table(const Scene& scene, const RunOptions& options, const RunResult& result);
std::string run_json(const Scene& scene, const RunOptions& options, const RunResult& result);

/// The subcommand: reads, runs, reports.
void run_command(const RunOptions& options);

}  // namespace cli
