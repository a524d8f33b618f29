// Example of a group: a thousand equal contacts, moved by plain arrays. Prints the friction of one in
// sliding.
#include <cstdio>
#include <vector>

#include <bristle/bristle.hpp>

// begin
int main() {
  const auto rubber = bristle::Material::from_coefficients(
      bristle::Coefficients{}.with_rule(bristle::SnapRule::slide).with_kinetic(0.8).with_peak(0.8));
  const std::size_t n = 1000;
  std::vector<double> dx(n, 1e-6 /* m, over a step */), load(n, 2.0 /* N */), fx(n);
  bristle::PatchBatch batch;
  bristle::GroupStep step;
  step.group =
      batch.add_group(rubber, bristle::PatchOptions{}.with_axes(1).with_max_normal_load(2.0 /* N */), n);
  step.displacement[0] = dx;
  step.normal_load = load;
  step.end[0] = fx;
  batch.warm_up();
  for (int i = 0; i < 200; ++i) batch.step(1e-3 /* s */, step);
  std::printf("%.3f N\n", fx[n - 1]);
}
// end
