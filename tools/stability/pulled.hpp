// A mass on a spring that is pulled slowly over a contact that ages: it slides steadily on a stiff spring and
// sticks and slips on a soft one. The critical stiffness by linear theory, and where the loop turns.
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
  double speed_m_per_s = 1e-5;  ///< of the spring's far end
  double mass_kg = 1.0;
  double dt_s = 1e-3;
};

/// The force per displacement of a contact in steady sliding whose motion is disturbed as exp(p t), N/m,
/// dampers left out: redraw without shared renewal (core/MODEL.md, "Ageing").
std::complex<double> sliding_stiffness(const SpringPull& pull, std::complex<double> p);
/// Stiffness of a contact that sticks, N/m.
double contact_stiffness(const SpringPull& pull);
/// Change of force with speed by dampers, lubricant and strengthening, N s/m.
double sliding_damping(const SpringPull& pull);
/// Stiffness of the spring, N/m, above which steady sliding is stable; 0 if it is stable on every spring, and
/// infinite if on none.
double critical_stiffness(const SpringPull& pull);

/// Course of steady sliding after a push.
struct PullResult {
  double growth = 0.0;   ///< ln of the amplitude of the speed, late in the run over early
  double slowest = 0.0;  ///< speed over that of the pull: 0 and below = it sticks
  double fastest = 0.0;
  double highest_force = 0.0, lowest_force = 0.0;  ///< N, of the spring, in the last half of the run
  double energy_error = 0.0;  ///< largest rise of kinetic and stored energy beyond the work of the spring, J
  double work = 0.0;          ///< of the spring, J
};
/// `push`: how much farther than in steady sliding the spring is stretched at the start, and `lengths`: the
/// way of its end, both in mean snap lengths.
PullResult run_pull(const SpringPull& pull, Scheme scheme, double stiffness_n_per_m, double push,
                    double lengths);

struct PullRow {
  SpringPull pull;
  Scheme scheme = Scheme::predictor;
  double theory = 0.0, measured = 0.0;  ///< critical stiffness, N/m
  PullResult soft;                      ///< on a spring of a quarter of it
};
std::vector<SpringPull> pulls();
PullRow pull_row(const SpringPull& pull, Scheme scheme);

}  // namespace cli
