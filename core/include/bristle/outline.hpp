// Outline and pressure of a contact patch with an extent, cut into cells.
#pragma once

#include <vector>

#include "bristle/export.hpp"

namespace bristle {

/// Cell of an outline: a point and the share of the load that it stands for.
struct PatchCell {
  double position[2] = {0.0,
                        0.0};  ///< position of the cell from the centre of the outline, in its own axes, m
  double weight = 1.0;         ///< share of the normal load, > 0; the shares of an outline sum to 1
};

/// Distribution of the normal load over an outline.
enum class Pressure : unsigned char {
  uniform,  ///< equal pressure everywhere
  /// Pressure of smooth elastic bodies, (1 - (x/a)^2 - (y/b)^2)^1/2; on a rectangle (1 - (x/a)^2)^1/2, that
  /// of a cylinder that lies along y.
  hertz
};

/// Cells of an extended patch: what ExtendedPatches::add takes.
/// The cells are the nodes of Gauss rules, so more cells mean less error and more time. With n rings, sums
/// over the cells are exact for polynomials of the position up to degree 2 n - 1 (and below the number of
/// cells around); with nx by ny cells of a rectangle, up to 2 nx - 1 in x and 2 ny - 1 in y. Stiffness
/// against spin is therefore exact from 2 rings or 2 by 2 cells on. Friction of a patch that slides and spins
/// is no polynomial: its error falls with the area of a cell. Figures: core/MODEL.md, section 29.
struct Outline {
  std::vector<PatchCell> cells{PatchCell{}};  ///< 1 to 65536 cells, in any order
  /// Load at which the outline has its given size, N, > 0; its size then grows with the cube root of the load
  /// (Hertz's law for spheres). 0: its size is fixed.
  double full_size_load = 0.0;

  /// Makes an ellipse with half axes in m, 0 to 1e3, along x and y. `rings` (1 to 64) of `around` cells each
  /// (3 to 256; 0 = three times the rings, 4 for a single ring). Half axes of zero give the one cell of a
  /// point. Throws bristle::Error.
  BRISTLE_API static Outline ellipse(double half_x_m, double half_y_m, Pressure pressure, int rings = 3,
                                     int around = 0);
  static Outline disc(double radius_m, Pressure pressure, int rings = 3, int around = 0) {
    return ellipse(radius_m, radius_m, pressure, rings, around);
  }
  /// Makes a rectangle with half sides in m, 0 to 1e3. `nx` by `ny` cells, 1 to 64 each. Throws
  /// bristle::Error.
  BRISTLE_API static Outline rectangle(double half_x_m, double half_y_m, Pressure pressure, int nx = 5,
                                       int ny = 5);

  Outline& grow_with_load(double full_size_load_n) {
    full_size_load = full_size_load_n;
    return *this;
  }
};

}  // namespace bristle
