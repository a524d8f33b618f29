// Finds how many bristles fit in a deadline on this machine: the command `bristle capacity`.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <bristle/material.hpp>
#include <bristle/patch.hpp>

namespace cli {

struct CapacityOptions {
  double deadline_s = 1e-3;
  bool quick = false;
  bool targets = false;      ///< prints only the table of targets
  std::vector<int> threads;  ///< numbers of threads; empty: 1, and all cores
  std::string isa;           ///< instruction set; empty: the library's choice
  std::string json;          ///< report to write; empty: none, "-": stdout
  /// File for step time against bristles, for tools/plots/capacity.gp; empty: none.
  std::string csv;
};

/// Steady motion of a measurement, after 32 mean snap lengths of sliding. Lengths are in mean snap lengths.
enum class Regime {
  rest,        ///< no motion
  tremor,      ///< motion to and fro by 0.05; nothing snaps once it has settled
  presliding,  ///< 0.003 a step; each bristle snaps once in 333 steps
  one_snap,    ///< 1.0 a step; each bristle snaps up to twice, once on average
  sliding,     ///< 1.6 a step; every bristle snaps, one to three times
  far          ///< 100 a step; 1 m/s at 10 um and 1 kHz
};
struct RegimeFacts {
  const char* name;
  double step;  ///< displacement per step in mean snap lengths
  const char* meaning;
};
const RegimeFacts& facts_of(Regime regime) noexcept;
inline const char* to_string(Regime regime) noexcept { return facts_of(regime).name; }
inline double step_length(Regime regime) noexcept { return facts_of(regime).step; }

/// Case to measure: a kernel variant, a motion, a layout of patches.
struct CapacityCase {
  Regime regime = Regime::sliding;
  bristle::SnapRule rule = bristle::SnapRule::keep;
  bristle::Outputs outputs = bristle::Outputs::end;
  int axes = 2;
  bristle::Precision precision = bristle::Precision::single;
  std::uint32_t patch_bristles = 0;  ///< bristles per patch; 0: one patch of all
  int threads = 1;
  std::optional<double> step = {};              ///< mean snap lengths per step, instead of the regime's
  std::optional<bristle::SnapLength> law = {};  ///< law of snap lengths, instead of uniform
  /// Coefficients{}: lognormal, with residual and shared renewal.
  bool default_material = false;
  bool eager = false;
  int servo_core = -1;
  bristle::Population population = bristle::Population::representatives;
  double resolution = 0.0;  ///< resolution of infinite patches; 0: the library's choice
  bool zigzag = false;      ///< whether every other step goes sideways

