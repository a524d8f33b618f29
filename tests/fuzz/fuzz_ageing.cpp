#include "targets.hpp"
#include "twins.hpp"

namespace fuzz {

void ageing(Bytes bytes) {
  static Twins twins;
  walk_any(twins, bytes, Brush::aged, std::nullopt);
}

}  // namespace fuzz
