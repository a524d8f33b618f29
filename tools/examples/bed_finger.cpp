// Example of a bed: a soft fingertip pushes a plate and twists, and the contact slips from its rim inwards.
#include <bristle/bed.hpp>

#include <cstdio>

int main() {
  // begin
  using namespace bristle;
  BedOptions options;
  options.max_normal_load = 5.0;  // N
  BedBatch beds;
  const BedShape pad = BedShape::disc(6e-3, BedPressure::hertz).grown(BedGrowth::cube_root);
  const BedId finger = beds.add(BedMaterial(0.8).with_presliding(1.5e-3), pad, options);

  BedMotion motion;
  motion.id = finger;
  motion.normal_load = 5.0;
  BedResponse out;
  double work = 0.0, lost = 0.0;
  for (int tick = 0; tick <= 400; ++tick) {
    motion.displacement[0] = tick < 200 ? 1e-5 : 0.0;  // slides at 10 mm/s for 200 ticks of 1 ms, then stops
    motion.spin = tick < 200 ? 0.0 : 2e-3;             // then it twists
    motion.normal_load = tick < 300 ? 5.0 : 2.5;       // in the end the finger presses less
    beds.step({&motion, 1}, {&out, 1});
    work -= out.mean[0] * motion.displacement[0] + out.mean_torque * motion.spin;
    lost += out.dissipated;
    if (tick % 50 == 0)
      std::printf("%3d ms: force %6.3f N, torque %7.4f N m, %3.0f %% slips\n", tick, out.force[0], out.torque,
                  100.0 * out.slipping_share);
  }
  std::printf("put in %.6f J, lost %.6f J, stored %.6f J\n", work, lost, out.stored);
  // end
  const double error = work - lost - out.stored;
  return error < 1e-4 * work && error > -1e-4 * work ? 0 : 1;
}