  bool is_infinite() const noexcept { return population == bristle::Population::infinite; }
  std::string kernel_name() const;  ///< returns a text such as "2 axes, keep, end + mean, single"
  std::string layout_name() const;  ///< returns a text such as "one patch", "patches of 100"
};

/// Step times at one number of bristles.
struct StepTimes {
  std::uint64_t bristles = 0;
  std::uint64_t steps = 0;
  double p50_s = 0.0, p99_s = 0.0, p999_s = 0.0, max_s = 0.0;
  double ns_per_bristle() const noexcept { return 1e9 * p50_s / static_cast<double>(bristles); }
};

struct CapacityRow {
  CapacityCase what;
  std::vector<StepTimes> curve;  ///< times at all numbers of bristles tried, ascending
  StepTimes in_cache;            ///< times at 14,400 bristles, which fit into the cache
  /// Largest number of bristles with p99 inside the deadline, in the confirming run.
  StepTimes fits;
  bool capped = false;  ///< whether more would have fitted, which was not tried
  /// Whether searching runs fitted but no confirming run did; `fits` is then the last one tried.
  bool unconfirmed = false;
};

/// Result of a loop compared with bristle, interleaved.
struct ComparisonRow {
  std::string regime, what;
  std::uint64_t bristles = 0;
  double ns_per_bristle = 0.0, ns_low = 0.0, ns_high = 0.0;  ///< median and quartiles over the rounds
  /// Time of this loop over bristle's: median and quartiles.
  double ratio = 1.0, ratio_low = 1.0, ratio_high = 1.0;
};

/// Target of the library, and the value measured here.
struct TargetRow {
  std::string name, what;
  double measured = 0.0, low = 0.0, high = 0.0;  ///< median and quartiles; p99 has no quartiles
  double limit = 0.0;
  bool at_least = false;  ///< whether the limit is a lower one
  std::string unit;
  bool met() const noexcept { return at_least ? measured >= limit : measured <= limit; }
  /// Returns by what share the measured value misses the limit; 0 = met.
  double missed_by() const noexcept {
    return met() ? 0.0 : at_least ? 1.0 - measured / limit : measured / limit - 1.0;
  }
};
/// Returns what bounds the time of a target of this name (bounds.cpp); "" if nothing is known.
const char* bound_of(std::string_view target) noexcept;

/// Times of patches of infinitely many bristles in one motion.
struct InfiniteRow {
  std::string motion;  ///< "rest", "tremor", "straight", "zigzag"
  double step = 0.0;   ///< mean snap lengths per step
  std::string kernel;
  std::uint32_t resolution = 0;  ///< pieces of path per mean snap length
  std::uint64_t patches = 0;
  std::uint64_t bytes_per_patch = 0;
  double ns_per_patch = 0.0, ns_low = 0.0, ns_high = 0.0;  ///< time of a step: median and quartiles
};

struct CapacityResult {
  std::string isa;
  std::uint64_t state_hash = 0;  ///< hash of a fixed scene; if it differs, other results were computed
  bool plain_loops_run = false;
  std::vector<ComparisonRow> comparisons;
  std::vector<CapacityRow> rows;
  std::vector<TargetRow> targets;
  std::vector<InfiniteRow> infinite;
  std::vector<CapacityRow> contacts;  ///< infinite patches that fit; `bristles` is the number of patches
};

/// Contestant of a comparison. Contestants run alternately, so that disturbances affect all alike.
struct Contestant {
  std::string name;
  std::function<double()> step;  ///< returns part of the result, so that no step is optimised away
  std::vector<double> ns;        ///< time per bristle and step, one value a round
};
/// Compares contestants; returns a row for each, with ratios to the first. In compare.cpp.
std::vector<ComparisonRow> compare(std::vector<Contestant> contestants, const std::string& regime,
                                   std::uint64_t bristles, std::uint64_t rounds);
/// Makes a contestant of bristle. For infinite patches `bristles` is the number of patches.
Contestant bristle_kernel(const CapacityCase& what, std::uint64_t bristles, const std::string& isa);
Contestant stream_loop(const CapacityCase& what, std::uint64_t bristles);
/// Makes a contestant of the paper's loop in steady motion, as compiled: <double, 3> and <float, 2>.
template <class Real, int Dimensions>
Contestant paper_loop(const char* name, Regime regime, std::uint64_t bristles);

/// Function called with the name of what is measured next.
using Report = std::function<void(const std::string& what)>;
/// Measures the targets. In targets.cpp.
std::vector<TargetRow> measure_targets(const CapacityOptions& options, const Report& report);

/// Steps at which sliding infinite patches are measured, in mean snap lengths. In straight sliding a patch
/// that has forgotten its start is carried along without recomputation; in zigzag it is recomputed.
constexpr double infinite_slides[] = {0.003, 0.1, 1.0, 2.0, 4.0, 8.0, 100.0};
/// Makes a case of infinite patches. In infinite.cpp.
CapacityCase infinite_case(Regime regime, std::optional<double> step = {}, bool zigzag = false);
std::vector<CapacityCase> infinite_sliding();
std::vector<InfiniteRow> measure_infinite(const CapacityOptions& options, const Report& report);
/// Pieces per mean snap length at which the zigzag's force is within 1 % at every step, and that of slides of
/// 0.1 to 0.25 mean snap lengths within 1.04 % (core/patches/COHORTS.md).
constexpr double within_a_percent = 4.0;
/// Makes a case of contacts that slide in zigzag by 0.1, at this resolution (0: the library's choice).
CapacityCase sliding_contacts(double resolution, int threads);
std::vector<CapacityRow> measure_contacts(const CapacityOptions& options, const std::vector<int>& threads,
                                          const Report& report);

/// Function that times a number of steps of a number of bristles.
using MeasureSteps = std::function<StepTimes(std::uint64_t bristles, std::uint64_t steps)>;
/// Finds the largest number of bristles that fits. In search.cpp.
CapacityRow find_capacity(const CapacityCase& what, const CapacityOptions& options);
/// As find_capacity() above, with the caller's clock.
CapacityRow find_capacity(const CapacityCase& what, const CapacityOptions& options,
                          const MeasureSteps& measure);
/// Compares bristle with plain loops. In compare.cpp.
std::vector<ComparisonRow> compare_loops(const CapacityOptions& options);
/// Returns the report as text. In report.cpp.
std::string capacity_table(const CapacityOptions& options, const CapacityResult& result);
std::string capacity_json(const CapacityOptions& options, const CapacityResult& result);
std::string capacity_csv(const CapacityOptions& options, const CapacityResult& result);

/// Runs the subcommand. Throws UserError.
void capacity_command(const CapacityOptions& options);

}  // namespace cli
