// Statistics from which the tests compute their tolerances.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

namespace bristle_test {

/// Largest accepted deviation of an estimate from its expectation, in standard deviations. A normal estimate
/// exceeds it with probability 6e-7; with the fixed seeds of the tests the outcome never changes between
/// runs.
constexpr double sigmas = 5.0;

struct Sample {
  double mean = 0.0;
  double variance = 0.0;  ///< unbiased estimate of the sample's variance
  std::size_t size = 0;
  /// Returns the standard error of a sample's mean.
  double error() const { return std::sqrt(variance / static_cast<double>(size)); }
};

inline Sample describe(const std::vector<double>& values) {
  Sample s;
  s.size = values.size();
  for (double v : values) s.mean += v;
  s.mean /= static_cast<double>(s.size);
  for (double v : values) s.variance += (v - s.mean) * (v - s.mean);
  s.variance /= static_cast<double>(s.size - 1);
  return s;
}

/// Returns the Kolmogorov-Smirnov bound: a distance above critical_ks(n, m) has probability 1e-5 or less
/// between two samples of one law. For one sample against a known law pass m = infinity.
inline double critical_ks(double n, double m = INFINITY) {
  const double size = std::isinf(m) ? n : n * m / (n + m);
  return std::sqrt(-0.5 * std::log(0.5 * 1e-5)) / std::sqrt(size);
}

/// Returns the largest distance between the empirical distributions of two samples.
inline double ks_distance(std::vector<double> a, std::vector<double> b) {
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  double worst = 0.0;
  std::size_t i = 0;
  std::size_t k = 0;
  while (i < a.size() && k < b.size()) {
    const double at = std::min(a[i], b[k]);
    while (i < a.size() && a[i] <= at) ++i;
    while (k < b.size() && b[k] <= at) ++k;
    worst = std::max(worst, std::abs(static_cast<double>(i) / static_cast<double>(a.size()) -
                                     static_cast<double>(k) / static_cast<double>(b.size())));
  }
  return worst;
}

/// Returns the largest distance between the empirical distribution of a sample and a continuous law.
inline double ks_distance(std::vector<double> a, const std::function<double(double)>& cdf) {
  std::sort(a.begin(), a.end());
  double worst = 0.0;
  const double n = static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double p = cdf(a[i]);
    worst = std::max(
        {worst, std::abs(p - static_cast<double>(i) / n), std::abs(p - static_cast<double>(i + 1) / n)});
  }
  return worst;
}

/// Returns the relative standard error of a variance estimated from `size` values whose excess kurtosis is
/// `kurtosis`.
inline double error_of_variance(double size, double kurtosis = 0.0) {
  return std::sqrt((2.0 + kurtosis) / size);
}

/// Returns the discrepancy of the first n points of the golden-ratio sequence over all intervals of the
/// circle (so that a shift of the sequence does not matter): the largest difference between the share of
/// points in an interval and its length. About 0.6 ln(n) / n.
inline double golden_discrepancy(std::size_t n) {
  std::vector<double> u(n);
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  for (std::size_t i = 0; i < n; ++i) u[i] = std::fmod(static_cast<double>(i + 1) * golden, 1.0);
  std::sort(u.begin(), u.end());
  double above = 0.0;
  double below = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    above = std::max(above, static_cast<double>(i + 1) / static_cast<double>(n) - u[i]);
    below = std::max(below, u[i] - static_cast<double>(i) / static_cast<double>(n));
  }
  return above + below;
}

}  // namespace bristle_test
