// The survival function S of a snap-length law (S(x) is the share of lengths above x) as a table, from which
// infinite brushes read how many bristles snap (core/cohort_table.hpp).
#pragma once

#include <algorithm>
#include <vector>

#include "bristle/snap_length.hpp"
#include "core/cohort_table.hpp"
#include "core/materials/elementary.hpp"

namespace bristle::detail {

struct SurvivalTable {
  std::vector<SurvivalCell> cells;
  /// For each cell the partial moment E[delta^2; delta < start], where start is the length at which the cell
  /// begins.
  std::vector<double> squares;
  double end = 0.0;   ///< length at which S becomes 0
  double sure = 0.0;  ///< length up to which practically no bristle snaps (S = 1 to 2^-47)
  double mean = 0.0;  ///< E[delta] of the tabulated law
  /// E[delta^2] of the tabulated law, from which the mean deflection of steady sliding follows as square / (2
  /// mean).
  double square = 0.0;
  double cube = 0.0;  ///< E[delta^3]
  /// Survival S at the deflection beyond which bristles carry 1e-4 of the force of steady sliding. A cohort
  /// of which a smaller share is left is negligible.
  double weak = 0.0;
  /// Longest piece into which a path may be cut, over the length allowed for a smooth law of spread 0.25 or
  /// more; at most 1. Laws under which many bristles snap together need shorter pieces.
  double finest = 1.0;
  bool smooth = true;  ///< whether S is smooth; if not, it has corners where the density of the law jumps
  /// Path of straight sliding after which the force is as if the patch had always slid: bristles from before
  /// it carry at most 3e-4 of the force.
  double forget = 0.0;
  /// Path of straight sliding after which bristles from before it carry at most 1e-6 of the force. Stricter
  /// than `forget`, so that errors of many slides do not add up.
  double follow = 0.0;
};

/// Makes the table of a law. Lengths in m times `per_metre` are scaled lengths. S is exact at the nodes and
/// linear between them, with an error of at most h^2 / 8 |S''|, h = (x + 1/16) / 128; a corner of S is cut
/// over a width h. For a law given as a table the nodes have local means of S, which conserve the mean of the
/// law.
SurvivalTable make_survival_table(const SnapLength& law, double per_metre);

struct Survival {
  /// Values of a law of snap lengths delta at a length x: S(x), E[delta; delta < x] and E[delta^2; delta <
  /// x].
  double left, moment, square;
};
inline Survival survival_at(const SurvivalTable& table, double x) noexcept {
  if (x <= table.sure) return {1.0, 0.0, 0.0};
  x = std::min(x, table.end);
  const std::size_t k = (bits_of(x + survival_offset) >> survival_shift) - survival_first;
  const SurvivalCell& cell = table.cells[k];
  const double left = cell.survival + cell.slope * (x - cell.start);
  const double snapped = cell.survival - left;
  return {left, cell.moment + snapped * 0.5 * (cell.start + x),
          table.squares[k] + snapped * (cell.start * cell.start + cell.start * x + x * x) / 3.0};
}

}  // namespace bristle::detail
