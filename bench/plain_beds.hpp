// FASTSIM, the loop that users write in place of a bed (bed.hpp), left to the compiler with the flags and
// rules of plain_loops.hpp.
#pragma once

#include "plain_loops.hpp"

namespace bristle::plain {

/// Force (N, two components) and torque (N m) on the moving body.
struct Wrench {
  double force[2] = {0.0, 0.0};
  double torque = 0.0;
};

/// Kalker's FASTSIM (Vehicle System Dynamics 11, 1982) with the parabolic bound: steady forces of a rolling
/// ellipse. Tractions of a row of cells are found from the leading edge to the trailing one, each explicitly
/// from its neighbour's. The inner loop runs across the rows, so that it vectorises.
class Fastsim {
 public:
  /// Makes `ny` rows of equal width, of `nx` cells each, in an ellipse of half widths a_m and b_m (m); its
  /// flexibilities are L1 to L3 (m^3/N).
  Fastsim(int nx, int ny, double a_m, double b_m, const double (&flexibility)[3], double friction,
          double load_n);
  ~Fastsim();
  Fastsim(const Fastsim&) = delete;
  Fastsim& operator=(const Fastsim&) = delete;

  /// Returns force and torque at steady creepages (slip over distance rolled, 1) and spin (1/m), with the
  /// signs of BedResponse.
  Wrench solve(double creep_x, double creep_y, double spin) noexcept;

 private:
  int nx_, ny_;
  double a_, b_, most_pressure_;  ///< half widths of the ellipse, m; highest pressure times friction, Pa
  double flexibility_[3];
  float* memory_;  ///< columns with one value per row: its position y, half length, tractions px, py
};

}  // namespace bristle::plain
