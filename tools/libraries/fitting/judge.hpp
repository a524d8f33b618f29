// Compares the brush with rival friction models (`bristle fit --rivals`): fits all to the same blocks of
// time, half of the record, and compares their errors on the rest.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/libraries/fitting/brushes.hpp"

namespace cli {

/// Rms residuals (N) of a model: on all samples, on those soon after a reversal, and on those far from
/// reversals; NaN where there are no such samples.
struct Residuals3 {
  double all = 0.0;
  double reversal = 0.0;  ///< rms residual within two presliding lengths after a reversal, N
  double sliding = 0.0;   ///< rms residual farther than two presliding lengths after a reversal, N
};

/// Sums of squared errors (N^2) of judged samples, by the number of the block of time.
using BlockSquares = std::map<unsigned, double>;

struct Judgement {
  std::string model;
  int parameters = 0;  ///< number of fitted parameters, including the sensor's offset
  double fitted = 0.0;
  Residuals3 judged;
  std::string values;                                ///< fitted parameters, as text
  std::string failed;                                ///< reason why no fit was possible; empty if fitted
  BlockSquares squares = {}, reversal_squares = {};  ///< of all judged samples, and of those after reversals
};

struct Judgements {
  std::optional<double> until;  ///< end of the part to which models are fitted, s; none: blocks of time
  double presliding_length =
      0.0;  ///< presliding length, m; up to twice it after a reversal counts as reversal
  std::size_t fitted_samples = 0, reversal_samples = 0, sliding_samples = 0;
  /// Number of samples around reversals that are neither fitted nor judged, as a plain fit leaves them out
  /// too.
  std::size_t left_out = 0;
  int held_out_blocks = 16;  ///< of 32, unless `until` is given
  Reach fitted, judged;      ///< of the fitted and of the judged part
  std::vector<Judgement> models;
  std::vector<ModelForce> rivals;  ///< forces of the models other than brushes, on the whole record

  /// Returns whether the judged part lies within the range of the fitted one. Beyond it models extrapolate,
  /// and no verdict is given.
  bool within_range() const { return fitted.covers(judged); }
};

/// Fits brushes and rival friction models to blocks of the record (or to its first `fit_until` seconds), and
/// computes their errors on the rest. Throws UserError if either part determines no parameter.
Judgements judge_rivals(const FitColumns& columns, const FitOptions& options);

std::string judgement_table(const Judgements& judgements);
std::string judgement_json(const FitColumns& columns, const Judgements& judgements);

}  // namespace cli
