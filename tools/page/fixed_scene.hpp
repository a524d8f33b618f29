// Computes a state hash that the page shows beside that of the native build.
#pragma once

#include <string>

namespace page {

/// Moves, lifts and reverses patches of every kind, and returns their state hash as sixteen hexadecimal
/// digits.
std::string fixed_scene_hash();

}  // namespace page
