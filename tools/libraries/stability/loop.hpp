// Simulates a mass on one friction patch in a closed loop: friction moves the mass and the mass moves the
// patch. Also gives the linear theory of that loop, in which a spring and damper replace the patch.
#pragma once

#include <cstdint>

#include <bristle/material.hpp>
#include <bristle/patch.hpp>

namespace cli {

/// Integration scheme: how force and motion are coupled from one time step to the next. "End force" means the
/// friction at the end of a step, "mean force" its average over the step.
enum class Scheme {
  explicit_euler,  ///< explicit Euler: position from the old velocity, velocity from the old force

  /// Computes the velocity from the end force of the last step, then the position from the new velocity.
  semi_implicit,
  semi_implicit_mean,  ///< as semi_implicit (velocity first), but with the step's mean force
  predictor,           ///< bristle::predict_displacements
  midpoint,            ///< bristle::solve_displacements
  linear_always,       ///< implicit Euler with a constant stiffness, without a limit of force
  hold,                ///< end force held over the next step; damping force from the true velocity
  hold_difference,     ///< end force held over the next step; damping force from two positions
  device,              ///< end force held over the next step by a device with damping b and an encoder
  device_mean          ///< device with mean force held over the next step, without encoder
};
const char* to_string(Scheme scheme) noexcept;
/// Returns the condition for stability on a linear spring and damper, as text in k = K T^2/m, c = C T/m and
/// beta = b T/m (stiffness K, damping C, device damping b, time step T, mass m).
const char* linear_condition(Scheme scheme) noexcept;
/// Returns whether the scheme has a damper in the haptic device. The second axis of its map is then the
/// device's damping beta instead of the patch's damping c.
constexpr bool is_device(Scheme scheme) noexcept {
  return scheme == Scheme::device || scheme == Scheme::device_mean;
}
constexpr bool uses_mean(Scheme scheme) noexcept {
  return scheme == Scheme::semi_implicit_mean || scheme == Scheme::midpoint || scheme == Scheme::device_mean;
}
/// Returns whether a scheme is implicit, and so stable on every linear spring and damper.
constexpr bool is_implicit(Scheme scheme) noexcept {
  return scheme == Scheme::predictor || scheme == Scheme::midpoint || scheme == Scheme::linear_always;
}

/// Returns the spectral radius of the loop with a linear spring and damper. Below 1 the loop is stable. For
/// explicit schemes only.
double linear_radius(Scheme scheme, double k, double c, double beta);
/// Returns the spectral radius of the loop in sliding, where friction is constant and only dampers change the
/// velocity.
double sliding_radius(Scheme scheme, double c, double beta);
/// Returns whether the loop with a linear spring and damper is stable. With implicit schemes it always is.
bool linearly_stable(Scheme scheme, double k, double c, double beta);
/// Parameters of a simulation of a mass on a friction patch.
struct LoopSetup {
  Scheme scheme = Scheme::semi_implicit;
  double mass_kg = 0.1;
  double dt_s = 1e-3;
  double stiffness = 0.0;           ///< stiffness K of all bristles at the largest load, N/m
  double damping = 0.0;             ///< damping C of the bristles at rest and largest load, N s/m
  double stribeck_velocity = 1e12;  ///< speed over which the bristles' damping fades, m/s; default: never
  double device_damping = 0.0;      ///< damping b of the device, N s/m
  double quantum_m = 0.0;           ///< count of the encoder, m; 0: exact positions
  double mean_snap_length = 1e-5;   ///< mean snap length, m; lengths are uniform from 0.5 to 1.5 means
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  std::uint32_t bristles = 300;
  double start_velocity = 0.0;  ///< initial velocity along the first axis, m/s
  bool sliding = false;         ///< whether the run starts in steady sliding; if not, with straight bristles
  int axes = 1;
  /// Whether the mass gets the start velocity sideways, too, after a quarter of the run (with two axes).
  bool turn = false;
  double smallest_load = 1.0;       ///< lowest load over largest load; 1: constant load
  std::uint64_t steps = 8000;       ///< number of time steps of the whole run
  std::uint64_t load_period = 500;  ///< number of steps in one swing of the load
  bool stop_early = true;           ///< whether the run ends once the mass rests or its motion is unbounded
  bristle::Population population = bristle::Population::representatives;

  /// Returns the friction force of steady sliding at the largest load, without dampers, N.
  double kinetic_n() const noexcept;
};

enum class Verdict {
  settles,  ///< the motion dies away or is negligible
  grows,    ///< the motion grows, up to now without snaps, or without bound
  rings     ///< bristles keep snapping, and the motion keeps its amplitude
};
const char* to_string(Verdict verdict) noexcept;

struct LoopResult {
  Verdict verdict = Verdict::settles;
  bool unbounded = false;
  /// Peak-to-peak motion in the last quarter of the run, m, on the axis on which it is larger.
  double peak_to_peak_m = 0.0;
  double highest_speed = 0.0;  ///< highest speed in the last quarter of the run, m/s
  /// Highest energy in the last quarter of the run over that in the third quarter. It tells whether motion
  /// dies out.
  double energy_ratio = 0.0;
  double distance_m = 0.0;  ///< largest distance from the start along the first axis, m
};

/// Simulates the mass on the patch. Throws bristle::Error on parameters that the library refuses.
LoopResult run_loop(const LoopSetup& setup);

}  // namespace cli
