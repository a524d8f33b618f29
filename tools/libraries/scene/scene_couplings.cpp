#include "tools/libraries/scene/couplings.hpp"

namespace bristle {
BRISTLE_SCENE_COUPLINGS()
}  // namespace bristle
