// Formats numbers in the way in which the tables and sentences of reports show them.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace cli {

/// Formats a time given in seconds with a suitable unit: "12.3 us", "1.00 ms".
std::string time_text(double seconds);
/// Formats a count with commas: "1,234,567".
std::string count_text(unsigned long long count);

/// Formats a JSON number times `scale` with three digits; uses powers of ten only below 0.001 and from 10^7
/// on. Returns "-" for null, which is JSON's form of a number that is not finite.
std::string number_text(const nlohmann::ordered_json& value, double scale = 1.0);
std::string percent_text(const nlohmann::ordered_json& share);
/// Formats a JSON pair of numbers, times `scale`, as a range: "0.98 to 1.02".
std::string range_text(const nlohmann::ordered_json& pair, double scale = 1.0);

}  // namespace cli
