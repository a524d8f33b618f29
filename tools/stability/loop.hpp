// Runs a mass on one friction patch in closed loop, where friction moves the mass and the mass moves the
// patch; and the same loop on a linear spring and damper.
#pragma once

#include <cstdint>
#include <vector>

#include <bristle/material.hpp>
#include <bristle/patch.hpp>

namespace cli {

/// Scheme by which force and motion are coupled from one time step to the next. "End force" is the friction
/// at the end of a step, "mean force" its average over the step.
enum class Scheme {
  explicit_euler,  ///< explicit Euler: position from the old velocity, velocity from the old force

  /// Velocity from the old force, position from the new velocity; end force.
  semi_implicit,
  semi_implicit_mean,  ///< as semi_implicit, but with the mean force
  predictor,           ///< bristle::predict_displacements
  midpoint,            ///< bristle::solve_displacements
  linear_always,       ///< implicit Euler with constant stiffness, without force limit
  hold,                ///< end force held over the next step; damper by the true velocity
  hold_difference,     ///< as hold, but with the damper computed from the last two positions
  device,              ///< end force held over the next step, device damping b, encoder
  device_mean          ///< as device, with the mean force and no encoder
};
const char* to_string(Scheme scheme) noexcept;
/// Returns the condition for stability on a linear spring and damper, as text in k = K T^2/m, c = C T/m and
/// beta = b T/m (stiffness K, damping C, device damping b, step T, mass m).
const char* linear_condition(Scheme scheme) noexcept;
/// Returns whether a scheme's stability map has beta (device damping) as second axis, instead of c.
constexpr bool is_device(Scheme scheme) noexcept {
  return scheme == Scheme::device || scheme == Scheme::device_mean;
}
constexpr bool uses_mean(Scheme scheme) noexcept {
  return scheme == Scheme::semi_implicit_mean || scheme == Scheme::midpoint || scheme == Scheme::device_mean;
}
/// Returns whether a scheme is implicit, and so stable on any linear spring and damper.
constexpr bool is_implicit(Scheme scheme) noexcept {
  return scheme == Scheme::predictor || scheme == Scheme::midpoint || scheme == Scheme::linear_always;
}

/// Returns the spectral radius of the loop on a linear spring and damper; the loop is stable below 1. Not for
/// the implicit schemes.
double linear_radius(Scheme scheme, double k, double c, double beta);
/// Returns the spectral radius of the loop in sliding, where friction is constant and only dampers change the
/// velocity.
double sliding_radius(Scheme scheme, double c, double beta);
/// Returns whether the loop on a linear spring and damper is stable; with an implicit scheme it always is.
bool linearly_stable(Scheme scheme, double k, double c, double beta);
/// Returns the values of k between 1e-4 and 1e3 at which the linear loop turns stable or unstable, ascending.
std::vector<double> stability_limits(Scheme scheme, double c, double beta);

/// Set-up of one run of the loop.
struct LoopSetup {
  Scheme scheme = Scheme::semi_implicit;
  double mass_kg = 0.1;
  double dt_s = 1e-3;
  double stiffness = 0.0;           ///< K, N/m, stiffness of all bristles at the largest load
  double damping = 0.0;             ///< C, N s/m, of the bristles' dampers at rest and largest load
  double stribeck_velocity = 1e12;  ///< m/s, speed at which the dampers fade; default: never
  double device_damping = 0.0;      ///< b, N s/m, damping of the device
  double quantum_m = 0.0;           ///< m, step of the encoder; 0: exact positions
  double mean_snap_length = 1e-5;   ///< m, mean snap length; lengths are uniform from 0.5 to 1.5 of it
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  std::uint32_t bristles = 300;
  double start_velocity = 0.0;  ///< m/s, initial velocity along the first axis
  bool sliding = false;         ///< whether the run starts in steady sliding, not with straight bristles
  int axes = 1;
  /// Whether, with two axes, the mass gets the start velocity sideways after a quarter of the run.
  bool turn = false;
  double smallest_load = 1.0;       ///< lowest load over the largest load; 1: constant load
  std::uint64_t steps = 8000;       ///< number of steps of the whole run
  std::uint64_t load_period = 500;  ///< number of steps in a swing of the load
  bool stop_early = true;           ///< whether the run ends early at rest or at unbounded motion
  bristle::Population population = bristle::Population::representatives;

  /// Returns the friction of steady sliding at the largest load, without dampers, N.
  double kinetic_n() const noexcept;
};

enum class Verdict {
  settles,  ///< the motion dies away, or is negligibly small
  grows,    ///< the motion grows, without snaps so far or without bound
  rings     ///< bristles keep snapping, at an amplitude that lasts
};
const char* to_string(Verdict verdict) noexcept;

struct LoopResult {
  Verdict verdict = Verdict::settles;
  bool unbounded = false;
  /// m, peak-to-peak motion in the last quarter of the run, on the axis where it is larger.
  double peak_to_peak_m = 0.0;
  double highest_speed = 0.0;  ///< m/s, highest speed in the last quarter of the run
  double energy_ratio = 0.0;   ///< highest energy in the last quarter of the run over that in the quarter
                               ///< before
  double distance_m = 0.0;     ///< m, largest distance from the start along the first axis
};

/// Runs the loop. Throws bristle::Error on parameters that the library refuses.
LoopResult run_loop(const LoopSetup& setup);

}  // namespace cli
