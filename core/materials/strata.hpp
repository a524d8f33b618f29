// A law of the snap length as weighted strata, for bristles that slide.
#pragma once

#include <cstdint>
#include <vector>

#include "bristle/snap_length.hpp"

namespace bristle::detail {

/// Weighted lengths, over E[delta], whose force at first loading, the sum of share x min(x, length), is as
/// close to E[min(x, delta)] as n lengths can be: its error alternates between +e and -e, of order n^-2
/// whatever the law's tail (a law without density between its ends meets this up to its own jumps). Sum of
/// shares and mean length are the law's own. The inner strata hold equal integrals of p^(1/2), p the density;
/// each stratum has its mean length and its probability. The lengths of the first and the last are shifted by
/// e over their probability.
struct Strata {
  std::vector<double> length, share;
};
/// Divides the law into n strata. Throws std::bad_alloc. Set-up cost: some microseconds for each stratum.
Strata make_strata(const SnapLength& law, std::uint32_t n);

}  // namespace bristle::detail
