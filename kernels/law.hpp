// Computes snap lengths from uniform random numbers, by the quantile functions of the laws. V is a vector or
// a plain number.
#pragma once

#include "cells.hpp"
#include "core/kernel_table.hpp"
#include "elementary.hpp"

namespace bristle::detail {
namespace {

template <class T, class V>
inline V clamp_length(const KernelLaw& law, V length) {
  return least(most(length, V(static_cast<T>(law.shortest))), V(static_cast<T>(law.longest)));
}

/// Returns the quantile of a law that is not uniform: the snap length below which this share of the law lies
/// (above which, for the exponential law). Not inlined, so that callers contain only the short code of the
/// uniform law.
template <class T, class V>
[[gnu::noinline]] V other_length(const KernelLaw& law, V share) {
  switch (law.kind) {
    case law_exponential:
      return clamp_length<T>(law, V(T(0)) - V(static_cast<T>(law.location)) * natural_log<T>(share));
    case law_normal:
    case law_lognormal:
      return length_of_cell<T>(law.table, share);
    default:
      return clamp_length<T>(law, look_up<T>(law.table, law.table_last, share));
  }
}

/// Returns the quantile of a law, scaled: the snap length below which this share of the law lies (above
/// which, for the exponential law).
template <class T, class V>
inline V length_at(const KernelLaw& law, V share) {
  if (law.kind == law_uniform) return V(static_cast<T>(law.location)) + V(static_cast<T>(law.scale)) * share;
  return other_length<T>(law, share);
}

/// Returns the snap length of the bristle found at a random point of a long slide. Long snap lengths are
/// likelier to be found, so the density is that of the law times the length. Not for the exponential law, for
/// which age and remaining length are independent.
template <class T, class V>
[[gnu::noinline]] V length_met(const KernelLaw& law, V share) {
  switch (law.kind) {
    case law_uniform:
      return root(V(static_cast<T>(law.biased_location)) + V(static_cast<T>(law.biased_scale)) * share);
    case law_lognormal:
      return length_of_cell<T>(law.biased_table, share);
    default:
      return clamp_length<T>(law, look_up<T>(law.biased_table, law.biased_last, share));
  }
}

}  // namespace
}  // namespace bristle::detail
