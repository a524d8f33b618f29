#include "targets.hpp"
#include "twins.hpp"

namespace fuzz {

void kernels(Bytes bytes) {
  static Twins twins;
  Input input(bytes);
  bristle::Material material;
  bristle::PatchOptions options;
  try {
    material = any_material(input);
    options = any_options(input, 600);
  } catch (const bristle::Error&) {  // the library refuses the random law, which is no fault
    return;
  }
  if (!twins.add(material, options)) return;
  const double scale = material.snap_length.mean();
  for (int k = 0; k < 24 && !input.empty(); ++k) {
    const bristle::Motion motion = any_motion(input, {}, options.axes, scale);
    const double dt = input.choice(16) == 15 ? input.number(1e-3) : 1e-3;
    twins.step(dt, motion, input.choice(8) == 7);
  }
  twins.check_alike();
  twins.remove();
}

}  // namespace fuzz
