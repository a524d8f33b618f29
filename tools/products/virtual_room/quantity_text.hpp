// Formats quantities with their units for the room's panels and tables.
#pragma once

#include <string>

namespace room {

/// Formats a value with three digits and an SI prefix, from 1e-9 to 1e9: (0.00132, "m") gives "1.32 mm".
std::string with_unit(double value, const char* unit);

}  // namespace room
