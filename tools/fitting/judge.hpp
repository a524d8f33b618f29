// Fits the brush and other friction models to one part of a record and judges them on the rest: `bristle fit
// --rivals`.
#pragma once

#include <string>
#include <vector>

#include "tools/fitting/fit.hpp"

namespace cli {

/// Root mean square residuals, N, of all samples and of kinds of them; NaN where there is no such sample.
struct Residuals3 {
  double all = 0.0;
  double reversal = 0.0;  ///< rms residual within a path of twice the presliding length after a turn
  double sliding = 0.0;   ///< rms residual farther from a turn
};

struct Judgement {
  std::string model;
  int parameters = 0;  ///< number of fitted parameters, the sensor's offset included
  double fitted = 0.0;
  Residuals3 judged;
  std::string values;  ///< values of the fitted parameters, in words
  std::string failed;  ///< reason why the model could not be fitted; else empty
};

struct Judgements {
  double until = 0.0;              ///< s, end of the part of the record to which models are fitted
  double presliding_length = 0.0;  ///< m; residuals within twice this path after a turn count as reversal
  std::size_t fitted_samples = 0, reversal_samples = 0, sliding_samples = 0;
  std::vector<Judgement> models;
};

/// Fits the brush and other friction models to the record up to `until` (s after the first sample), and
/// judges all on the rest. Throws UserError where either part determines nothing.
Judgements judge_rivals(const FitColumns& columns, const FitOptions& options, double until);

std::string judgement_table(const Judgements& judgements);
std::string judgement_json(const FitColumns& columns, const Judgements& judgements);

}  // namespace cli
