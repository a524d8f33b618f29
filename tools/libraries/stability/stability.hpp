// Compares simulations of a mass on a friction patch with the stability limits of linear theory: the command
// `bristle stability`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/libraries/stability/loop.hpp"
#include "tools/libraries/stability/pulled.hpp"

namespace cli {

struct StabilityOptions {
  bool quick = false;
  int threads = 0;   ///< number of threads that run cases; 0: one per core
  std::string json;  ///< JSON report to write; empty: none, "-": stdout
  std::string csv;   ///< CSV file of the maps, which tools/plots/stability.gp plots; empty: none

  /// Kind of brush in the maps and on the slope (representatives or the infinite brush).
  bristle::Population population = bristle::Population::representatives;
  bristle::SnapRule rule = bristle::SnapRule::redraw;  ///< snap rule of maps, rest on the slope, and stopping
};

/// Reason why a cell's simulation and linear theory give different verdicts on stability.
enum class Why {
  agree,
  at_the_limit,       ///< amplitude changes by less than 5 % in a quarter of the run
  damper_in_sliding,  ///< stable in sticking, but damper and mass alone are unstable in sliding
  after_sliding,      ///< settles if started in sticking, keeps snapping if started in sliding
  encoder,            ///< counts of the encoder keep exciting the motion
  snaps_damp,         ///< unstable in sticking, but snaps remove the energy that a step adds
  other
};
const char* to_string(Why why) noexcept;

struct MapCell {
  double k = 0.0;       ///< dimensionless stiffness K T^2/m (time step T, mass m)
  double second = 0.0;  ///< dimensionless damping: C T/m of the patch or, for a device, its own b T/m
  bool linear_stable = false;
  LoopResult sticking, sliding;        ///< results of a run begun by a small push in sticking, and in sliding
  Verdict verdict = Verdict::settles;  ///< the worse verdict of the two runs: settles, rings, grows
  bool unbounded = false;
  Why why = Why::agree;
};

/// Returns why the simulated verdicts of a cell differ from linear theory. `steps`: number of steps of a run.
Why why_of(const MapCell& cell, Scheme scheme, double steps);

struct SchemeMap {
  Scheme scheme = Scheme::semi_implicit;
  std::vector<MapCell> cells;
  std::uint64_t agreeing() const;
};

/// Coarse stability map of a scheme with two axes, or with a load that swings.
struct VariedMap {
  Scheme scheme = Scheme::semi_implicit;
  /// Map with two axes, where the motion turns sideways while sliding: number of cells, and number of those
  /// in which simulation and linear theory agree.
  std::uint64_t turned = 0, turned_agree = 0;
  /// Map with a load that swings between a quarter and all of the largest. Counts the cells that linear
  /// theory calls stable at every load, at the smallest load only, and at none, and how many of each settle.
  std::uint64_t always = 0, always_settle = 0, partly = 0, partly_settle = 0, never = 0, never_settle = 0;
};

/// Distance in which steady sliding stops, as simulated over the true distance.
struct StopRow {
  double k = 0.0, slide = 0.0;  ///< dimensionless stiffness K T^2/m; true distance, in mean snap lengths
  Scheme scheme = Scheme::semi_implicit;
  double ratio = 0.0;
};

/// Creep of a rigid block that rests with four patches on a slope. The slope is two thirds as steep as the
/// one on which the block slides.
struct RestRow {
  Scheme scheme = Scheme::predictor;
  double seconds = 0.0;         ///< simulated time of the rest on the slope, s
  double first_second_m = 0.0;  ///< motion down the slope in the first second, while settling, m
  double creep_m = 0.0;         ///< motion down the slope after the first second, m
  double creep_over_snap_length = 0.0;
};

/// Results of simulations with a stiff or a soft material, in SI units.
struct CaseRow {
  std::string name;
  LoopSetup setup;
  std::vector<double> start_velocities;
  std::vector<LoopResult> results;
};

/// Device damping b that absorbs the energy which arises when a force is applied one step late, as b / (K T)
/// (stiffness K, time step T). Measured on a sticking patch moved to and fro.
struct LateRow {
  const char* force = "";
  double damping_over_kt = 0.0;
};

/// Errors of a simulated car: final speed minus that of rolling without slip (m/s), and the largest energy
/// gained in a step (J).
struct WheelResult {
  double speed_error = 0.0, gained_j = 0.0;
};
/// Parameters and results of a car on one wheel that rolls up a slope and back. The contact of the wheel is a
/// bed.
struct WheelRow {
  double slip_stiffness = 0.0;  ///< force per relative slip of the wheel, N
  double inertia = 0.0;         ///< moment of inertia of the wheel, kg m^2
  double dt_s = 0.0;
  double k = 0.0;              ///< dimensionless stiffness K T^2 (1/m + r^2/I) of the sticking bed
  WheelResult midpoint, held;  ///< results by the midpoint rule, and with the last force held
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
/// Returns the parameters of one cell of a map. `second` is the damping c or beta; with `sliding` the run
/// starts in steady sliding.
LoopSetup cell_setup(Scheme scheme, double k, double second, bool sliding, const StabilityOptions& options);
/// Run the single cases that are reported beside the stability maps. These functions are in cases.cpp.
std::vector<CaseRow> stability_cases();
std::vector<StopRow> stopping_distances(bristle::SnapRule rule);
double late_force_damping(bool mean);
RestRow rest_on_slope(Scheme scheme, double seconds, const StabilityOptions& options = {});
/// Returns the parameters of the cars on a wheel, whose results run_wheel() fills in. Defined in wheels.cpp.
std::vector<WheelRow> wheel_rows();
void run_wheel(WheelRow& row);
/// Formats the result of the study of stability. Defined in report.cpp.
std::string stability_table(const StabilityOptions& options, const StabilityResult& result);
std::string stability_json(const StabilityOptions& options, const StabilityResult& result);
std::string stability_csv(const StabilityResult& result);

/// Runs the command `bristle stability`: simulates and writes the reports. Throws UserError.
void stability_command(const StabilityOptions& options);

}  // namespace cli
