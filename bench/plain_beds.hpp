// Loops that a bed (bed.hpp) is compared with, as its users write them, left to the compiler (flags and rules
// of plain_loops.hpp): a disc of equal cells, FASTSIM, and the spring of granular codes.
#pragma once

#include <cstddef>

#include "plain_loops.hpp"

namespace bristle::plain {

/// Force and torque on the moving body: N, N, N m.
struct Wrench {
  double force[2] = {0.0, 0.0};
  double torque = 0.0;
};

/// Disc of equal cells under uniform pressure that slides and spins: each cell follows its root and is pulled
/// back to its limit along its deflection. Single precision, end force, one loop.
class DiscLoop {
 public:
  /// Makes the cells of a grid of `across` by `across` whose middle is in the disc, all with one limit (m).
  DiscLoop(int across, double radius_m, double limit_m, double force_limit_n);
  ~DiscLoop();
  DiscLoop(const DiscLoop&) = delete;
  DiscLoop& operator=(const DiscLoop&) = delete;

  Wrench step(double dx_m, double dy_m, double spin) noexcept;
  std::size_t size() const noexcept { return n_; }

 private:
  std::size_t n_;
  double radius_m_, limit_m_, force_limit_n_;
  float* zx_;  ///< deflection over the limit
  float* zy_;
  float* x_;  ///< position over the radius
  float* y_;
};

/// Kalker's FASTSIM (Vehicle System Dynamics 11, 1982) with the parabolic bound: steady forces of a rolling
/// ellipse, in rows of cells from the leading edge to the trailing one, each explicit from its neighbour. The
/// inner loop runs across the rows, so that it vectorises.
class Fastsim {
 public:
  /// Sets `nx` cells along each of `ny` rows of equal width; half widths (m), flexibilities L1 to L3 (m^3/N).
  Fastsim(int nx, int ny, double a_m, double b_m, const double (&flexibility)[3], double friction,
          double load_n);
  ~Fastsim();
  Fastsim(const Fastsim&) = delete;
  Fastsim& operator=(const Fastsim&) = delete;

  /// Solves for creepages (1) and spin (1/m). Force and torque have the signs of BedResponse.
  Wrench solve(double creep_x, double creep_y, double spin) noexcept;

 private:
  int nx_, ny_;
  double a_, b_, most_pressure_;  ///< half widths; highest pressure times friction, Pa
  double flexibility_[3];
  float* memory_;  ///< columns with a value per row: y, half length, px, py
};

/// Tangential springs of granular codes (Cundall and Strack, with the stiffness of the present contact
/// radius): a vector per contact, which grows by stiffness times motion and is cut to mu N.
class HistorySprings {
 public:
  /// Makes n contacts. Their stiffness is stiffness_n_m at the load load_n, and proportional to its cube
  /// root.
  HistorySprings(std::size_t n, double friction, double stiffness_n_m, double load_n);
  ~HistorySprings();
  HistorySprings(const HistorySprings&) = delete;
  HistorySprings& operator=(const HistorySprings&) = delete;

  /// Steps all contacts from motions and loads, n each; writes the forces on the bodies.
  void step(const float* dx_m, const float* dy_m, const float* load_n, float* fx_n, float* fy_n) noexcept;

 private:
  std::size_t n_;
  double friction_, stiffness_, load_;
  float* fx_;
  float* fy_;
};

}  // namespace bristle::plain
