// Quantiles of a handful of measured times.
#pragma once

#include <vector>

namespace cli {

/// Linear between order statistics; 0 of nothing.
double quantile(std::vector<double> values, double share);

}  // namespace cli
