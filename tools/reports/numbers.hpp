// Numbers as people read them.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace cli {

/// "12.3 us", "1.00 ms".
std::string time_text(double seconds);
/// "1,234,567".
std::string count_text(unsigned long long count);

/// Text of a JSON number; "-" for null, which JSON has in place of a number that is not finite. Three digits
/// count; powers of ten only below 0.001 and from 10^7 on.
std::string number_text(const nlohmann::ordered_json& value, double scale = 1.0);
std::string percent_text(const nlohmann::ordered_json& share);
/// "0.98 to 1.02", of a pair.
std::string range_text(const nlohmann::ordered_json& pair, double scale = 1.0);

}  // namespace cli
