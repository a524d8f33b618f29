// A mass on a rail over one patch, moved by either coupling of <bristle/coupling.hpp>.
#pragma once

#include "scenes.hpp"
#include "tools/libraries/scene/couplings.hpp"

namespace bristle_test {

struct RailBody {
  RailBody(bool by_midpoint, double mass_kg, double normal_load_n, const Material& material,
           PatchOptions options)
      : midpoint(by_midpoint), patch(material, options.with_axes(1).with_outputs(Outputs::all)) {
    body.mass(0, 0) = mass_kg;
    contact.axes = 1;
    motion.id = patch.id;
    motion.normal_load = normal_load_n;
  }

  /// Steps the body by one tick of time under an applied force, N.
  void step(double push_n = 0.0) {
    const bristle::BodyVector<1> force = Eigen::Matrix<double, 1, 1>(push_n);
    if (midpoint)
      report = bristle::solve_displacements(patch.batch, tick, body, force, {&contact, 1}, {&motion, 1});
    else
      bristle::predict_displacements(patch.batch, tick, body, force, {&contact, 1}, {&motion, 1});
    response = patch.step(motion);
    if (midpoint)
      bristle::apply_mean_forces(tick, body, force, {&contact, 1}, {&response, 1});
    else
      bristle::apply_end_forces(tick, body, force, {&contact, 1}, {&response, 1});
    x += motion.displacement[0];
  }
  double kinetic_energy() const { return 0.5 * body.mass(0, 0) * body.velocity[0] * body.velocity[0]; }
  double stored_energy() const { return patch.energy(); }
  double energy() const { return kinetic_energy() + stored_energy(); }

  bool midpoint;
  OnePatch patch;
  bristle::MovingBody<1> body;
  bristle::BodyContact<1> contact;
  Motion motion;
  Response response;
  bristle::SolveReport report;
  double x = 0.0;
};

}  // namespace bristle_test
