// Kinds of brush among which a fit chooses, and the blocks of a record's time that are held out, so that
// kinds are chosen and judged by data to which they were not fitted.
#pragma once

#include <string>
#include <vector>

#include "tools/libraries/fitting/fitter.hpp"

namespace cli {

/// Largest number of samples to which a chosen brush is fitted; a longer record is thinned to it.
inline constexpr std::size_t fit_samples = 10000;
/// Least number of samples in the fitted blocks, and in the held-out ones, with which a fit chooses between
/// kinds of brush.
inline constexpr std::size_t fewest_to_choose = 40;

/// Returns the number, 0 to 31, of the block of time in which a sample lies.
unsigned block_of(const FitData& data, std::size_t sample);

/// Returns for each sample of a record whether models are fitted to it, or it is held out to judge them.
/// Fitted are the first `until` seconds or, without that, 16 of 32 blocks of equal time, in the order of Thue
/// and Morse (0110 1001 ...), so that no period of the motion falls into the fitted blocks alone. With
/// `other_half` they are the other 16 and the first block, because the state of the contact at the start
/// shows there alone.
std::vector<bool> fitted_blocks(const FitData& data, std::optional<double> until, bool other_half = false);

/// Returns for each sample the path, m, since the last reversal of the motion (or since the first sample).
std::vector<double> path_since_reversal(const FitData& data);

/// Path since a reversal (m) and speed (m/s) that 1 % of the samples of a part of a record exceed.
struct Reach {
  double stroke = 0.0, speed = 0.0;
  /// Returns whether models fitted to a part of this reach need not extrapolate in a part of the other one.
  bool covers(const Reach& other) const { return other.stroke <= 1.2 * stroke && other.speed <= 1.2 * speed; }
};
Reach reach_of(const FitData& data, const std::vector<bool>& part, bool which);

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

/// Kind of brush that a fit chooses, and the samples that it uses for that.
struct Choice {
  FittedBrush brush;
  FitData thin, moving;  ///< samples for the search, and for the last fit
  /// Whether the kinds of brush were fitted to the other half of the blocks, in which the motion has the
  /// wider range, so that they need not extrapolate.
  bool other_half = false;
  std::vector<FittedBrush> of_part;  ///< kinds of brush as fitted to a part; empty without held-out samples
  std::vector<std::pair<std::string, std::string>> failed;  ///< kinds that cannot be fitted, and the reasons
  /// Fitted values by which samples around reversals are left out; none: all samples are used.
  std::optional<FitValues> cut_by;
  std::string note;  ///< sentence on the errors by which the kind was chosen; may be empty
};

/// Fits the kinds of brush to half of the blocks of a record (or to its first `fit_until` seconds), then
/// those whose error on the other half is nearly the least to all of it. Chooses the simplest of them, unless
/// the error of another one on held-out fifths is clearly less. If the samples do not resolve presliding,
/// fits again without those around reversals. Calls `progress` with the share of the work that is done.
Choice choose_brush(const FitData& data, const FitOptions& options,
                    const std::function<void(double)>& progress);

/// Returns for each sample whether friction there may be anything between its two limits, where presliding is
/// shorter than the moves between samples: the motion reverses there or rests for a single sample, or the
/// samples from there on fall short of the fitted kinetic friction.
std::vector<bool> around_reversals(const FitData& data, const FitValues& fitted);

/// Returns the samples of a record without rests that count in a fit and in judging one, at most `most`; with
/// `cut_by` (see Choice), none around reversals.
FitData samples_that_count(const FitData& moving, std::size_t most, const std::optional<FitValues>& cut_by);

/// Returns the friction force (N, by the body) that a fitted brush computes for the motion of a record.
Eigen::VectorXd force_of(const FittedBrush& brush, const FitData& data, Detail detail);

}  // namespace cli
