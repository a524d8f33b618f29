#include <cmath>
#include <cstdio>

#include <bristle/bristle.hpp>

int main() {
  const auto surface = bristle::Material::from_coefficients(
      bristle::Coefficients{}.with_kinetic(0.4).with_peak(0.5).with_presliding_length(10e-6 /* m */));
  bristle::PatchBatch batch;
  bristle::Motion motion;
  bristle::Response response;
  motion.id = batch.add(
      surface, bristle::PatchOptions{}.with_axes(1).with_bristles(20000).with_outputs(bristle::Outputs::all));
  motion.normal_load = 1.0;  // N
  double x = 0.0, work = 0.0, lost = 0.0;
  for (int step = 1; step <= 2000; ++step) {  // moves by 20 um to either side, two periods
    const double next = 20e-6 * std::sin(6.283185307 * step / 1000);
    motion.displacement[0] = next - x;
    x = next;
    batch.step(1e-3, {&motion, 1}, {&response, 1});
    work -= response.mean[0] * motion.displacement[0];
    lost += response.dissipated;
    if (step % 25 == 0)
      std::printf("%.9g %.9g\n", 1e6 * x, -response.end[0]);  // um, N, for gnuplot's plot "loop"
  }
  std::printf("# work %.6g uJ = stored %.6g + lost in snaps %.6g\n", 1e6 * work,
              1e6 * batch.stored_energy(motion.id), 1e6 * lost);
}
