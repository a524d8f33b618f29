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
  std::string csv;   ///< file for the stability map, which tools/plots/stability.gp draws; empty: none

  /// Representatives or the infinite brush, in the maps and on the slope.
  bristle::Population population = bristle::Population::representatives;
  bristle::SnapRule rule = bristle::SnapRule::redraw;  ///< in the maps, on the slope and while stopping
};

/// Reason why the simulation of a cell and linear theory give different verdicts.
enum class Why {
  agree,
  at_the_limit,       ///< the amplitude changes by less than 5 % in a quarter of the run
  damper_in_sliding,  ///< stable in sticking; in sliding damper and mass alone are unstable
  after_sliding,      ///< settles if started sticking, but snaps on if started sliding
  encoder,            ///< the steps of the encoder keep exciting the motion
  snaps_damp,         ///< unstable in sticking, but snaps remove the energy that a step adds
  other
};
const char* to_string(Why why) noexcept;

struct MapCell {
  double k = 0.0;       ///< K T^2/m: stiffness, step, mass
  double second = 0.0;  ///< damping of the patch, C T/m, or for a device its own damping, b T/m
  bool linear_stable = false;
  LoopResult sticking, sliding;        ///< runs started by a small push while sticking, and in steady sliding
  Verdict verdict = Verdict::settles;  ///< the worse verdict of both runs
  bool unbounded = false;
  Why why = Why::agree;
};

struct SchemeMap {
  Scheme scheme = Scheme::semi_implicit;
  std::vector<MapCell> cells;
  std::uint64_t agreeing() const;
};

/// Coarse stability map with two axes, or with a swinging load.
struct VariedMap {
  Scheme scheme = Scheme::semi_implicit;
  /// Map with two axes, where the motion turns while sliding: number of cells, and of those with the verdict
  /// of linear theory.
  std::uint64_t turned = 0, turned_agree = 0;
  /// Map with a load that swings between a quarter and all. Numbers of cells that linear theory calls stable
  /// at every load, at the smallest load only, and at none; and how many of each settle.
  std::uint64_t always = 0, always_settle = 0, partly = 0, partly_settle = 0, never = 0, never_settle = 0;
};

/// Stopping distance from steady sliding: the ratio of the simulated one to the true one.
struct StopRow {
  double k = 0.0, slide = 0.0;  ///< K T^2/m; true distance, in mean snap lengths
  Scheme scheme = Scheme::semi_implicit;
  double ratio = 0.0;
};

/// Creep of a rigid block that rests with four patches on a slope, at two thirds of the slope on which it
/// slides.
struct RestRow {
  Scheme scheme = Scheme::predictor;
  double seconds = 0.0;         ///< s, simulated time
  double first_second_m = 0.0;  ///< m, motion in the first second, while the block settles
  double creep_m = 0.0;         ///< m, motion after the first second
  double creep_over_snap_length = 0.0;
};

/// Result of one run with a stiff or a soft material, in SI units.
struct CaseRow {
  std::string name;
  LoopSetup setup;
  std::vector<double> start_velocities;
  std::vector<LoopResult> results;
};

/// Device damping b that compensates a force applied one step late, as b / (K T) (K stiffness, T step).
/// Measured on a sticking patch moved to and fro.
struct LateRow {
  const char* force = "";
  double damping_over_kt = 0.0;
};

/// Errors of a simulated car: its final speed minus that of rolling without slip, m/s, and the largest energy
/// gained in a step, J.
struct WheelResult {
  double speed_error = 0.0, gained_j = 0.0;
};
/// Set-up and results of a car on one wheel (a bed of bristles) that rolls up a slope and back.
struct WheelRow {
  double slip_stiffness = 0.0;  ///< N, force per relative slip
  double inertia = 0.0;         ///< kg m^2, of the wheel
  double dt_s = 0.0;
  double k = 0.0;              ///< K T^2 (1/m + r^2/I), with the bed's stiffness K in sticking
  WheelResult midpoint, held;  ///< by midpoint rule, and with the last force held over the step
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
/// Returns the set-up of one cell of a map. `second` is c or beta; with `sliding` the run starts in steady
/// sliding.
LoopSetup cell_setup(Scheme scheme, double k, double second, bool sliding, const StabilityOptions& options);
/// Runs the single cases beside the maps. In cases.cpp.
std::vector<CaseRow> stability_cases();
std::vector<StopRow> stopping_distances(bristle::SnapRule rule);
double late_force_damping(bool mean);
RestRow rest_on_slope(Scheme scheme, double seconds, const StabilityOptions& options = {});
/// Returns the set-ups of cars on a wheel, whose results run_wheel() fills in. In wheels.cpp.
std::vector<WheelRow> wheel_rows();
void run_wheel(WheelRow& row);
/// Returns the report as text. In report.cpp.
std::string stability_table(const StabilityOptions& options, const StabilityResult& result);
std::string stability_json(const StabilityOptions& options, const StabilityResult& result);
std::string stability_csv(const StabilityResult& result);

/// Runs the subcommand. Throws UserError.
void stability_command(const StabilityOptions& options);

}  // namespace cli
