// Scene whose state hash the page shows beside that of the native build.
#pragma once

#include <string>

namespace page {

/// Returns, as sixteen hexadecimal digits, the state hash after patches of every kind were moved, lifted and
/// reversed.
std::string fixed_scene_hash();

}  // namespace page
