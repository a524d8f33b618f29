#include "tools/libraries/rivals/pressed_cells.hpp"

#include <numeric>
#include <stdexcept>
#include <string>

namespace rivals {
namespace {

void check(int across, double size_m, const char* size_name) {
  if (across < 1)
    throw std::invalid_argument("across is " + std::to_string(across) + "; a grid needs at least one cell");
  if (!(size_m > 0.0 && std::isfinite(size_m)))
    throw std::invalid_argument(std::string(size_name) + " is " + std::to_string(size_m) +
                                " m; it must be above zero");
}

double middle_of(int cell, int across, double width) { return width * ((cell + 0.5) / across - 0.5); }

void share_out(PressedCells& cells) {
  const double sum = std::accumulate(cells.share.begin(), cells.share.end(), 0.0);
  for (double& share : cells.share) share /= sum;
}

}  // namespace

PressedCells disc_cells(int across, double radius_m, Pressure pressure) {
  check(across, radius_m, "radius");
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
  share_out(cells);
  return cells;
}

PressedCells rectangle_cells(int across_x, int across_y, double width_m, double height_m) {
  check(across_x, width_m, "width");
  check(across_y, height_m, "height");
  PressedCells cells;
  for (int i = 0; i < across_x; ++i) {
    for (int j = 0; j < across_y; ++j) {
      cells.x.push_back(middle_of(i, across_x, width_m));
      cells.y.push_back(middle_of(j, across_y, height_m));
      cells.share.push_back(1.0);
    }
  }
  share_out(cells);
  return cells;
}

}  // namespace rivals
