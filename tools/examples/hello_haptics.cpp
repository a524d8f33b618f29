#include <algorithm>
#include <cstdio>

#include <bristle/bristle.hpp>
#include <bristle/haptic_point.hpp>

int main() {
  const auto skin = bristle::Material::from_coefficients(
      bristle::Coefficients{}.with_kinetic(0.6).with_peak(0.7).with_presliding_length(0.5e-3 /* m */));
  bristle::PatchBatch batch;
  bristle::Motion motion;
  bristle::Response response;
  motion.id = batch.add(skin, bristle::PatchOptions{}
                                  .with_max_normal_load(3.3 /* N */)
                                  .with_population(bristle::Population::infinite));
  batch.warm_up();  // nothing allocates after this
  bristle::HapticPoint point(
      bristle::HapticOptions{}.with_force_limit(3.3 /* N */).with_peak_coefficient(skin.peak_coefficient()));
  for (int tick = 0; tick < 1000; ++tick) {              // servo callback
    const Eigen::Vector3d hand(2e-6 * tick, 0, -0.002);  // position from the device, m
    const double wall = 600.0 /* N/m */ * std::max(0.0, -hand.z());
    point.prepare(1e-3 /* s */, hand, {0, 0, 1}, wall, motion);
    batch.step(1e-3 /* s */, {&motion, 1}, {&response, 1});
    const Eigen::Vector3d force = point.finish(response);  // force for the device, N
    if (tick % 200 == 199) std::printf("%4.1f mm %6.3f N\n", 1e3 * hand.x(), force.x());
  }
}
