// Runs a mass on one friction patch in closed loop, and the same loop on a linear spring and damper.
#pragma once

#include <cstdint>
#include <vector>

#include <bristle/material.hpp>
#include <bristle/patch.hpp>

namespace cli {

/// Scheme that couples force and motion from one sample to the next.
enum class Scheme {
  explicit_euler,  ///< explicit Euler: position from the old velocity, velocity from the old force
  /// semi-implicit: velocity from the old force, position from the new velocity; end force
  semi_implicit,
  semi_implicit_mean,  ///< scheme semi_implicit with the mean force
  predictor,           ///< bristle::predict_displacements
  midpoint,            ///< bristle::solve_displacements
  linear_always,       ///< implicit Euler with constant stiffness and no force limit, for comparison
  hold,                ///< zero-order hold: end force held over the next step; damper by true velocity
  hold_difference,     ///< scheme hold with the damper by the difference of the last two positions
  device,              ///< zero-order hold with damping b of the device, end force, and an encoder
  device_mean          ///< scheme device with the mean force and no encoder
};
const char* to_string(Scheme scheme) noexcept;
/// Returns the linear condition as text, with k = K T^2/m, c = C T/m, beta = b T/m.
const char* linear_condition(Scheme scheme) noexcept;
/// Returns whether the second axis of the scheme's map is beta rather than c.
constexpr bool is_device(Scheme scheme) noexcept {
  return scheme == Scheme::device || scheme == Scheme::device_mean;
}
constexpr bool uses_mean(Scheme scheme) noexcept {
  return scheme == Scheme::semi_implicit_mean || scheme == Scheme::midpoint || scheme == Scheme::device_mean;
}
/// Returns whether the scheme is implicit, and so always stable on a linear spring and damper.
constexpr bool is_implicit(Scheme scheme) noexcept {
  return scheme == Scheme::predictor || scheme == Scheme::midpoint || scheme == Scheme::linear_always;
}

/// Returns the spectral radius of the loop on a spring and damper: below 1 it is stable. Not for the implicit
/// schemes.
double linear_radius(Scheme scheme, double k, double c, double beta);
/// Returns the spectral radius of the velocity in sliding, where friction is constant and only damper and
/// mass act.
double sliding_radius(Scheme scheme, double c, double beta);
/// Returns whether the linear loop is stable. Implicit schemes always are.
bool linearly_stable(Scheme scheme, double k, double c, double beta);
/// Returns the k between 1e-4 and 1e3 at which the linear loop turns stable or unstable, ascending.
std::vector<double> stability_limits(Scheme scheme, double c, double beta);

/// Set-up of a run.
struct LoopSetup {
  Scheme scheme = Scheme::semi_implicit;
  double mass_kg = 0.1;
  double dt_s = 1e-3;
  double stiffness = 0.0;           ///< K, N/m, at the largest load
  double damping = 0.0;             ///< C, N s/m, of all bristles at rest, at the largest load
  double stribeck_velocity = 1e12;  ///< m/s, speed at which the damper decays; the default means never
  double device_damping = 0.0;      ///< b, N s/m
  double quantum_m = 0.0;           ///< m, count of the encoder; 0 = none
  double mean_snap_length = 1e-5;   ///< m; snap lengths are uniform, 0.5 to 1.5 of it
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  std::uint32_t bristles = 300;
  double start_velocity = 0.0;  ///< m/s, initial velocity along the first axis
  bool sliding = false;         ///< starts in steady sliding instead of with all deflections zero
  int axes = 1;
  /// Two axes: pushed sideways to the start velocity after a quarter of the run.
  bool turn = false;
  double smallest_load = 1.0;       ///< share of the largest load down to which the load swings; 1 = constant
  std::uint64_t steps = 8000;       ///< number of steps in all 4 quarters of the run
  std::uint64_t load_period = 500;  ///< steps
  bool stop_early = true;           ///< stops once at rest or without bound
  bristle::Population population = bristle::Population::representatives;
};

enum class Verdict {
  settles,  ///< the amplitude falls, or is negligible
  grows,    ///< the amplitude rises without snaps so far, or rises without bound
  rings     ///< bristles keep snapping at a lasting amplitude
};
const char* to_string(Verdict verdict) noexcept;

struct LoopResult {
  Verdict verdict = Verdict::settles;
  bool unbounded = false;
  /// m, peak-to-peak motion in the last quarter, on the axis where it is larger
  double peak_to_peak_m = 0.0;
  double highest_speed = 0.0;  ///< m/s, highest speed in the last quarter
  double energy_ratio = 0.0;   ///< highest energy of the last quarter over that of the quarter before
  double distance_m = 0.0;     ///< m, farthest distance along the first axis
};

/// Runs the loop. Throws bristle::Error on parameters that the library refuses.
LoopResult run_loop(const LoopSetup& setup);

}  // namespace cli
