#include "targets.hpp"
#include "twins.hpp"

namespace fuzz {

void cohorts(Bytes bytes) {
  static Twins twins;
  Input input(bytes);
  bristle::Material material;
  bristle::PatchOptions options;
  try {
    material = any_brush(input, Brush::rubbed);
    options = any_brush_options(input, 600, true);
    leave_out_known(material, options);
  } catch (const bristle::Error&) {  // a law that is refused
    return;
  }
  walk(twins, input, material, options, Brush::rubbed);
}

}  // namespace fuzz
