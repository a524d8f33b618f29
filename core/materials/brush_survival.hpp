// The law of snap lengths as infinite brushes read it: cells of its survival function, and the lengths and
// shares from which a step's pieces and cohorts follow (core/lane_table.hpp).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/lane_table.hpp"
#include "core/materials/kernel_law.hpp"

namespace bristle::detail {

/// The cells of a law's survival function S, in both precisions. Takes the layout of cells with the least
/// error. The integral of S over every cell is that of the law, so that the mean snap length is too.
class BrushCells {
 public:
  /// Makes the cells. Lengths in m times `per_metre` are scaled. Takes up to a millisecond, for a law given
  /// as a table some milliseconds.
  BrushCells(const SnapLength& law, double per_metre);

  double finest = 1.0;  ///< find_finest_piece() of the law
  double waves = 0.0;   ///< path, scaled, along which bristles that began to slide together snap in step
  /// Survival at the deflection beyond which 1e-3 of the force of steady sliding is left out if all bristles
  /// snap there. A cohort of which less is left may end.
  double weak = 0.0;

  /// Returns the cells in the precision of T, which live as long as this object.
  template <class T>
  BrushSurvival<T> view() const noexcept {
    const std::vector<LaneColumn<T>>& numbers = columns<T>();
    const std::size_t each = numbers.size() / 3;
    BrushSurvival<T> s{};
    s.c0 = numbers[0].lane;
    s.c1 = numbers[each].lane;
    s.c2 = numbers[2 * each].lane;
    s.low = static_cast<T>(low_);
    s.high = static_cast<T>(high_);
    s.per_length = static_cast<T>(per_length_);
    s.per_octave = static_cast<T>(per_octave_);
    s.cells = cells_;
    return s;
  }

 private:
  template <class T>
  const std::vector<LaneColumn<T>>& columns() const noexcept {
    if constexpr (sizeof(T) == sizeof(double))
      return double_;
    else
      return float_;
  }
  /// Columns of coefficients: all c0, then all c1 and c2.
  std::vector<LaneColumn<float>> float_;
  std::vector<LaneColumn<double>> double_;
  double low_ = 0.0, high_ = 0.0, per_length_ = 0.0, per_octave_ = 0.0;
  std::uint32_t cells_ = 0;
};

/// Fills the parts of the law of infinite brushes that follow from the material and from `resolution`, the
/// pieces of path per mean snap length: all but scales, forces, ageing and the number of cohorts.
template <class T>
void fill_brush_law(const CompiledMaterial& material, double resolution, BrushLaw<T>& law,
                    BrushSurvival<T>& survival);

/// Returns the number of cohorts of a contact. Many pieces need many cohorts, because merging would otherwise
/// cause larger errors than pieces do. So do laws whose longest bristles reach over many pieces.
std::uint32_t choose_cohorts(const CompiledMaterial& material, double resolution);

/// Returns S(x) as kernels compute it (survival() of kernels/lane_brush_motion.hpp), but for roundings.
template <class T>
T survival_at(const BrushSurvival<T>& s, T x) noexcept {
  T cell = (std::clamp(x, s.low, s.high) - s.low) * s.per_length;
  if (s.per_octave > T(0)) {
    int exponent = 0;
    const T half = std::frexp(cell + T(1), &exponent);  // in [1/2, 1)
    cell = (static_cast<T>(exponent - 1) + (half + half - T(1))) * s.per_octave;
  }
  const T index = std::min(std::floor(cell), static_cast<T>(s.cells - 1));
  const T f = cell - index;
  const auto k = static_cast<std::uint32_t>(index);
  return s.c0[k] + f * (s.c1[k] + f * s.c2[k]);
}

}  // namespace bristle::detail
