#include "tools/libraries/reports/numbers.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace cli {

std::string time_text(double seconds) {
  const struct {
    double scale;
    const char* unit;
  } units[] = {{1.0, "s"}, {1e3, "ms"}, {1e6, "us"}, {1e9, "ns"}};
  for (const auto& unit : units) {
    const double value = seconds * unit.scale;
    if (std::fabs(value) < 0.9995 && unit.scale < 1e9) continue;
    return fmt::format("{:.{}f} {}", value, value < 9.995 ? 2 : value < 99.95 ? 1 : 0, unit.unit);
  }
  return "0 ns";
}

std::string count_text(unsigned long long count) {
  const std::string digits = std::to_string(count);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ',';
    text += digits[i];
  }
  return text;
}

std::string number_text(const nlohmann::ordered_json& value, double scale) {
  if (value.is_null()) return "-";
  const double number = value.get<double>() * scale;
  const double size = std::fabs(number);
  if (size == 0.0) return "0";
  if (!std::isfinite(number)) return fmt::format("{}", number);
  // Counts the digits before the point after rounding: 99.96, rounded to three digits, has three.
  const int exponent = static_cast<int>(std::floor(std::log10(size) + 1e-12));
  if (size < 1e-3 || size >= 1e7) return fmt::format("{:.3g}", number);
  std::string text = fmt::format("{:.{}f}", number, std::max(0, 2 - exponent));
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text;
}

std::string percent_text(const nlohmann::ordered_json& share) { return number_text(share, 100.0); }

std::string range_text(const nlohmann::ordered_json& pair, double scale) {
  return number_text(pair.at(0), scale) + " to " + number_text(pair.at(1), scale);
}

}  // namespace cli
