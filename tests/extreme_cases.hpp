// Kinds of patches for tests of extreme input, and a check that every output of a step is finite.
#pragma once

#include <cmath>

#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test {

/// Checks that every output of a step is finite, and those not negative that cannot be negative.
inline void check_finite(const Response& r) {
  for (int axis = 0; axis < 2; ++axis) {
    expect(std::isfinite(r.end[axis]), "end is finite");
    expect(std::isfinite(r.elastic[axis]), "elastic is finite");
    expect(std::isfinite(r.damper[axis]), "damper is finite");
    expect(std::isfinite(r.mean[axis]), "mean is finite");
  }
  expect(std::isfinite(r.stiffness) && r.stiffness >= 0.0, "stiffness is finite and not negative");
  expect(std::isfinite(r.damping) && r.damping >= 0.0, "damping is finite and not negative");
  expect(std::isfinite(r.force_limit) && r.force_limit >= 0.0, "force limit is finite and not negative");
  expect(std::isfinite(r.dissipated) && r.dissipated >= 0.0, "dissipated is finite and not negative");
  expect(std::isfinite(r.contact_loss), "contact loss is finite");
  expect(std::isfinite(r.damper_work), "damper work is finite");
}

/// A kind of patch: its precision, snap rule and number of axes.
struct Kind {
  Precision precision;
  SnapRule rule;
  int axes;
  /// Returns the x component of the unit vector along which patches of this kind move, oblique with two axes.
  double ex() const { return axes == 2 ? 0.6 : 1.0; }
  double ey() const { return axes == 2 ? 0.8 : 0.0; }
  bool is_double() const { return precision == Precision::double_; }
  std::string name() const {
    return std::string(name_of(precision)) + ", " + table_name(rule) + ", axes " + std::to_string(axes);
  }
};
inline std::vector<Kind> kinds() {
  std::vector<Kind> all;
  for (Precision precision : precisions())
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw})
      for (int axes : {1, 2}) all.push_back({precision, rule, axes});
  return all;
}

/// Moves a patch by `length` (m) in one step, along the direction of its kind.
inline Response step_along(OnePatch& patch, const Kind& kind, double length, double load,
                           double dt_s = tick) {
  return patch.step(length * kind.ex(), length * kind.ey(), load, dt_s);
}
/// Returns the elastic friction along the direction of the patch's kind, N.
inline double friction_along(const Response& r, const Kind& kind) {
  return -(r.elastic[0] * kind.ex() + r.elastic[1] * kind.ey());
}

}  // namespace bristle_test
