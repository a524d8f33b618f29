#include "targets.hpp"
#include "twins.hpp"

namespace fuzz {

void ageing(Bytes bytes) {
  static Twins twins;
  Input input(bytes);
  bristle::Material material;
  bristle::PatchOptions options;
  try {
    material = any_brush(input, Brush::aged);
    options = any_brush_options(input, 600, input.flag());
    leave_out_known(material, options);
  } catch (const bristle::Error&) {  // a law that is refused
    return;
  }
  walk(twins, input, material, options, Brush::aged);
}

}  // namespace fuzz
