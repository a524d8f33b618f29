// A user's program in C++17: pulls a pressed patch over 200 um and prints the force.
#include <bristle/bristle.hpp>

#include <algorithm>
#include <cstdio>
#include <cstring>

static_assert(__cplusplus < 202002L, "this is to be compiled as C++17");

int main() {
  // Checks that an exception thrown inside the library can be caught outside.
  bool caught = false;
  try {
    bristle::SnapLength::single(-1.0);
  } catch (const bristle::Error& e) {
    caught = std::strstr(e.what(), "= -1") != nullptr;
  }
  if (!caught) return 2;

  try {
    bristle::Material wood = bristle::Material::from_coefficients(
        bristle::Coefficients::paper().with_kinetic(0.40).with_peak(0.46).with_rule(bristle::SnapRule::keep));
    bristle::PatchBatch batch;
    const bristle::PatchId tip =
        batch.add(wood, bristle::PatchOptions{}.with_max_normal_load(4.0).with_axes(1));
    batch.warm_up();
    double peak = 0.0;
    bristle::Response out;
    for (int tick = 1; tick <= 100; ++tick) {
      bristle::Motion in;
      in.id = tip;
      in.displacement[0] = 2e-6;
      in.normal_load = 1.0;
      batch.step(1e-3, {&in, 1}, {&out, 1});
      peak = std::max(peak, -out.end[0]);
    }
    std::printf("bristle %s: peak %.9f N, in the end %.9f N, state %016llx\n", bristle::library_version(),
                peak, -out.end[0], static_cast<unsigned long long>(batch.state_hash()));
  } catch (const bristle::Error& e) {
    std::printf("%s\n", e.what());
    return 1;
  }
  return 0;
}
