// A mass on one friction patch in closed loop, and the same loop on a linear spring and damper.
#pragma once

#include <cstdint>
#include <vector>

#include <bristle/material.hpp>
#include <bristle/patch.hpp>

namespace cli {

/// Coupling of force and motion from one sample to the next.
enum class Scheme {
  explicit_euler,      ///< position from the old velocity, velocity from the old force
  semi_implicit,       ///< velocity from the old force, position from the new velocity; end force
  semi_implicit_mean,  ///< the same with the mean force
  predictor,           ///< bristle::predict_displacements
  midpoint,            ///< bristle::solve_displacements
  linear_always,       ///< implicit Euler with stiffness always on and no limit: for comparison
  hold,                ///< zero-order hold: end force held over the next step; damper by true velocity
  hold_difference,     ///< the same, damper by the difference of the last two positions
  device,              ///< zero-order hold, damping b of the device, end force, encoder of a quantum
  device_mean          ///< the same with the mean force and no quantum
};
const char* to_string(Scheme scheme) noexcept;
/// The linear condition as text, with k = K T^2/m, c = C T/m, beta = b T/m.
const char* linear_condition(Scheme scheme) noexcept;
/// Whether the second axis of its map is beta rather than c.
constexpr bool is_device(Scheme scheme) noexcept {
  return scheme == Scheme::device || scheme == Scheme::device_mean;
}
constexpr bool uses_mean(Scheme scheme) noexcept {
  return scheme == Scheme::semi_implicit_mean || scheme == Scheme::midpoint || scheme == Scheme::device_mean;
}
/// Always stable on a linear spring and damper.
constexpr bool is_implicit(Scheme scheme) noexcept {
  return scheme == Scheme::predictor || scheme == Scheme::midpoint || scheme == Scheme::linear_always;
}

/// Largest modulus of the eigenvalues of the loop on a spring and damper: below 1 it is stable. Not for the
/// implicit schemes.
double linear_radius(Scheme scheme, double k, double c, double beta);
/// Spectral radius of the velocity in sliding, where friction is constant and only damper and mass are left.
double sliding_radius(Scheme scheme, double c, double beta);
/// Whether the linear loop is stable. The implicit schemes are.
bool linearly_stable(Scheme scheme, double k, double c, double beta);
/// The k between 1e-4 and 1e3 at which the linear loop turns stable or unstable, ascending.
std::vector<double> stability_limits(Scheme scheme, double c, double beta);

/// Set-up of a run.
struct LoopSetup {
  Scheme scheme = Scheme::semi_implicit;
  double mass_kg = 0.1;
  double dt_s = 1e-3;
  double stiffness = 0.0;           ///< K, N/m, at the largest load
  double damping = 0.0;             ///< C, N s/m, of all bristles at rest at that load
  double stribeck_velocity = 1e12;  ///< m/s: no decay
  double device_damping = 0.0;      ///< b, N s/m
  double quantum_m = 0.0;           ///< of the encoder; 0 = none
  double mean_snap_length = 1e-5;   ///< m; snap lengths uniform, 0.5 to 1.5 of it
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  std::uint32_t bristles = 300;
  double start_velocity = 0.0;  ///< m/s, along the first axis
  bool sliding = false;         ///< the brush starts in steady sliding, else with all deflections zero
  int axes = 1;
  bool turn = false;                ///< two axes: pushed sideways to the start velocity after a quarter
  double smallest_load = 1.0;       ///< of the largest: the load swings between, 1 = constant
  std::uint64_t steps = 8000;       ///< of 4 quarters
  std::uint64_t load_period = 500;  ///< steps
  bool stop_early = true;           ///< once at rest, or once without bound
  bristle::Population population = bristle::Population::representatives;
};

enum class Verdict {
  settles,  ///< the amplitude falls, or is nothing
  grows,    ///< the amplitude rises and nothing snaps yet, or rises without bound
  rings     ///< bristles keep snapping at a lasting amplitude
};
const char* to_string(Verdict verdict) noexcept;

struct LoopResult {
  Verdict verdict = Verdict::settles;
  bool unbounded = false;
  double peak_to_peak_m = 0.0;  ///< of the last quarter, the longer axis
  double highest_speed = 0.0;   ///< m/s, of the last quarter
  double energy_ratio = 0.0;    ///< highest energy of the last quarter over that of the quarter before
  double distance_m = 0.0;      ///< the farthest along the first axis
};

/// Steps the loop. Throws bristle::Error on parameters that the library refuses.
LoopResult run_loop(const LoopSetup& setup);

}  // namespace cli
