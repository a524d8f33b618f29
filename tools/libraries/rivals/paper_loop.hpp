// The paper's own loop (Zhang and Phillips 2004, section 4.1) over n bristles, as its authors wrote it:
//
//   z += v dt;  if |z| > delta: z = 0        F = sum over bristles in contact of (sigma0 z + sigma1(v) v) +
//   sigma2 v
//
// A snap loses the rest of the step's path. In steps that are not short compared with the snap lengths, much
// of the friction is lost with it: the force is about 1 - h / (2 dbar) of the brush's at steps of length h
// (core/MODEL.md, section 13). The loop uses plain arrays in double, and has no residual, shared renewal,
// ageing, drop and lay.
#pragma once

#include <cstdint>
#include <vector>

#include <bristle/material.hpp>

#include "tools/libraries/rivals/pair.hpp"

namespace rivals {

class PaperLoop {
 public:
  /// Makes n bristles at rest that together stand for those in contact at `max_load_n` (N). Their first
  /// lengths are quantiles of the law, spread evenly over it, also among the first k bristles for any k.
  /// `seed` selects these lengths and those after a snap.
  PaperLoop(const bristle::Material& material, std::uint32_t n, double max_load_n, std::uint32_t seed);

  /// Moves the body by `displacement` (m) in dt_s > 0 at constant velocity under load_n >= 0 (N). Returns the
  /// force on the moving body at the end of the step; it stands for the mean force too, which this loop does
  /// not compute.
  Force step(Pair displacement, double dt_s, double load_n) noexcept;

  Pair deflection(std::size_t i) const noexcept { return z_[i]; }
  double snap_length(std::size_t i) const noexcept { return delta_[i]; }
  std::uint64_t snaps() const noexcept { return snaps_; }  ///< number of snaps so far

 private:
  double sample() noexcept;  ///< returns a fresh snap length, m

  bristle::Material material_;
  double weight_;              ///< physical bristles per bristle of the loop
  std::vector<Pair> z_;        ///< deflections, m
  std::vector<double> delta_;  ///< deflections at which the bristles snap, m
  std::uint64_t random_;
  std::uint64_t snaps_ = 0;
};

}  // namespace rivals
