#include "tools/products/virtual_room/quantity_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace room {

std::string with_unit(double value, const char* unit) {
  static constexpr const char* prefixes[] = {"n", "µ", "m", "", "k", "M", "G"};
  const double size = std::abs(value);
  if (!std::isfinite(value)) return fmt::format("– {}", unit);
  if (size < 0.9995e-12) return fmt::format("0 {}", unit);
  const int thousands = std::clamp(static_cast<int>(std::floor(std::log10(size * 1.0005) / 3)), -3, 3);
  const double shown = value / std::pow(1000.0, thousands);
  const double digits = std::abs(shown);
  const int decimals = digits < 9.995 ? 2 : digits < 99.95 ? 1 : 0;
  return fmt::format("{:.{}f} {}{}", shown, decimals, prefixes[thousands + 3], unit);
}

}  // namespace room
