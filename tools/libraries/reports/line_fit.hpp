// Fits a straight line through measured points by least squares.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace cli {

struct Line {
  int points = 0;
  double slope = 0.0;
  double error = 0.0;  ///< standard error of the slope; 0 for two points
  double worst = 0.0;  ///< largest distance of a point from the line, along y
};

inline Line fit_line(const std::vector<double>& x, const std::vector<double>& y) {
  Line line{static_cast<int>(x.size())};
  if (x.size() < 2) return line;
  const auto n = static_cast<double>(x.size());
  double mx = 0.0, my = 0.0, sxx = 0.0, sxy = 0.0, syy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mx += x[i] / n;
    my += y[i] / n;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double dx = x[i] - mx, dy = y[i] - my;
    sxx += dx * dx;
    sxy += dx * dy;
    syy += dy * dy;
  }
  if (!(sxx > 0.0)) return line;
  line.slope = sxy / sxx;
  if (x.size() > 2) line.error = std::sqrt(std::max(0.0, syy - line.slope * sxy) / (n - 2.0) / sxx);
  for (std::size_t i = 0; i < x.size(); ++i)
    line.worst = std::max(line.worst, std::fabs(y[i] - my - line.slope * (x[i] - mx)));
  return line;
}

/// Fits a line on log-log axes, whose slope is the exponent of a power law.
inline Line fit_power(std::vector<double> x, std::vector<double> y) {
  for (std::vector<double>* const values : {&x, &y})
    for (double& value : *values) value = std::log(std::max(value, 1e-300));
  return fit_line(x, y);
}

}  // namespace cli
