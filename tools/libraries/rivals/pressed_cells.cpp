#include "tools/libraries/rivals/pressed_cells.hpp"

#include <numeric>
#include <stdexcept>
#include <string>

namespace rivals {
namespace {

double middle_of(int cell, int across, double width) { return width * ((cell + 0.5) / across - 0.5); }

}  // namespace

PressedCells disc_cells(int across, double radius_m, Pressure pressure) {
  if (across < 1)
    throw std::invalid_argument("across is " + std::to_string(across) + "; a grid needs at least one cell");
  if (!(radius_m > 0.0 && std::isfinite(radius_m)))
    throw std::invalid_argument("radius is " + std::to_string(radius_m) + " m; it must be above zero");
  PressedCells cells;
  for (int i = 0; i < across; ++i) {
    for (int j = 0; j < across; ++j) {
      const double x = middle_of(i, across, 2.0 * radius_m), y = middle_of(j, across, 2.0 * radius_m);
      const double inside = 1.0 - (x * x + y * y) / (radius_m * radius_m);
      if (!(inside > 0.0)) continue;
      cells.x.push_back(x);
      cells.y.push_back(y);
      cells.share.push_back(pressure == Pressure::hertz ? std::sqrt(inside) : 1.0);
    }
  }
  const double sum = std::accumulate(cells.share.begin(), cells.share.end(), 0.0);
  for (double& share : cells.share) share /= sum;
  return cells;
}

}  // namespace rivals
