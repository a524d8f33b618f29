// A chart of curves and dots as SVG, with nothing outside of it.
#pragma once

#include <string>
#include <vector>

namespace cli {

struct ChartSeries {
  std::string name;          ///< empty: not in the key
  std::string colour;        ///< "#0072B2"
  bool dots = false;         ///< else a line
  std::vector<double> x, y;  ///< of the same length; what is not finite ends a line
};

struct Chart {
  std::string x_title, y_title;
  std::vector<ChartSeries> series;
  int height = 300;  ///< pixels, of 900 wide
};

std::string chart_svg(const Chart& chart);

}  // namespace cli
