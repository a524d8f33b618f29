// Computes a state hash in the browser, which the page shows beside that of the native build.
#pragma once

#include <string>

namespace page {

/// Steps patches of every kind through moves, lifts and reversals. Returns their state hash as sixteen
/// hexadecimal digits, equal on every machine.
std::string fixed_scene_hash();

}  // namespace page
