// Computes quantiles of a few measured times.
#pragma once

#include <vector>

namespace cli {

/// Returns the quantile `share` of the values, interpolated between sorted values; 0 for no values.
double quantile(std::vector<double> values, double share);

}  // namespace cli
