// Pulls a mass slowly by a spring over an ageing contact: on a stiff spring it slides steadily, on a soft one
// it sticks and slips. Gives the critical stiffness by linear theory and by simulation.
#pragma once

#include <complex>
#include <string>
#include <vector>

#include <bristle/material.hpp>
#include <bristle/patch.hpp>

#include "tools/stability/loop.hpp"

namespace cli {

struct SpringPull {
  std::string name;
  bristle::Material material;
  double load_n = 10.0;
  double speed_m_per_s = 1e-5;  ///< speed of the spring's far end
  double mass_kg = 1.0;
  double dt_s = 1e-3;
};

/// Returns the force per displacement (N/m) of a contact in steady sliding whose motion is disturbed as exp(p
/// t), without dampers, for redraw without shared renewal (core/MODEL.md, "Ageing").
std::complex<double> sliding_stiffness(const SpringPull& pull, std::complex<double> p);
/// Returns the stiffness of a contact that sticks, N/m.
double contact_stiffness(const SpringPull& pull);
/// Returns the slope of force over speed by dampers, viscous friction and strengthening, N s/m.
double sliding_damping(const SpringPull& pull);
/// Returns the critical stiffness of the spring, N/m, above which steady sliding is stable; 0 if it is stable
/// on every spring, infinite if on none.
double critical_stiffness(const SpringPull& pull);

/// Result of steady sliding after a push.
struct PullResult {
  double growth = 0.0;   ///< ln of the amplitude of the speed, late in the run over early
  double slowest = 0.0;  ///< least speed over that of the pull; 0 or below: it sticks
  double fastest = 0.0;
  double highest_force = 0.0, lowest_force = 0.0;  ///< N, spring force in the last half of the run
  double energy_error = 0.0;  ///< J, largest gain of kinetic and stored energy beyond the work of the spring
  double work = 0.0;          ///< J, work of the spring
};
/// Runs a pull. `push` is the extra stretch of the spring at the start, and `lengths` the distance that its
/// end moves, both in mean snap lengths.
PullResult run_pull(const SpringPull& pull, Scheme scheme, double stiffness_n_per_m, double push,
                    double lengths);

struct PullRow {
  SpringPull pull;
  Scheme scheme = Scheme::predictor;
  double theory = 0.0, measured = 0.0;  ///< critical stiffness, N/m
  PullResult soft;                      ///< result on a spring of a quarter of the critical stiffness
};
std::vector<SpringPull> pulls();
PullRow pull_row(const SpringPull& pull, Scheme scheme);

}  // namespace cli
