// Loops that a bed (bed.hpp) is compared with, as its users write them, left to the compiler (flags and rules
// of plain_loops.hpp): a disc of equal cells, FASTSIM, and the spring of granular codes.
#pragma once

#include <cstddef>

#include "plain_loops.hpp"

namespace bristle::plain {

/// Force (N, two components) and torque (N m) on the moving body.
struct Wrench {
  double force[2] = {0.0, 0.0};
  double torque = 0.0;
};

/// Disc of equal cells under uniform pressure that slides and spins. Each cell's deflection grows with its
/// motion and is cut, without a change of direction, to the cell's limit. Single precision, end force, one
/// loop.
class DiscLoop {
 public:
  /// Makes a grid of `across` by `across` cells and keeps those whose middle is in the disc. All cells have
  /// the same limit of deflection, limit_m.
  DiscLoop(int across, double radius_m, double limit_m, double force_limit_n);
  ~DiscLoop();
  DiscLoop(const DiscLoop&) = delete;
  DiscLoop& operator=(const DiscLoop&) = delete;

  Wrench step(double dx_m, double dy_m, double spin) noexcept;
  std::size_t size() const noexcept { return n_; }

 private:
  std::size_t n_;
  double radius_m_, limit_m_, force_limit_n_;
  float* zx_;  ///< deflection of each cell over its limit, x and y
  float* zy_;
  float* x_;  ///< position of each cell over the radius, x and y
  float* y_;
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

  /// Returns force and torque at steady creepages (1) and spin (1/m), with the signs of BedResponse.
  Wrench solve(double creep_x, double creep_y, double spin) noexcept;

 private:
  int nx_, ny_;
  double a_, b_, most_pressure_;  ///< half widths of the ellipse, m; highest pressure times friction, Pa
  double flexibility_[3];
  float* memory_;  ///< columns with one value per row: its position y, half length, tractions px, py
};

/// Tangential springs of granular codes (Cundall and Strack, with the stiffness of the present contact
/// radius): a vector per contact, which grows by stiffness times motion and is cut to mu N.
class HistorySprings {
 public:
  /// Makes n contacts. The stiffness of each is stiffness_n_m (N/m) at the load load_n (N), and proportional
  /// to the cube root of its load.
  HistorySprings(std::size_t n, double friction, double stiffness_n_m, double load_n);
  ~HistorySprings();
  HistorySprings(const HistorySprings&) = delete;
  HistorySprings& operator=(const HistorySprings&) = delete;

  /// Steps all n contacts, given the motion (m) and load (N) of each; writes the forces on the bodies (N).
  void step(const float* dx_m, const float* dy_m, const float* load_n, float* fx_n, float* fy_n) noexcept;

 private:
  std::size_t n_;
  double friction_, stiffness_, load_;
  float* fx_;
  float* fy_;
};

}  // namespace bristle::plain
