// A user's program over Eigen: friction stops a block on a rail.
#include <bristle/bristle.hpp>
#include <bristle/coupling.hpp>

#include <cstdio>

int main() {
  bristle::PatchBatch batch;
  const bristle::Material wood = bristle::Material::from_coefficients(
      bristle::Coefficients::paper().with_kinetic(0.40).with_peak(0.46).with_rule(bristle::SnapRule::keep));
  bristle::Motion motion;
  motion.id = batch.add(wood, bristle::PatchOptions{}.with_max_normal_load(10.0).with_axes(1));
  motion.normal_load = 9.81;
  batch.warm_up();
  bristle::MovingBody<1> body;
  body.velocity[0] = 0.1;
  bristle::BodyContact<1> contact;
  contact.axes = 1;
  contact.jacobian << 1.0, 0.0;
  double path = 0.0;
  for (int tick = 0; tick < 100; ++tick) {
    const bristle::BodyVector<1> no_force = bristle::BodyVector<1>::Zero();
    bristle::Response out;
    bristle::predict_displacements<1>(batch, 1e-3, body, no_force, {&contact, 1}, {&motion, 1});
    batch.step(1e-3, {&motion, 1}, {&out, 1});
    bristle::apply_end_forces<1>(1e-3, body, no_force, {&contact, 1}, {&out, 1});
    path += motion.displacement[0];
  }
  std::printf("stopped after %.3f mm\n", 1e3 * path);
  // Expects v^2 / (2 mu g) = 1.274 mm, to within the bending of the bristles and one step's delay of the
  // force.
  return path > 1.15e-3 && path < 1.40e-3 && body.velocity[0] < 1e-3 ? 0 : 1;
}
