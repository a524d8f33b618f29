// Maps snap lengths to another law at equal quantile, so that a bristle stays as strong among the others when
// the material changes in use.
#pragma once

#include <algorithm>
#include <cmath>

#include "bristle/snap_length.hpp"

namespace bristle::detail {

/// Map from the snap length of a bristle to the length in another law below which an equal share of the
/// lengths lies. For two laws that differ only in scale it is a factor.
class QuantileMap {
 public:
  QuantileMap(const SnapLength& from, const SnapLength& to) noexcept
      : from_(from), to_(to), factor_(same_form(from, to) ? to.mean() / from.mean() : 0.0) {}

  /// Returns the length in the second law, m, for a length of the first one, m. Where a law has many bristles
  /// of one length, `among_equals` (0 to 1) says which of them it is.
  double operator()(double length_m, double among_equals) const noexcept {
    if (factor_ > 0.0) return factor_ * length_m;
    double share = 1.0 - from_.survival(length_m);
    if (has_atoms(from_)) {
      const double shorter = 1.0 - from_.survival(length_m * (1.0 - 1e-12));
      share = shorter + (share - shorter) * among_equals;
    }
    return to_.quantile(std::clamp(share, 0x1p-24, 1.0 - 0x1p-24));
  }

 private:
  static bool has_atoms(const SnapLength& law) noexcept {
    return law.law() == SnapLaw::single || law.law() == SnapLaw::table;
  }
  static bool same_form(const SnapLength& a, const SnapLength& b) noexcept {
    const auto equal = [](double x, double y) { return std::abs(x - y) <= 1e-12 * std::abs(y); };
    if (a.law() != b.law() || a.table_values().size() != b.table_values().size()) return false;
    for (std::size_t k = 0; k < a.table_values().size(); ++k)
      if (!equal(a.table_values()[k] / a.mean(), b.table_values()[k] / b.mean())) return false;
    return equal(a.cv(), b.cv());
  }

  const SnapLength& from_;
  const SnapLength& to_;
  double factor_;  ///< ratio of all lengths; 0: the laws differ in form
};

}  // namespace bristle::detail
