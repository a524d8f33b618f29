// One patch of the infinite brush, for the tests that are about it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "scenes.hpp"

namespace bristle_test {

constexpr double load_n = 1000.0;

inline PatchOptions infinite_options(double resolution = 0.0, std::uint32_t cohorts = 0, int axes = 2) {
  return PatchOptions{}
      .with_max_normal_load(load_n)
      .with_axes(axes)
      .with_outputs(Outputs::all)
      .with_population(bristle::Population::infinite)
      .with_resolution(resolution)
      .with_cohorts(cohorts);
}

/// Mean deflection of the paper's brush in steady sliding, mean snap lengths.
inline double kinetic(const SnapLength& law) { return law.moment(2) / (2.0 * law.mean()) / dbar; }

/// A patch that checks the energy of every step. Lengths in mean snap lengths, forces over load: with
/// plain_material the mean deflection.
struct Brush {
  explicit Brush(const Material& material, const PatchOptions& options = infinite_options(),
                 const BatchOptions& batch = {})
      : patch(material, options, batch) {}
  explicit Brush(const SnapLength& law, const PatchOptions& options = infinite_options(),
                 const BatchOptions& batch = {})
      : Brush(plain_material(law, SnapRule::redraw), options, batch) {}

  void step(double dx, double dy = 0.0) {
    const double before = patch.energy();
    response = patch.step(dx * dbar, dy * dbar, load);
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
