// A law of the snap length as weighted strata, for bristles that slide.
#pragma once

#include <cstdint>
#include <vector>

#include "bristle/snap_length.hpp"

namespace bristle::detail {

/// n intervals of the law that hold equal integrals of p^(1/3), p its density: the mean length of each over
/// E[delta], and its probability. A sum over them is off by n^-2, whatever the law's tail.
struct Strata {
  std::vector<double> length, share;
};
/// Throws std::bad_alloc. Set-up cost: some microseconds a stratum.
Strata make_strata(const SnapLength& law, std::uint32_t n);

}  // namespace bristle::detail
