// Reads a snap-length law at many lengths at once, which costs less than single calls of SnapLength.
#pragma once

#include "bristle/snap_length.hpp"
#include "bristle/span.hpp"

namespace bristle::detail {

/// Values of a law at one length: its partial moments of order 0 and 1 (SnapLength::partial_moment), and its
/// survival function (SnapLength::survival).
struct LawAt {
  double probability, first, survival;
};

/// Computes the values of the law at each of the lengths (m, above 0, finite; as many as `at` has). The bits
/// are those of SnapLength's functions; for a lognormal law the three values share most of their work.
void read_law(const SnapLength& law, Span<const double> lengths_m, Span<LawAt> at);

}  // namespace bristle::detail
