#include "tools/libraries/scene/couplings.hpp"

namespace bristle {
BRISTLE_OTHER_COUPLINGS()
}  // namespace bristle
