// Computes quantiles of a handful of measured times.
#pragma once

#include <vector>

namespace cli {

/// Returns a quantile, linear between order statistics; 0 for no values.
double quantile(std::vector<double> values, double share);

}  // namespace cli
