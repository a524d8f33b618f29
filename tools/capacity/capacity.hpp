// `bristle capacity`: how many bristles fit in a deadline on this machine.
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
  bool targets = false;      ///< the table of targets alone
  std::vector<int> threads;  ///< empty: 1, and all cores
  std::string isa;           ///< empty: the library's choice
  std::string json;          ///< report; empty: none, "-": stdout
  std::string csv;           ///< step time against bristles, for tools/plots/capacity.gp; empty: none
};

/// The steady motion of a measurement, after 32 mean snap lengths of sliding. Lengths in mean snap lengths.
enum class Regime {
  rest,        ///< no motion
  tremor,      ///< to and fro by 0.05: nothing snaps once it has settled
  presliding,  ///< 0.003 a step: of every bristle one snap in 333 steps
  one_snap,    ///< 1.0 a step: none to two snaps of every bristle, one on average
  sliding,     ///< 1.6 a step: every bristle snaps, one to three times
  far          ///< 100 a step: 1 m/s at 10 um and 1 kHz
};
struct RegimeFacts {
  const char* name;
  double step;  ///< displacement of a step in mean snap lengths
  const char* meaning;
};
const RegimeFacts& facts_of(Regime regime) noexcept;
inline const char* to_string(Regime regime) noexcept { return facts_of(regime).name; }
inline double step_length(Regime regime) noexcept { return facts_of(regime).step; }

/// One case to measure: a kernel variant, a motion, a layout.
struct CapacityCase {
  Regime regime = Regime::sliding;
  bristle::SnapRule rule = bristle::SnapRule::keep;
  bristle::Outputs outputs = bristle::Outputs::end;
  int axes = 2;
  bristle::Precision precision = bristle::Precision::single;
  std::uint32_t patch_bristles = 0;  ///< 0: one patch of all
  int threads = 1;
  std::optional<double> step = {};              ///< mean snap lengths, in place of the regime's
  std::optional<bristle::SnapLength> law = {};  ///< in place of uniform
  bool default_material = false;                ///< Coefficients{}: lognormal, with residual and renewal
  bool eager = false;
  int servo_core = -1;
  bristle::Population population = bristle::Population::representatives;
  double resolution = 0.0;  ///< of infinite patches; 0: the library's choice
  bool zigzag = false;      ///< every other step goes across

  bool is_infinite() const noexcept { return population == bristle::Population::infinite; }
  std::string kernel_name() const;  ///< "2 axes, keep, end + mean, single", "default material, ..."
  std::string layout_name() const;  ///< "one patch", "patches of 100"
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
  std::vector<StepTimes> curve;  ///< every number of bristles tried, ascending
  StepTimes in_cache;            ///< at 14,400 bristles
  StepTimes fits;                ///< the most bristles with p99 inside the deadline, in the confirming run
  bool capped = false;           ///< more would have fitted; not tried
  bool unconfirmed = false;      ///< probes fitted, no confirming run did; `fits` is then the last of these
};

/// One loop beside bristle's in an interleaved comparison.
struct ComparisonRow {
  std::string regime, what;
  std::uint64_t bristles = 0;
  double ns_per_bristle = 0.0, ns_low = 0.0, ns_high = 0.0;  ///< median over the rounds, and quartiles
  double ratio = 1.0, ratio_low = 1.0, ratio_high = 1.0;  ///< its time over bristle's: median and quartiles
};

/// A target of the library's and what was measured here.
struct TargetRow {
  std::string name, what;
  double measured = 0.0, low = 0.0, high = 0.0;  ///< median and quartiles, but for p99
  double limit = 0.0;
  bool at_least = false;  ///< the limit is a lower one
  std::string unit;
  bool met() const noexcept { return at_least ? measured >= limit : measured <= limit; }
  /// Share of what it should be that is missing, or of the limit that is too much; 0 = met.
  double missed_by() const noexcept {
    return met() ? 0.0 : at_least ? 1.0 - measured / limit : measured / limit - 1.0;
  }
};
/// Returns what bounds the time of a target, by its name; "" = nothing is known. bounds.cpp
const char* bound_of(std::string_view target) noexcept;

