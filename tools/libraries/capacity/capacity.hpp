// Finds how many bristles a step can have within a deadline on this machine: the command `bristle capacity`.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <bristle/material.hpp>
#include <bristle/patch.hpp>

#include "tools/libraries/reports/quantile.hpp"

namespace cli {

struct CapacityOptions {
  double deadline_s = 1e-3;
  bool quick = false;
  bool targets = false;      ///< whether only the speed targets are measured
  std::vector<int> threads;  ///< numbers of threads to measure; empty: one, and as many as cores
  std::string isa;           ///< instruction set, as "avx2"; empty: the library's choice
  std::string json;          ///< JSON report to write; empty: none, "-": stdout

  /// Path of a CSV file of step time against number of bristles, which tools/plots/capacity.gp plots; empty:
  /// no file.
  std::string csv;
};

/// Steady motion under which steps are timed. Patches first slide 32 mean snap lengths. Lengths below are in
/// mean snap lengths.
enum class Regime {
  rest,        ///< no motion at all
  tremor,      ///< motion to and fro by 0.05 mean snap lengths; once it has settled no bristle snaps
  presliding,  ///< steps of 0.003 mean snap lengths; each bristle snaps once in 333 steps
  one_snap,    ///< steps of 1.0 mean snap length; a bristle snaps once on average, at most twice
  sliding,     ///< steps of 1.6 mean snap lengths; every bristle snaps, one to three times
  turning,     ///< steps of 1.6 mean snap lengths, every other one sideways: sliding bristles slide and turn
  far          ///< steps of 100 mean snap lengths, such as 1 m/s at 1 kHz with 10 um of mean snap length
};
struct RegimeFacts {
  const char* name;
  double step;  ///< displacement per step in mean snap lengths
  const char* meaning;
};
const RegimeFacts& facts_of(Regime regime) noexcept;
inline const char* to_string(Regime regime) noexcept { return facts_of(regime).name; }
inline double step_length(Regime regime) noexcept { return facts_of(regime).step; }

/// Case whose step is timed: a kind of motion, a variant of the kernel, and a number of bristles per patch.
struct CapacityCase {
  Regime regime = Regime::sliding;
  bristle::SnapRule rule = bristle::SnapRule::keep;
  bristle::Outputs outputs = bristle::Outputs::end;
  int axes = 2;
  bristle::Precision precision = bristle::Precision::single;
  std::uint32_t patch_bristles = 0;  ///< number of bristles of each patch; 0: one patch has all bristles
  int threads = 1;
  /// Displacement per step in mean snap lengths; not given: that of the motion `regime`.
  std::optional<double> step = {};
  std::optional<bristle::SnapLength> law = {};  ///< law of the snap lengths; none: uniform

  /// Whether the material is the default one: lognormal snap lengths, residual length, shared renewal.
  bool default_material = false;
  bool eager = false;
  bristle::Population population = bristle::Population::representatives;
  double resolution = 0.0;   ///< pieces of path per mean snap length; 0: the default
  bool zigzag = false;       ///< whether every other step goes sideways
  double turn = 0.0;         ///< turn of the direction per step, rad, to the left
  bool either_side = false;  ///< whether each turn goes to the left or to the right, at random
  double ripple = 0.0;       ///< share by which the load falls at most, at random in each step

  bool is_infinite() const noexcept { return population == bristle::Population::infinite; }
  double step_in_lengths() const noexcept { return step.value_or(step_length(regime)); }
  std::string motion_name() const;  ///< returns a text such as "rest" or "bend, rippling load"
  std::string kernel_name() const;  ///< returns a text such as "2 axes, keep, end + mean, single"
  std::string layout_name() const;  ///< returns a text such as "one patch", "patches of 100"
};

/// Quantiles of the wall time of single steps with one number of bristles.
struct StepTimes {
  std::uint64_t bristles = 0;
  std::uint64_t steps = 0;
  double p50_s = 0.0, p99_s = 0.0, p999_s = 0.0, max_s = 0.0;
  double ns_per_bristle() const noexcept { return 1e9 * p50_s / static_cast<double>(bristles); }
};

struct CapacityRow {
  CapacityCase what;
  std::vector<StepTimes> curve;  ///< step times for each number of bristles tried, ascending
  StepTimes in_cache;            ///< step times of 14,400 bristles, which fit the CPU cache

