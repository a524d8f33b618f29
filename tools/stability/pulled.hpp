// Pulls a mass slowly by a spring over an ageing contact: on a stiff spring the mass slides steadily, on a
// soft one it sticks and slips. Finds the critical stiffness between, by linear theory and by simulation.
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
  double speed_m_per_s = 1e-5;  ///< m/s, speed of the spring's pulled end
  double mass_kg = 1.0;
  double dt_s = 1e-3;
};

/// Returns the complex force per displacement (N/m) of a contact in steady sliding, for a disturbance exp(p
/// t). Without dampers; for the rule redraw without shared renewal (core/MODEL.md, "Ageing").
std::complex<double> sliding_stiffness(const SpringPull& pull, std::complex<double> p);
/// Returns the stiffness of the contact when all its bristles stick, N/m.
double contact_stiffness(const SpringPull& pull);
/// Returns the change of force per speed, N s/m, by dampers, viscous friction and strengthening with speed.
double sliding_damping(const SpringPull& pull);
/// Returns the critical stiffness of the spring by linear theory, N/m. Steady sliding is stable on stiffer
/// springs; 0 means on all springs, infinite on none.
double critical_stiffness(const SpringPull& pull);

/// Result of steady sliding that was disturbed by a push.
struct PullResult {
  double growth = 0.0;   ///< ln of the late over the early amplitude of the speed
  double slowest = 0.0;  ///< lowest speed of the mass over that of the pull; at or below 0: stick-slip
  double fastest = 0.0;
  double highest_force = 0.0, lowest_force = 0.0;  ///< N, spring force in the second half of the run
  double energy_error = 0.0;  ///< J, largest gain of energy in a step beyond the spring's work in that step
  double work = 0.0;          ///< J, work that the spring has done
};
/// Simulates a pull. `push` is the extra stretch of the spring at the start, `lengths` the distance that its
/// end moves, both in mean snap lengths.
PullResult run_pull(const SpringPull& pull, Scheme scheme, double stiffness_n_per_m, double push,
                    double lengths);

struct PullRow {
  SpringPull pull;
  Scheme scheme = Scheme::predictor;
  double theory = 0.0, measured = 0.0;  ///< N/m, critical stiffness
  PullResult soft;                      ///< simulation on a spring of a quarter of the critical stiffness
};
std::vector<SpringPull> pulls();
PullRow pull_row(const SpringPull& pull, Scheme scheme);

}  // namespace cli
