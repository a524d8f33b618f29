// Computes quantiles of a small set of measured times, such as medians over repeats.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace cli {

/// Returns the quantile at level `share` (0 to 1), interpolated between sorted values; 0 for no values.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const double position = share * static_cast<double>(values.size() - 1);
  const auto i = static_cast<std::size_t>(position);
  const double next = values[std::min(i + 1, values.size() - 1)];
  return values[i] + (position - static_cast<double>(i)) * (next - values[i]);
}

/// Median and quartiles of measured values.
struct Quartiles {
  double median = 0.0, low = 0.0, high = 0.0;
};
inline Quartiles quartiles(const std::vector<double>& values) {
  return {quantile(values, 0.5), quantile(values, 0.25), quantile(values, 0.75)};
}
inline Quartiles operator*(double scale, const Quartiles& q) {
  return {scale * q.median, scale * q.low, scale * q.high};
}

}  // namespace cli