  /// Largest number of bristles that fits the deadline: in a longer, confirming run the 99th percentile of
  /// step time met it.
  StepTimes fits;
  /// Whether even the largest number tried met the deadline, so that more may fit.
  bool capped = false;

  /// Whether no confirming run met the deadline, only short ones; `fits` then has the last number tried.
  bool unconfirmed = false;
};

/// Time of another friction loop, measured alternately with the library's on an equal motion.
struct ComparisonRow {
  std::string regime, what;
  std::uint64_t bristles = 0;
  Quartiles ns;     ///< time of this loop per bristle and step, ns
  Quartiles ratio;  ///< time of this loop over that of the library
};

/// Speed target of the library, and the value measured on this machine.
struct TargetRow {
  std::string name, what;
  Quartiles measured;  ///< value measured on this machine; of a 99th percentile `low` is the median
  double limit = 0.0;
  bool at_least = false;  ///< whether the target is reached at `limit` or above; if not, at `limit` or below
  std::string unit;
  bool met() const noexcept { return at_least ? measured.median >= limit : measured.median <= limit; }
  /// Returns by what share of its limit the measured value misses a target; 0 if the target is met.
  double missed_by() const noexcept {
    return met() ? 0.0 : at_least ? 1.0 - measured.median / limit : measured.median / limit - 1.0;
  }
};
/// Returns what bounds the time of a speed target (instructions, latency, memory), for the report; "" if
/// unknown.
const char* bound_of(std::string_view target) noexcept;

/// Step times of patches of infinitely many bristles, in one motion.
struct InfiniteRow {
  CapacityCase what;
  std::uint32_t resolution = 0;  ///< pieces of path per mean snap length of an infinite patch
  std::uint64_t patches = 0;
  std::uint64_t bytes_per_patch = 0;
  Quartiles ns_per_patch;  ///< time of a patch's step, ns
  double p99_s = 0.0;  ///< 99th percentile of the time of a step of all patches, reading the clock included
};

/// Memory of a contact of the default material, and the time to save and to restore its state, averaged over
/// a batch of 100.
struct SnapshotRow {
  std::string what;
  std::uint64_t memory_bytes = 0;          ///< PatchInfo::memory_bytes
  std::uint64_t state_bytes = 0;           ///< bytes that a contact adds to PatchBatch::state_size
  std::uint64_t batch_bytes = 0;           ///< state_size of a batch without contacts
  double save_ns = 0.0, restore_ns = 0.0;  ///< median time per contact
};

struct CapacityResult {
  std::string isa;
  std::uint64_t state_hash = 0;  ///< state hash of a fixed scene; equal hashes prove equal results
  bool plain_loops_run = false;
  std::vector<ComparisonRow> comparisons;
  std::vector<CapacityRow> rows;
  std::vector<TargetRow> targets;
  std::vector<InfiniteRow> infinite;
  /// Numbers of infinite patches that meet the deadline, in rows of the same form as those for bristles.
  std::vector<CapacityRow> contacts;
  std::vector<SnapshotRow> snapshots;
};

/// Friction loop whose time is compared with that of others. The loops run alternately, so that disturbances
/// by other programs affect all alike.
struct Contestant {
  std::string name;
  std::function<double()> step;  ///< runs a step; its result keeps the compiler from removing the loop
  std::vector<double> ns;        ///< measured times per bristle and step, a value per round
};
/// Times the loops alternately. Returns for each its time, and the ratio of that time to the first loop's.
/// Defined in compare.cpp.
std::vector<ComparisonRow> compare(std::vector<Contestant> contestants, const std::string& regime,
                                   std::uint64_t bristles, std::uint64_t rounds);
/// Makes a contestant that steps the library's own patches; if they are infinite, `bristles` counts patches.
Contestant bristle_kernel(const CapacityCase& what, std::uint64_t bristles, const std::string& isa);
Contestant stream_loop(const CapacityCase& what, std::uint64_t bristles);

/// Makes a disc of infinite brushes in 6 rings; its force and torque are within 1 % of a continuous disc's.
/// In a step its rim moves `path` mean snap lengths and its centre half as far; with `there_and_back` the
/// direction alternates from step to step. Throws bristle::Error if the machine lacks the instruction set.
Contestant brush_disc(double path, bool there_and_back, const std::string& isa);
/// Makes a disc of 21 x 21 elements of the LuGre friction model (tools/libraries/rivals/rival_grid.hpp), with
/// equal friction and the motion of brush_disc().
Contestant lugre_disc(double path, bool there_and_back);

/// Function that shows, in a progress line, the name of what is measured next.
using Report = std::function<void(const std::string& what)>;
/// Measures whether this machine meets the library's speed targets. Defined in targets.cpp.
std::vector<TargetRow> measure_targets(const CapacityOptions& options, const Report& report);

/// Makes a case of infinite patches of the default material that move in this regime. Defined in
/// infinite.cpp.
CapacityCase infinite_case(Regime regime, std::optional<double> step = {});
/// Makes the cases of sliding infinite patches. Straight slides and zigzags have steps of 0.003 to 100 mean
/// snap lengths. Steps of 0.1 also go round bends with radii of 10 and 1 mean snap lengths, under a load that
/// ripples, and round right angles, always to the left or to either side.
std::vector<CapacityCase> infinite_sliding();
std::vector<InfiniteRow> measure_infinite(const CapacityOptions& options, const Report& report);
/// Measures memory, saved state and times of contacts of the default material. Defined in snapshots.cpp.
std::vector<SnapshotRow> measure_snapshots(const CapacityOptions& options);
/// Resolution (pieces of path per mean snap length) with which the rms error of the force is within 1 % of
/// kinetic friction in straight slides, on bends and in zigzags, and 1.1 % round random right angles
/// (core/patches/COHORTS.md).
constexpr double coarse_resolution = 4.0;
/// Makes a case of infinite patches that slide straight in steps of 0.1 mean snap lengths.
CapacityCase contacts(double resolution, int threads);
std::vector<CapacityRow> measure_contacts(const CapacityOptions& options, const std::vector<int>& threads,
                                          const Report& report);

/// Function that runs this many steps with this many bristles and returns their times; tests supply another
/// one.
using MeasureSteps = std::function<StepTimes(std::uint64_t bristles, std::uint64_t steps)>;
/// Finds the largest number of bristles whose steps meet the deadline, by timing them. Defined in search.cpp.
CapacityRow find_capacity(const CapacityCase& what, const CapacityOptions& options);
/// Finds the largest number of bristles that meets the deadline, with step times supplied by a test.
CapacityRow find_capacity(const CapacityCase& what, const CapacityOptions& options,
                          const MeasureSteps& measure);
/// Times the library and plain loops alternately, in each kind of motion. Defined in compare.cpp.
std::vector<ComparisonRow> compare_loops(const CapacityOptions& options);
/// Formats the result of the study of capacity as text. Defined in report.cpp.
std::string capacity_table(const CapacityOptions& options, const CapacityResult& result);
std::string capacity_json(const CapacityOptions& options, const CapacityResult& result);
std::string capacity_csv(const CapacityOptions& options, const CapacityResult& result);

/// Runs the command `bristle capacity`: measures and writes the reports. Throws UserError.
void capacity_command(const CapacityOptions& options);

}  // namespace cli
