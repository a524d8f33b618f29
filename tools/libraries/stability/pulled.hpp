// Simulates a mass that a spring pulls slowly over an ageing contact. On a stiff spring it slides steadily,
// on a soft one it sticks and slips. Finds the critical stiffness by linear theory and by simulation.
#pragma once

#include <complex>
#include <string>
#include <vector>

#include <bristle/material.hpp>

#include "tools/libraries/stability/loop.hpp"

namespace cli {

struct SpringPull {
  std::string name;
  bristle::Material material;
  double load_n = 10.0;
  double speed_m_per_s = 1e-5;  ///< speed of the spring's pulled end, m/s
  double mass_kg = 1.0;
  double dt_s = 1e-3;
};

/// Returns the complex force per displacement (N/m) with which a steadily sliding contact answers a
/// disturbance exp(p t). Without dampers; for the rule redraw without shared renewal (core/MODEL.md,
/// "Ageing").
std::complex<double> sliding_stiffness(const SpringPull& pull, std::complex<double> p);
/// Returns the stiffness (N/m) of the contact while all its bristles stick.
double contact_stiffness(const SpringPull& pull);
/// Returns the derivative of friction by speed (N s/m) that dampers, lubricant and strengthening with speed
/// cause.
double sliding_damping(const SpringPull& pull);
/// Returns the critical stiffness (N/m) of the spring by linear theory: steady sliding is stable on stiffer
/// springs. 0 means stable on all springs, infinite on none.
double critical_stiffness(const SpringPull& pull);

/// Result of a simulation in which steady sliding was disturbed by a push.
struct PullResult {
  double growth = 0.0;   ///< ln of the speed's late amplitude over its early one
  double slowest = 0.0;  ///< lowest speed of the mass over the pull's; 0 or less means stick-slip
  double fastest = 0.0;
  double highest_force = 0.0, lowest_force = 0.0;  ///< range of the spring's force in the second half, N
  double energy_error = 0.0;  ///< largest gain of energy in a step beyond the spring's work, J
  double work = 0.0;          ///< work done by the spring, J
};
/// Simulates a slow pull. `push` is the spring's extra stretch at the start and `lengths` the distance that
/// its end moves, both in mean snap lengths.
PullResult run_pull(const SpringPull& pull, Scheme scheme, double stiffness_n_per_m, double push,
                    double lengths);

struct PullRow {
  SpringPull pull;
  Scheme scheme = Scheme::predictor;
  double theory = 0.0, measured = 0.0;  ///< critical stiffness by theory and by simulation, N/m
  PullResult soft;                      ///< simulation on a spring with a quarter of the critical stiffness
};
std::vector<SpringPull> pulls();
PullRow pull_row(const SpringPull& pull, Scheme scheme);

}  // namespace cli
