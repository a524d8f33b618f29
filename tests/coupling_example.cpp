// An example of <bristle/coupling.hpp>, run by test_coupling.cpp: a plate that is pushed over a patch.
#include "coupling_example.hpp"

#include <bristle/bristle.hpp>
#include <bristle/coupling.hpp>

// Pushes a plate of 0.25 kg on a patch along x with `push` newtons for a second. Returns its displacement, m.
double pushed_plate(double push) {
  bristle::PatchBatch batch;
  const bristle::PatchId patch =
      batch.add(bristle::Material{}, bristle::PatchOptions{}.with_max_normal_load(5.0));
  batch.warm_up();
  bristle::Motion motion{patch, {0.0, 0.0}, 0.25 * 9.81 /* N */};
  bristle::Response response;
  bristle::BodyContact<6> foot = bristle::rigid_contact(0, {0, 0, 0} /* m */, {1, 0, 0}, {0, 1, 0});
  bristle::RigidBody plate = bristle::rigid_body(0.25, Eigen::Vector3d(1e-4, 1e-4, 2e-4).asDiagonal());
  const bristle::BodyVector<6> force = Eigen::Matrix<double, 6, 1>::Unit(0) * push;
  double x = 0.0;
  for (int tick = 0; tick < 1000; ++tick) {
    bristle::predict_displacements(batch, 1e-3, plate, force, {&foot, 1}, {&motion, 1});
    batch.step(1e-3 /* s */, {&motion, 1}, {&response, 1});
    bristle::apply_end_forces(1e-3, plate, force, {&foot, 1}, {&response, 1});
    x += motion.displacement[0];
  }
  return x;
}
