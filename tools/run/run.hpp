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
  std::string trace;       ///< motion file for the patches; empty: the scene's own motions
  double clip_load = 0.0;  ///< N, loads of the motion file that count as 0: read_motion_file
  std::string out;         ///< force file to write; empty: none
  std::string json;        ///< report to write; empty: none, "-": stdout
  std::optional<int> threads;
  std::string isa;  ///< instruction set; empty: the library's choice
  std::optional<std::uint64_t> steps;
  std::optional<std::uint32_t> bristles;    ///< bristles of each patch, instead of the scene's
  std::optional<RealtimeOptions> realtime;  ///< steps by the real-time clock; none: without pacing
  std::string restore_state;                ///< state file to start from; empty: the scene's beginning
  std::string save_state;                   ///< state file to write at the end; empty: none
  OverloadOptions overload;
  SceneLimits limits;
  bool quiet = false;  ///< shows no progress on a terminal
};

/// Sum, sum of squares and extremes of a force component, N.
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

/// Result of one [[patch]] over its copies and all steps.
struct PatchResult {
  bristle::PatchInfo info;  ///< info of the first copy at the end
  std::uint64_t memory_bytes = 0;
  ForceStatistics force[2];       ///< end force on the body
  ForceStatistics mean_force[2];  ///< mean force on the body, if computed
  ForceStatistics load;
  double sliding_force = 0.0;  ///< N, sum of the elastic force over sliding steps
  double sliding_load = 0.0;   ///< N, sum of the load over sliding steps
  std::uint64_t sliding_steps = 0;
  /// Highest elastic force over load, at loads of at least a tenth of max_normal_load.
  double highest_coefficient = 0.0;
  std::uint64_t overload_steps = 0, bad_steps = 0, steps_in_contact = 0;
  std::uint64_t snaps = 0;
  double dissipated = 0.0, contact_loss = 0.0, damper_work = 0.0, work = 0.0, stored = 0.0;  // J
};

/// Times of a body's break-away and sticking. It slides while it is farther than ten mean snap lengths (the
/// longest of its patches') from where it last stuck, and faster than one of them a second.
struct Sticking {
  bool broke_away = false;
  double time = 0.0, applied = 0.0;  ///< s, N; when it began to break away
  double stuck = 0.0;                ///< s, total time of sticking
};

struct BodyResult {
  double position[2], velocity[2], highest_speed;
  SolveStatistics solve;
  Sticking sticking;
};

struct RunResult {
  std::uint64_t steps = 0;
  std::uint64_t steps_before = 0;  ///< steps before the restored state
  double seconds = 0.0;            ///< wall time of the loop, without the bare loop that alternated with it
  bristle::DeadlineMonitor monitor;
  std::string isa;
  int threads = 1;
  std::uint64_t bristles = 0;          ///< representatives of all patches; an infinite patch has none
  std::uint64_t infinite_patches = 0;  ///< patches with Population::infinite
  std::uint64_t memory_bytes = 0;
  std::uint64_t state_hash = 0;
  std::size_t patches_written = 0;  ///< patches in the force file
  std::vector<PatchResult> patches;
  std::vector<BodyResult> bodies;
  std::optional<RealtimeResult> realtime;
  std::optional<OverloadResult> overload;  ///< present with a budget, or a replay of one
  /// Reason why the state could not be saved, such as a full disk; empty if it was.
  std::string save_failure;
};

/// Sets the time step to one over the rate; a longer deadline is reduced to it.
void set_rate(Scene& scene, double rate_hz);

/// Observer called after every step, outside the timing: it sees the motions and responses.
using StepObserver = std::function<void(const SceneStepper&)>;

/// Runs a scene. Throws UserError, and what the observer throws.
RunResult run_scene(const Scene& scene, const RunOptions& options, const StepObserver& observer = {});

/// Lists features that the kernel of a patch leaves out, such as "second axis".
std::vector<std::string> left_out(const ScenePatch& patch, const bristle::Material& material);

std::string run_table(const Scene& scene, const RunOptions& options, const RunResult& result);
std::string run_json(const Scene& scene, const RunOptions& options, const RunResult& result);

/// Runs the subcommand: reads, runs, reports.
void run_command(const RunOptions& options);

}  // namespace cli
