#include <cstdio>

#include <bristle/bristle.hpp>
#include <bristle/contact_frame.hpp>

int main() {
  bristle::PatchBatch batch;
  const auto options = bristle::PatchOptions{}
                           .with_max_normal_load(50.0 /* N */)
                           .with_population(bristle::Population::infinite)
                           .with_resolution(4);
  bristle::KeyedPatches patches(batch, bristle::Material{}, options,
                                bristle::KeyedOptions{}.with_capacity(1000));  // allocates all memory
  batch.warm_up();
  bristle::ContactFrames frames(patches);
  for (int step = 0; step < 300; ++step) {
    // Contact 42, from the engine: normal, force, relative velocity.
    const Eigen::Vector3d normal(0, 0, 1), velocity(0.01, 0.002, 0.0), arm(0.0, 0.0, -0.05 /* m */);
    const bristle::KeyedContact contact = patches.find_or_add_contact(42);
    bristle::Motion motion{contact.id, {0.0, 0.0}, 20.0 /* N */};
    const bristle::ContactFrame& frame = frames.carry(contact, normal);
    frame.set_displacement(1e-3 /* s */ * velocity, motion);
    bristle::Response response;
    batch.step(1e-3 /* s */, {&motion, 1}, {&response, 1});            // all contacts
    patches.end_step();                                                // frees patches that the step lacked
    if (has(response.status, bristle::Status::no_capacity)) return 1;  // raise the capacity
    const auto wrench = bristle::ContactFrame::wrench(frame.force(response.end), arm);
    if (step % 100 == 99)
      std::printf("force %.3f %.3f N, moment %.3f N m\n", wrench[0], wrench[1], wrench[4]);
  }
}
