// `bristle fit --rivals`: brush and rivals fitted to one part of a record and judged on the rest.
#pragma once

#include <string>
#include <vector>

#include "tools/fitting/fit.hpp"

namespace cli {

/// Root mean squares of the residuals, N; NaN where there is no such sample.
struct Residuals3 {
  double all = 0.0;
  double reversal = 0.0;  ///< within twice the presliding length after a turn
  double sliding = 0.0;   ///< beyond
};

struct Judgement {
  std::string model;
  int parameters = 0;  ///< that were fitted, the offset of the sensor among them
  double fitted = 0.0;
  Residuals3 judged;
  std::string values;  ///< in words
  std::string failed;  ///< why there is no fit; empty where there is one
};

struct Judgements {
  double until = 0.0;              ///< s, end of the fitted part
  double presliding_length = 0.0;  ///< m, that tells reversals from sliding
  std::size_t fitted_samples = 0, reversal_samples = 0, sliding_samples = 0;
  std::vector<Judgement> models;
};

/// `until` (s after the first sample). Throws UserError where either part is hopeless.
Judgements judge_rivals(const FitColumns& columns, const FitOptions& options, double until);

std::string judgement_table(const Judgements& judgements);
std::string judgement_json(const FitColumns& columns, const Judgements& judgements);

}  // namespace cli
