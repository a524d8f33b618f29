// Pulls a patch that is pressed down and prints its friction, which shows that the installed package can be
// compiled, linked and run.
#include <bristle/bristle.hpp>
#include <cstdio>

int main() {
  bristle::PatchBatch batch;
  const bristle::PatchId tip =
      batch.add(bristle::Material{}.with_snap_rule(bristle::SnapRule::keep),
                bristle::PatchOptions{}.with_max_normal_load(2.0 /* N */).with_axes(1));
  bristle::Response out;
  for (int tick = 0; tick < 100; ++tick) {
    const bristle::Motion in{tip, {2e-6, 0.0} /* m */, 1.0 /* N */};
    batch.step(1e-3 /* s */, {&in, 1}, {&out, 1});
  }
  std::printf("bristle %s on %s: %.3f N\n", bristle::library_version(), batch.isa(), out.end[0]);
  return out.end[0] < -0.1 ? 0 : 1;
}
