// What a bed (bed.hpp) is measured against, as its users write it and left to the compiler (flags as in
// plain_loops.hpp, and the same rules): a disc of equal cells, FASTSIM, and the spring of granular codes.
#pragma once

#include <cstddef>

#include "plain_loops.hpp"

namespace bristle::plain {

/// On the moving body: N, N, N m.
struct Wrench {
  double force[2] = {0.0, 0.0};
  double torque = 0.0;
};

/// Disc of equal cells under uniform pressure that slides and spins: each cell follows its root and is pulled
/// back to its limit along its deflection. Single precision, end force, one loop.
class DiscLoop {
 public:
  /// Cells of a grid of `across` by `across` whose middle is in the disc; limit (m) of all.
  DiscLoop(int across, double radius_m, double limit_m, double force_limit_n);
  ~DiscLoop();
  DiscLoop(const DiscLoop&) = delete;
  DiscLoop& operator=(const DiscLoop&) = delete;

  Wrench step(double dx_m, double dy_m, double spin) noexcept;
  std::size_t size() const noexcept { return n_; }

 private:
  std::size_t n_;
  double radius_m_, limit_m_, force_limit_n_;
  float* zx_;  ///< over the limit
  float* zy_;
  float* x_;  ///< over the radius
  float* y_;
};

/// Kalker's FASTSIM (Vehicle System Dynamics 11, 1982): the steady forces of a rolling ellipse, rows of cells
/// from the leading edge to the trailing one, each explicit from its neighbour. The parabolic bound. The
/// inner loop goes across the rows, so that it becomes vectors.
class Fastsim {
 public:
  /// `nx` cells along each of `ny` rows of equal width; half widths (m), flexibilities L1 to L3 (m^3/N).
  Fastsim(int nx, int ny, double a_m, double b_m, const double (&flexibility)[3], double friction,
          double load_n);
  ~Fastsim();
  Fastsim(const Fastsim&) = delete;
  Fastsim& operator=(const Fastsim&) = delete;

  /// Creepages (1) and spin (1/m). Force and torque have the signs of BedResponse.
  Wrench solve(double creep_x, double creep_y, double spin) noexcept;

 private:
  int nx_, ny_;
  double a_, b_, most_pressure_;  ///< the latter with friction, Pa
  double flexibility_[3];
  float* memory_;  ///< columns across: y, half length, px, py
};

/// The tangential spring of granular codes (Cundall and Strack, with the stiffness of the present contact
/// radius): one vector for each contact, which grows by stiffness times motion and is cut to mu N.
class HistorySprings {
 public:
  /// n contacts of mu, whose stiffness is stiffness_n_m at the load load_n and goes with its cube root.
  HistorySprings(std::size_t n, double friction, double stiffness_n_m, double load_n);
  ~HistorySprings();
  HistorySprings(const HistorySprings&) = delete;
  HistorySprings& operator=(const HistorySprings&) = delete;

  /// Motions and loads of all contacts, n each; forces on the bodies out.
  void step(const float* dx_m, const float* dy_m, const float* load_n, float* fx_n, float* fy_n) noexcept;

 private:
  std::size_t n_;
  double friction_, stiffness_, load_;
  float* fx_;
  float* fy_;
};

}  // namespace bristle::plain
