#include "targets.hpp"
#include "twins.hpp"

namespace fuzz {

void rubbing(Bytes bytes) {
  static Twins twins;
  walk_any(twins, bytes, Brush::rubbed, false);
}

}  // namespace fuzz
