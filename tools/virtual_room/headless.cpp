#include "tools/virtual_room/headless.hpp"

namespace room {

void run_headless(const RunOptions&, HapticLoop&, const DrawFrame&) {}

}  // namespace room
