// Numbers with units, as a person writes them.
#pragma once

#include <cstdint>
#include <string>

namespace room {

/// Three digits and the prefix that fits: (0.00132, "m") gives "1.32 mm". From 1e-9 to 1e9.
std::string with_unit(double value, const char* unit);
/// 1234567 gives "1,234,567".
std::string with_commas(std::uint64_t count);

}  // namespace room
