// A chart of a page: its points say their values under the pointer or a finger, by the style sheet alone. It
// grows with its place; on a phone its text is still readable.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace cli {

struct ChartPoint {
  double x = 0.0, y = 0.0;
  std::string says;  ///< under the pointer
};

struct PointSeries {
  enum class Mark { dot, ring, diamond, square };
  std::string name;    ///< in the key; empty: not there
  std::string colour;  ///< "#0072B2"
  Mark mark = Mark::dot;
  bool line = false;  ///< joined, in their order
  std::vector<ChartPoint> points;
};

struct GuideLine {
  bool upright = false;  ///< at this x; else at this y
  double at = 0.0;
  std::string says;
};

struct PointChart {
  std::string title, x_title, y_title;  ///< axes are logarithmic, which the chart adds to their titles
  std::vector<PointSeries> series;
  std::vector<GuideLine> guides;
};

/// Both axes logarithmic; what is not positive is left out. Empty where no point is left.
std::string point_chart_svg(const PointChart& chart);

/// Coloured cells of a map, both axes logarithmic: x and y are the places of columns and rows.
struct MapCellMark {
  std::size_t column = 0, row = 0;
  std::size_t kind = 0;  ///< of the key
  std::string says;
};
struct MapChart {
  std::string title, x_title, y_title;
  std::vector<double> xs, ys;
  std::vector<MapCellMark> cells;
};
/// Colours of the kinds: their names and what fills them.
std::string map_chart_svg(const MapChart& chart, const std::vector<std::string>& colours);

}  // namespace cli
