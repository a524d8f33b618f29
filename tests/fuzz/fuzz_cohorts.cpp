#include "targets.hpp"
#include "twins.hpp"

namespace fuzz {

void cohorts(Bytes bytes) {
  static Twins twins;
  walk_any(twins, bytes, Brush::rubbed, true);
}

}  // namespace fuzz
