// Kinds of brush among which a fit chooses, and the blocks of a record's time that are held out, so that
// kinds are chosen and judged by data to which they were not fitted.
#pragma once

#include <string>
#include <vector>

#include "tools/libraries/fitting/fitter.hpp"

namespace cli {

/// Returns for each of the times (s, ascending) whether models are fitted to it, or it is held out to judge
/// them. Fitted are the first `until` seconds or, without that, 16 of 32 blocks of equal time, in the order
/// of Thue and Morse (0110 1001 ...), so that no period of the motion falls into the fitted blocks alone.
std::vector<bool> fitted_blocks(const std::vector<double>& t, std::optional<double> until);

/// Returns the record with the force of the fitted blocks only (`which` false: of the held-out ones). The
/// motion stays whole, because the state of the bristles depends on all motion before.
FitData part_of(const FitData& data, const std::vector<bool>& fitted, bool which = true);

/// One kind of brush, fitted to a record.
struct FittedBrush {
  std::string name;
  FitOptions options;  ///< options of this kind, with the quantiles of a free law
  Found found;
};

/// Fits the kinds of brush that the options allow, the simplest first: the paper's, one with rubbing
/// (residual and shared renewal), the rule slide, the rule slide with a free law. Leaves out a kind that adds
/// nothing to the one before or cannot be fitted; `failed` (may be null) then gets the reason. Throws
/// UserError if no kind can be fitted.
std::vector<FittedBrush> fit_brushes(const FitData& data, const FitOptions& options, Detail detail,
                                     const std::function<void(double)>& progress,
                                     std::vector<std::pair<std::string, std::string>>* failed = nullptr);

/// Returns the friction force (N, by the body) that a fitted brush computes for the motion of a record.
Eigen::VectorXd force_of(const FittedBrush& brush, const FitData& data, Detail detail);

}  // namespace cli
