// One patch of the infinite brush and its friction in closed form, for the tests of that model.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "scenes.hpp"

namespace bristle_test {

constexpr double load_n = 1000.0;
inline const SnapLength lognormal = SnapLength::lognormal(dbar, 0.3);

/// Residual length (mean snap lengths) and shared renewal kappa of a material.
struct Rubbing {
  double residual, renewal;
};
inline Material with_rubbing(const SnapLength& law, const Rubbing& r) {
  return plain_material(law, SnapRule::redraw)
      .with_residual_length(r.residual * dbar)
      .with_shared_renewal(r.renewal);
}

inline PatchOptions infinite_options(double resolution = 0.0, int axes = 2) {
  return PatchOptions{}
      .with_max_normal_load(load_n)
      .with_axes(axes)
      .with_outputs(Outputs::all)
      .with_population(bristle::Population::infinite)
      .with_precision(precisions().back())
      .with_resolution(resolution);
}

/// Returns the mean deflection of the paper's brush in steady sliding, m2 / (2 m1) of the law, in `dbar`.
inline double kinetic(const SnapLength& law) { return law.moment(2) / (2.0 * law.mean()) / dbar; }

/// Returns the mean deflection in steady sliding with shared renewal kappa, mean snap lengths of `dbar`: int
/// r T dr / int T dr with T = S(r) exp(-kappa nu r), nu from (1 + kappa) nu int T dr = 1. Midpoint rule and
/// bisection.
inline double steady_deflection(const SnapLength& law, double kappa) {
  constexpr int parts = 100000;
  const double width = law.longest() / parts;
  std::vector<double> survival(parts);
  for (int i = 0; i < parts; ++i) survival[static_cast<std::size_t>(i)] = law.survival((i + 0.5) * width);
  double low = 0.0, high = 20.0 / law.mean(), along = 0.0, whole = 0.0;
  for (int pass = 0; pass < 60; ++pass) {
    const double nu = 0.5 * (low + high);
    along = whole = 0.0;
    for (int i = 0; i < parts; ++i) {
      const double r = (i + 0.5) * width,
                   left = survival[static_cast<std::size_t>(i)] * std::exp(-kappa * nu * r);
      along += r * left * width;
      whole += left * width;
    }
    ((1.0 + kappa) * nu * whole > 1.0 ? high : low) = nu;
    if (kappa == 0.0) break;
  }
  return along / whole / dbar;
}

/// A patch of the infinite brush that checks the energy balance of every step. Lengths in mean snap lengths,
/// forces over load, so that with plain_material the force is the mean deflection.
struct Brush {
  explicit Brush(const Material& material, const PatchOptions& options = infinite_options(),
                 const BatchOptions& batch = {})
      : patch(material, options, batch) {}
  explicit Brush(const SnapLength& law, const PatchOptions& options = infinite_options(),
                 const BatchOptions& batch = {})
      : Brush(plain_material(law, SnapRule::redraw), options, batch) {}

  void step(double dx, double dy = 0.0, double seconds = tick) {
    const double before = patch.energy();
    response = patch.step(dx * dbar, dy * dbar, load, seconds);
    const double work = -(response.mean[0] * dx + response.mean[1] * dy) * dbar;
    const double after = patch.energy();
    const double error = work - (after - before) - response.dissipated - response.contact_loss;
    imbalance = std::max(imbalance, std::abs(error) / (std::abs(work) + before + after + 1e-30));
    most_negative = std::min(most_negative, response.dissipated);
  }
  double x() const { return -response.elastic[0] / (load * dbar); }
  double y() const { return -response.elastic[1] / (load * dbar); }

  OnePatch patch;
  Response response;
  double load = load_n;
  double imbalance = 0.0, most_negative = 0.0;
};

}  // namespace bristle_test
