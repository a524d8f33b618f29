// Computes quantiles of a small set of measured times.
#pragma once

#include <vector>

namespace cli {

/// Returns the quantile at level `share` (0 to 1), interpolated between sorted values; 0 for no values.
double quantile(std::vector<double> values, double share);

}  // namespace cli
