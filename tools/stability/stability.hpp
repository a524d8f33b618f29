// Compares a mass on a patch in closed loop with the limits of linear theory: the command `bristle
// stability`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/stability/loop.hpp"
#include "tools/stability/pulled.hpp"

namespace cli {

struct StabilityOptions {
  bool quick = false;
  int threads = 0;   ///< number of threads; 0: one per core
  std::string json;  ///< report to write; empty: none, "-": stdout
  std::string csv;   ///< file for the map, for tools/plots/stability.gp; empty: none
  /// Population in the maps and on the slope.
  bristle::Population population = bristle::Population::representatives;
};

/// Reason why simulation and linear theory give different verdicts.
enum class Why {
  agree,
  at_the_limit,       ///< so near the limit that a quarter of the run changes the amplitude by less than 5 %
  damper_in_sliding,  ///< stable while sticking, but damper and mass alone are unstable in sliding
  after_sliding,      ///< settles from sticking, but keeps snapping when it comes from sliding
  encoder,            ///< counts of the encoder keep exciting it
  snaps_damp,         ///< unstable while sticking, but snaps remove the energy that a step adds
  other
};
const char* to_string(Why why) noexcept;

struct MapCell {
  double k = 0.0;       ///< K T^2/m
  double second = 0.0;  ///< C T/m, or for a device b T/m
  bool linear_stable = false;
  LoopResult sticking, sliding;        ///< started from a push within presliding, and from steady sliding
  Verdict verdict = Verdict::settles;  ///< worse verdict of the two
  bool unbounded = false;
  Why why = Why::agree;
};

struct SchemeMap {
  Scheme scheme = Scheme::semi_implicit;
  std::vector<MapCell> cells;
  std::uint64_t agreeing() const;
};

/// Coarse map under another condition than constant load and one axis.
struct VariedMap {
  Scheme scheme = Scheme::semi_implicit;
  /// Two axes, turned in sliding: number of cells, and of those with the verdict of linear theory.
  std::uint64_t turned = 0, turned_agree = 0;
  /// Swinging load, between a quarter and all: numbers of cells that are linearly stable at every load, at
  /// the smallest only, and at none; and for each the number that settle.
  std::uint64_t always = 0, always_settle = 0, partly = 0, partly_settle = 0, never = 0, never_settle = 0;
};

/// Stopping distance from sliding over the true one.
struct StopRow {
  double k = 0.0, slide = 0.0;  ///< slide: true distance in mean snap lengths
  Scheme scheme = Scheme::semi_implicit;
  double ratio = 0.0;
};

/// Creep of a rigid block on four patches on a slope, two thirds of the way to sliding.
struct RestRow {
  Scheme scheme = Scheme::predictor;
  double seconds = 0.0;         ///< s, simulated time
  double first_second_m = 0.0;  ///< m, motion in the first second, while it settles
  double creep_m = 0.0;         ///< m, creep after the first second
  double creep_over_snap_length = 0.0;
};

/// Result for a stiff or soft material, in SI units.
struct CaseRow {
  std::string name;
  LoopSetup setup;
  std::vector<double> start_velocities;
  std::vector<LoopResult> results;
};

/// Device damping that compensates a force applied one step late, over K T; measured on a sticking patch
/// moved to and fro.
struct LateRow {
  const char* force = "";
  double damping_over_kt = 0.0;
};

/// Error of the car's final speed against rolling without slip, m/s, and the largest energy gained in a step,
/// J.
struct WheelResult {
  double speed_error = 0.0, gained_j = 0.0;
};
/// Set-up and results of a car on one wheel, a bed, that rolls up a slope and back.
struct WheelRow {
  double slip_stiffness = 0.0;  ///< N
  double inertia = 0.0;         ///< kg m^2
  double dt_s = 0.0;
  double k = 0.0;              ///< K T^2 (1/m + r^2/I), K of the bed where it sticks
  WheelResult midpoint, held;  ///< solved for the mean force; the last step's end force held over the step
};

struct StabilityResult {
  std::vector<double> ks, seconds;
  std::vector<SchemeMap> maps;
  std::vector<VariedMap> varied;
  std::vector<StopRow> stops;
  std::vector<RestRow> rests;
  std::vector<CaseRow> cases;
  std::vector<LateRow> late;
  std::vector<PullRow> pulled;
  std::vector<WheelRow> wheels;
  double seconds_taken = 0.0;
};

const std::vector<Scheme>& mapped_schemes();
/// Returns the set-up of one cell; `sliding` starts it in steady sliding.
LoopSetup cell_setup(Scheme scheme, double k, double second, bool sliding, const StabilityOptions& options);
/// Runs the single cases. In cases.cpp.
std::vector<CaseRow> stability_cases();
std::vector<StopRow> stopping_distances();
double late_force_damping(bool mean);
RestRow rest_on_slope(Scheme scheme, double seconds,
                      bristle::Population population = bristle::Population::representatives);
/// Returns the set-ups of a wheel; run_wheel fills in the results. In wheels.cpp.
std::vector<WheelRow> wheel_rows();
void run_wheel(WheelRow& row);
/// Returns the report as text. In report.cpp.
std::string stability_table(const StabilityOptions& options, const StabilityResult& result);
std::string stability_json(const StabilityOptions& options, const StabilityResult& result);
std::string stability_csv(const StabilityResult& result);

/// Runs the subcommand. Throws UserError.
void stability_command(const StabilityOptions& options);

}  // namespace cli
