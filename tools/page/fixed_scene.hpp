// A scene whose state hash the page shows beside the number that the native build computed.
#pragma once

#include <string>

namespace page {

/// Sixteen hexadecimal digits: the state after patches of every kind were moved, lifted and turned round.
std::string fixed_scene_hash();

}  // namespace page
