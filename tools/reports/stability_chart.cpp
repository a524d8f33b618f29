// Charts of the page: behaviour of a closed loop over k and c.
#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "tools/reports/charts.hpp"
#include "tools/reports/numbers.hpp"
#include "tools/reports/point_chart.hpp"

namespace cli {
namespace {

// Told apart by everybody, and by lightness in print.
const std::vector<std::string> colours = {"#A6D8F5", "#F0E442", "#D55E00"};
constexpr const char* kinds[] = {"settles", "grows", "rings"};

/// The index of a value among others, or none.
std::size_t index_of(const std::vector<double>& values, double value) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::fabs(values[i] - value) <= 1e-9 * std::fabs(value)) return i;
  return values.size();
}

std::vector<double> numbers_of(const Json& values) {
  std::vector<double> out;
  for (const Json& value : values) out.push_back(value.is_number() ? value.get<double>() : 0.0);
  return out;
}

}  // namespace

std::string stability_charts(const Json& stability) {
  std::string text;
  for (const Json& map : stability.at("maps")) {
    const bool device = text_of(map, "scheme").starts_with("device");
    MapChart chart{text_of(map, "scheme") + ": stable where " + text_of(map, "linear_condition"),
                   "k = K T²/m",
                   device ? "beta = b T/m" : "c = C T/m",
                   numbers_of(stability.at("k")),
                   numbers_of(stability.at("c_or_beta")),
                   {}};
    for (const Json& cell : map.at("cells")) {
      const char* const second = device ? "beta" : "c";
      // Reports of older builds have the count only.
      if (!cell.contains("k") || !cell.contains(second) || !cell.contains("verdict")) continue;
      const double k = cell.at("k").get<double>(), c = cell.at(second).get<double>();
      const std::string verdict = text_of(cell, "verdict");
      const auto kind = std::find(std::begin(kinds), std::end(kinds), verdict);
      const std::size_t column = index_of(chart.xs, k), row = index_of(chart.ys, c);
      if (kind == std::end(kinds) || column == chart.xs.size() || row == chart.ys.size()) continue;
      chart.cells.push_back({column, row, static_cast<std::size_t>(kind - std::begin(kinds)),
                             fmt::format("k = {:.3g}, {} = {:.3g}: {}", k, second, c, verdict)});
    }
    text += map_chart_svg(chart, colours);
  }
  return text;
}

}  // namespace cli
