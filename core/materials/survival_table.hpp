// The survival function S of a snap-length law, the share of longer lengths, as the table that cohorts read
// (core/cohort_table.hpp).
#pragma once

#include <algorithm>
#include <vector>

#include "bristle/snap_length.hpp"
#include "core/cohort_table.hpp"
#include "core/materials/elementary.hpp"

namespace bristle::detail {

struct SurvivalTable {
  std::vector<SurvivalCell> cells;
  std::vector<double> squares;  ///< for each cell, E[delta^2; delta < start], with start the length at its
                                ///< beginning
  double end = 0.0;             ///< length at which S becomes 0
  double sure = 0.0;            ///< length up to which practically no bristle snaps (S = 1 to 2^-47)
  double mean = 0.0;            ///< E[delta] of the tabulated law
  double square = 0.0;  ///< E[delta^2] of the tabulated law; the mean deflection of steady sliding is square
                        ///< / (2 mean)
  double cube = 0.0;    ///< E[delta^3]
  double weak = 0.0;    ///< S at the deflection beyond which bristles carry 1e-4 of the force of steady
                        ///< sliding
  double finest = 1.0;  ///< length of the pieces into which a path must be cut, over their length for a
                        ///< smooth law of spread 0.25 or more; at most 1
  bool smooth = true;   ///< whether S is smooth; if not, it has corners where the density of the law jumps
  double forget = 0.0;  ///< path of straight sliding after which bristles from before it carry at most 3e-4
                        ///< of the force
  double follow = 0.0;  ///< path of straight sliding after which bristles from before it carry at most 1e-6
                        ///< of the force, so that errors of many slides do not add up
};

/// Makes the table; lengths in m times `per_metre` are scaled lengths. S is exact at the nodes and linear
/// between them, with an error of at most h^2 / 8 |S''|, h = (x + 1/16) / 128;
/// a corner of S is cut over a width h. For a table law the nodes have local means of S, which conserve the
/// mean of the law.
SurvivalTable make_survival_table(const SnapLength& law, double per_metre);

struct Survival {
  double left, moment, square;  ///< S(x), E[delta; delta < x] and E[delta^2; delta < x] of a law of snap
                                ///< lengths delta at a length x
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
