// Kinds of brush that a fit chooses from, and the blocks of time that are held out to choose and to judge.
#pragma once

#include <string>
#include <vector>

#include "tools/libraries/fitting/fitter.hpp"

namespace cli {

/// Returns for each of the times (s, ascending) whether it lies in a block that models are fitted to: the
/// first `until` seconds, or 16 of 32 blocks of equal time in the order of Thue and Morse (0110 1001 ...),
/// which is in step with no period of the motion.
std::vector<bool> fitted_blocks(const std::vector<double>& t, std::optional<double> until);

/// Returns the record with the force of the fitted blocks only (or of the others), but the whole motion.
FitData part_of(const FitData& data, const std::vector<bool>& fitted, bool which = true);

/// One kind of brush, fitted to a record.
struct FittedBrush {
  std::string name;
  FitOptions options;  ///< options of this kind, with the quantiles of a free law
  Found found;
};

/// Fits the kinds of brush that the options allow, the simplest first: the paper's, rubbed, slide, slide with
/// a free law. Leaves out a kind that adds nothing to the one before or that cannot be fitted, and says why
/// in `failed` (unless null). Throws UserError if no kind can be fitted.
std::vector<FittedBrush> fit_brushes(const FitData& data, const FitOptions& options, Detail detail,
                                     const std::function<void(double)>& progress,
                                     std::vector<std::pair<std::string, std::string>>* failed = nullptr);

/// Returns the force (N, by the body) of a fitted brush on a record.
Eigen::VectorXd force_of(const FittedBrush& brush, const FitData& data, Detail detail);

}  // namespace cli