/// Patches of infinitely many bristles in one motion.
struct InfiniteRow {
  std::string motion;  ///< "rest", "tremor", "straight", "zigzag"
  double step = 0.0;   ///< mean snap lengths
  std::string kernel;
  std::uint32_t resolution = 0;  ///< pieces of path per mean snap length
  std::uint64_t patches = 0;
  std::uint64_t bytes_per_patch = 0;
  double ns_per_patch = 0.0, ns_low = 0.0, ns_high = 0.0;  ///< of a step: median and quartiles
};

struct CapacityResult {
  std::string isa;
  std::uint64_t state_hash = 0;  ///< of a fixed scene: where it differs, other things were computed
  bool plain_loops_run = false;
  std::vector<ComparisonRow> comparisons;
  std::vector<CapacityRow> rows;
  std::vector<TargetRow> targets;
  std::vector<InfiniteRow> infinite;
  std::vector<CapacityRow> contacts;  ///< infinite patches that fit; `bristles` is their number
};

/// One of the things that are run in turn, so that what the machine does meanwhile strikes all alike.
struct Contestant {
  std::string name;
  std::function<double()> step;  ///< returns something of the result, so that no step is optimised away
  std::vector<double> ns;        ///< per bristle and step, one value a round
};
/// A row for each; ratios to the first. capacity_compare.cpp
std::vector<ComparisonRow> compare(std::vector<Contestant> contestants, const std::string& regime,
                                   std::uint64_t bristles, std::uint64_t rounds);
/// Of infinite patches `bristles` is the number of patches.
Contestant bristle_kernel(const CapacityCase& what, std::uint64_t bristles, const std::string& isa);
Contestant stream_loop(const CapacityCase& what, std::uint64_t bristles);
/// The paper's loop in steady motion, as compiled: <double, 3> and <float, 2>.
template <class Real, int Dimensions>
Contestant paper_loop(const char* name, Regime regime, std::uint64_t bristles);

/// Called with what is measured next.
using Report = std::function<void(const std::string& what)>;
/// capacity_targets.cpp
std::vector<TargetRow> measure_targets(const CapacityOptions& options, const Report& report);

/// Steps of infinite patches that slide, mean snap lengths: straight, where a patch that has forgotten the
/// beginning is carried along as it stands, and in zigzag, where it is not.
constexpr double infinite_slides[] = {0.003, 0.1, 1.0, 2.0, 4.0, 8.0, 100.0};
/// capacity_infinite.cpp
CapacityCase infinite_case(Regime regime, std::optional<double> step = {}, bool zigzag = false);
std::vector<CapacityCase> infinite_sliding();
std::vector<InfiniteRow> measure_infinite(const CapacityOptions& options, const Report& report);
/// Pieces with which that zigzag is within 1 % of the force at every step, and slides of 0.1 to 0.25 mean
/// snap lengths within 1.04 % (core/patches/COHORTS.md).
constexpr double within_a_percent = 4.0;
/// Contacts that slide in zigzag of 0.1, at that resolution and at the library's choice.
CapacityCase sliding_contacts(double resolution, int threads);
std::vector<CapacityRow> measure_contacts(const CapacityOptions& options, const std::vector<int>& threads,
                                          const Report& report);

/// Times so many steps of so many bristles.
using MeasureSteps = std::function<StepTimes(std::uint64_t bristles, std::uint64_t steps)>;
/// capacity_search.cpp
CapacityRow find_capacity(const CapacityCase& what, const CapacityOptions& options);
/// As find_capacity() above, with a clock of the caller's.
CapacityRow find_capacity(const CapacityCase& what, const CapacityOptions& options,
                          const MeasureSteps& measure);
/// capacity_compare.cpp
std::vector<ComparisonRow> compare_loops(const CapacityOptions& options);
/// capacity_report.cpp
std::string capacity_table(const CapacityOptions& options, const CapacityResult& result);
std::string capacity_json(const CapacityOptions& options, const CapacityResult& result);
std::string capacity_csv(const CapacityOptions& options, const CapacityResult& result);

/// Throws UserError.
void capacity_command(const CapacityOptions& options);

}  // namespace cli
