// The law of the snap length delta: the deflection, beyond the residual length, at which a bristle snaps
// (paper, section 2.1).
#pragma once

#include "bristle/export.hpp"
#include "bristle/span.hpp"

namespace bristle {

enum class SnapLaw : unsigned char { single, uniform, normal, lognormal, exponential, table };

/// Returns the name of a law as scenes spell it: "single", "uniform", ... The text lives for ever.
BRISTLE_API const char* to_string(SnapLaw law) noexcept;

/// Distribution of the snap length, lengths in metres. Plain data: copy freely, compare with ==. Arguments
/// out of range throw bristle::Error with the parameter, its value and the allowed range. Lengths are within
/// 1e-12 to 1e3 m; a deviation, and the lower end of `uniform` or of a table, may be less, down to 0. Every
/// function gives the same bits on every machine (no libm transcendental), and several threads may call it.
class BRISTLE_API SnapLength {
 public:
  /// Largest number of values that `table` accepts.
  static constexpr int max_table_size = 257;

  /// Makes a law with a single length: every bristle has the snap length `length_m`.
  static SnapLength single(double length_m);
  /// Makes a uniform law on [min_m, max_m], min_m >= 0.
  static SnapLength uniform(double min_m, double max_m);
  /// Makes a normal law cut at 0 (negative lengths do not occur). `mean_m` and `deviation_m` are those of
  /// the uncut law; mean() and cv() are those of the cut law. deviation_m <= mean_m.
  static SnapLength normal(double mean_m, double deviation_m);
  /// Makes a lognormal law with the given mean and coefficient of variation, 0 <= cv <= 3.
  static SnapLength lognormal(double mean_m, double cv);
  /// Makes an exponential law with this mean, m.
  static SnapLength exponential(double mean_m);
  /// Makes a law from a table of 2 to 257 ascending quantiles, at the probabilities 0, 1/(n-1), ..., 1 and
  /// linear in between.
  static SnapLength table(Span<const double> quantiles_m);

  SnapLaw law() const noexcept { return law_; }
  /// Returns the mean E[delta], m.
  double mean() const noexcept { return mean_; }
  /// Returns the moment E[delta^k], m^k, k = 0..6. Closed form except for the cut normal law (recurrence).
  double moment(int k) const;
  /// Returns the coefficient of variation: standard deviation over mean.
  double cv() const noexcept { return cv_; }
  /// Returns the largest length that the library samples, m: the upper bound of the law, or its quantile at 1
  /// - 2^-24.
  double longest() const noexcept { return longest_; }
  /// Returns Q(u): the length below which a share u of the bristles lies, m. 0 < u < 1.
  double quantile(double u) const;
  /// Returns P(delta > x), the share of longer lengths. x in m.
  double survival(double x_m) const;
  /// Returns the partial moment E[delta^k; delta < x], k = 0..2. x in m.
  double partial_moment(int k, double x_m) const;

  /// Returns the first parameter as given to the factory, in the factory's order. second_parameter() is 0 if
  /// the law has only one.
  double first_parameter() const noexcept { return a_; }
  double second_parameter() const noexcept { return b_; }
  Span<const double> table_values() const noexcept { return {table_, static_cast<std::size_t>(table_size_)}; }

  friend BRISTLE_API bool operator==(const SnapLength& x, const SnapLength& y) noexcept;
  friend bool operator!=(const SnapLength& x, const SnapLength& y) noexcept { return !(x == y); }

  /// Makes a uniform law between 5 and 15 um.
  SnapLength() noexcept;

 private:
  SnapLength(SnapLaw law, double first, double second, double mean, double cv, double longest) noexcept;

  SnapLaw law_;
  double a_, b_;
  double mean_, cv_, longest_;
  int table_size_ = 0;
  double table_[max_table_size];
};

}  // namespace bristle
