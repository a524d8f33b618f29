// Strata: a few weighted snap lengths that stand for a whole law, so that a patch with SnapRule::slide needs
// few bristles.
#pragma once

#include <cstdint>
#include <vector>

#include "bristle/snap_length.hpp"

namespace bristle::detail {

/// Weighted lengths, in units of E[delta], that stand for a law. Their mean deflection in first loading, the
/// sum of share x min(x, length), is close to that of the law, E[min(x, delta)]: for n > 2 the error
/// alternates between +e and -e, with e of order n^-2 whatever the law's tail (under a table with gaps it may
/// reach 2 e).
/// The sum of the shares is 1, and the mean length is the law's. The inner strata have equal integrals of
/// p^(1/2), with p the density. Each stratum has the mean length and the probability of its part of the law;
/// the lengths of the first and the last are shifted by e over their probability.
struct Strata {
  std::vector<double> length, share;
};
/// Divides the law into n strata. Throws std::bad_alloc. For set-up code: it takes up to some milliseconds.
Strata make_strata(const SnapLength& law, std::uint32_t n);

}  // namespace bristle::detail
