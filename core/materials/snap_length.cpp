// The laws of the snap length: quantiles, moments and partial moments in closed form.
#include "bristle/snap_length.hpp"

#include <algorithm>
#include <iterator>
#include <string>

#include "bristle/fields.hpp"
#include "core/common/assert.hpp"
#include "core/common/range_check.hpp"
#include "core/materials/elementary.hpp"
#include "core/materials/law_at.hpp"

namespace bristle {

using detail::require_within;

namespace {

constexpr double shortest_allowed_m = 1e-12;
constexpr double longest_allowed_m = 1e3;
// Probability whose quantile longest() returns, for laws without an upper bound.
constexpr double longest_share = 1.0 - 0x1p-24;
constexpr double root_of_three = 1.7320508075688772;

double whole_power(double x, int k) noexcept {
  double power = 1.0;
  for (int i = 0; i < k; ++i) power *= x;
  return power;
}

/// Returns E[delta^k; delta < x] of the uniform law on [a, b], a < b. Factors differences of powers, so that
/// nothing cancels: x^(k+1) - a^(k+1) = (x - a) (x^k + x^(k-1) a + ... + a^k).
double uniform_partial_moment(int k, double a, double b, double x) noexcept {
  if (x <= a) return 0.0;
  x = std::min(x, b);
  double sum = 0.0;
  for (int j = 0; j <= k; ++j) sum = sum * x + whole_power(a, j);
  return (x - a) / (b - a) * sum / (k + 1);
}

double uniform_mean(double a, double b) noexcept { return 0.5 * (a + b); }
double uniform_cv(double a, double b) noexcept {
  return (b - a) / (2.0 * root_of_three * uniform_mean(a, b));
}

/// Returns E[delta^k; delta < x] of one segment [a, b] of a table. A segment with a = b is an atom: one
/// length that has a probability of its own.
double segment_partial_moment(int k, double a, double b, double x) noexcept {
  if (a == b) return a < x ? whole_power(a, k) : 0.0;
  return uniform_partial_moment(k, a, b, x);
}

/// Normal law without negative lengths: delta = mean + deviation z, given z > -mean / deviation.
struct CutNormal {
  double mean, deviation;
  double cut;   // position of the cut in standard deviations, -mean / deviation
  double kept;  // share of the uncut law that is kept, P(z > cut)
  double edge;  // density of the cut law at the cut, in units of 1 / deviation (an edge term of its moments)

  CutNormal(double mean_m, double deviation_m) noexcept
      : mean(mean_m),
        deviation(deviation_m),
        cut(-mean_m / deviation_m),
        kept(detail::normal_cdf(-cut)),
        edge(detail::normal_density(cut) / kept) {}

  double standard(double x) const noexcept { return (x - mean) / deviation; }

  double quantile(double u) const noexcept {
    // Computes the quantile in the smaller of the two tails, so that neither loses digits. Measured from
    // below, the share is u0 + u (1 - u0), with u0 the share that is cut off.
    const double below = (1.0 - kept) + u * kept;
    const double z = below < 0.5 ? detail::normal_quantile(detail::normal_cdf(cut) + u * kept)
                                 : -detail::normal_quantile((1.0 - u) * kept);
    // Returns at least a tiny length. At the smallest u rounding could give 0, and a bristle of length 0
    // would snap without end.
    return std::max(mean + deviation * z, mean * 0x1p-60);
  }

  double moment(int k) const noexcept {
    // Integrates by parts. The moments obey M(k) = mean M(k-1) + (k-1) deviation^2 M(k-2), with an edge term
    // at k = 1.
    double before = 0.0, last = 1.0;
    for (int j = 1; j <= k; ++j) {
      const double next =
          mean * last + (j - 1) * deviation * deviation * before + (j == 1 ? deviation * edge : 0.0);
      before = last;
      last = next;
    }
    return last;
  }

  double partial_moment(int k, double x) const noexcept {
    const double z = standard(x);
    const double density = detail::normal_density(z) / kept;
    // Takes the difference of distribution functions in the tail in which they are smaller, where it keeps
    // more digits.
    const double p0 =
        (z < 0.0 ? detail::normal_cdf(z) - detail::normal_cdf(cut) : kept - detail::normal_cdf(-z)) / kept;
    if (k == 0) return std::max(p0, 0.0);
    const double p1 = mean * p0 + deviation * (edge - density);
    if (k == 1) return std::max(p1, 0.0);
    return std::max(mean * p1 + deviation * deviation * p0 - deviation * x * density, 0.0);
  }
};

/// Returns log(x / reference). It loses no digits where the two are close.
double log_ratio(double x, double reference) noexcept {
  if (x > 0.5 * reference && x < 2.0 * reference) return detail::log1p((x - reference) / reference);
  return detail::log(x / reference);
}

/// Lognormal law of the snap length, given by mean and coefficient of variation.
struct Lognormal {
  double mean, cv, s;  // s, standard deviation of log(delta)

  Lognormal(double mean_m, double cv_) noexcept
      : mean(mean_m), cv(cv_), s(detail::square_root(detail::log1p(cv_ * cv_))) {}

  double quantile(double u) const noexcept {
    return mean * detail::exp(s * detail::normal_quantile(u) - 0.5 * s * s);
  }
  /// Returns the z with which E[delta^k; delta < x] is moment(k) normal_cdf(z).
  double standard(int k, double x) const noexcept { return standard_of(k, log_ratio(x, mean)); }
  double standard_of(int k, double log_x) const noexcept { return (log_x + (0.5 - k) * s * s) / s; }
  double moment(int k) const noexcept {
    return whole_power(mean, k) * whole_power(1.0 + cv * cv, k * (k - 1) / 2);
  }
};

/// Returns E[t^k; t < x] of the exponential law of mean 1.
double unit_exponential_partial_moment(int k, double x) noexcept {
  // Sums a series for small x, where the terms of the closed form k! (1 - exp(-x) (1 + x + ... + x^k/k!))
  // cancel.
  const double factorial = k == 2 ? 2.0 : 1.0;
  double term = 1.0;
  if (x > 2.0) {
    double sum = 1.0;
    for (int j = 1; j <= k; ++j) sum += (term *= x / j);
    return factorial * (1.0 - detail::exp(-x) * sum);
  }
  for (int j = 1; j <= k; ++j) term *= x / j;
  double sum = 0.0;
  for (int j = k + 1; j <= k + 40; ++j) {
    term *= x / j;
    sum += term;
    if (term < 1e-18 * sum) break;
  }
  return factorial * detail::exp(-x) * sum;
}

}  // namespace

const char* to_string(SnapLaw law) noexcept {
  const auto index = static_cast<std::size_t>(law);
  return index < std::size(snap_law_names) ? snap_law_names[index] : "unknown";
}

SnapLength::SnapLength(SnapLaw law, double first, double second, double mean, double cv,
                       double longest) noexcept
    : law_(law), a_(first), b_(second), mean_(mean), cv_(cv), longest_(longest), table_{} {}

SnapLength::SnapLength() noexcept
    : SnapLength(SnapLaw::uniform, 5e-6, 15e-6, uniform_mean(5e-6, 15e-6), uniform_cv(5e-6, 15e-6), 15e-6) {}

SnapLength SnapLength::single(double length_m) {
  require_within("SnapLength::single", "length_m", length_m, shortest_allowed_m, longest_allowed_m, "m");
  return {SnapLaw::single, length_m, 0.0, length_m, 0.0, length_m};
}

SnapLength SnapLength::uniform(double min_m, double max_m) {
  require_within("SnapLength::uniform", "max_m", max_m, shortest_allowed_m, longest_allowed_m, "m");
  require_within("SnapLength::uniform", "min_m", min_m, 0.0, max_m, "m (max_m)");
  if (min_m == max_m) return single(max_m);
  return {SnapLaw::uniform, min_m, max_m, uniform_mean(min_m, max_m), uniform_cv(min_m, max_m), max_m};
}

SnapLength SnapLength::normal(double mean_m, double deviation_m) {
  require_within("SnapLength::normal", "mean_m", mean_m, shortest_allowed_m, longest_allowed_m, "m");
  require_within("SnapLength::normal", "deviation_m", deviation_m, 0.0, mean_m, "m (mean_m)");
  // Returns the single length if the deviation is so small that adding it to the mean changes nothing in
  // double.
  if (mean_m + deviation_m == mean_m) return single(mean_m);
  const CutNormal law(mean_m, deviation_m);
  const double mean = law.moment(1), longest = law.quantile(longest_share);
  // The variance of the cut law, over deviation^2, is 1 + cut edge - edge^2.
  const double cv = deviation_m * detail::square_root(1.0 + (law.cut - law.edge) * law.edge) / mean;
  BRISTLE_ASSERT(0.0 < mean && mean < longest && cv > 0.0);
  return {SnapLaw::normal, mean_m, deviation_m, mean, cv, longest};
}

SnapLength SnapLength::lognormal(double mean_m, double cv) {
  require_within("SnapLength::lognormal", "mean_m", mean_m, shortest_allowed_m, longest_allowed_m, "m");
  require_within("SnapLength::lognormal", "cv", cv, 0.0, 3.0);
  if (1.0 + cv == 1.0) return single(mean_m);
  const double longest = Lognormal(mean_m, cv).quantile(longest_share);
  BRISTLE_ASSERT(mean_m <= longest);
  return {SnapLaw::lognormal, mean_m, cv, mean_m, cv, longest};
}

SnapLength SnapLength::exponential(double mean_m) {
  require_within("SnapLength::exponential", "mean_m", mean_m, shortest_allowed_m, longest_allowed_m, "m");
  return {SnapLaw::exponential, mean_m, 0.0, mean_m, 1.0, -mean_m * detail::log1p(-longest_share)};
}

SnapLength SnapLength::table(Span<const double> quantiles_m) {
  const char* const where = "SnapLength::table";
  const std::size_t size = quantiles_m.size();
  require_within(where, "number of quantiles_m", static_cast<double>(size), 2, max_table_size);
  for (std::size_t i = 0; i < size; ++i) {
    const std::string name = "quantiles_m[" + std::to_string(i) + "]";
    // Allows the length 0 only as the first value of a table: a share of bristles of length 0 would snap
    // without end.
    const double low = i == 0 ? 0.0 : i == 1 ? shortest_allowed_m : quantiles_m[i - 1];
    require_within(where, name, quantiles_m[i], std::max(low, i > 0 ? quantiles_m[i - 1] : 0.0),
                   longest_allowed_m, "m, ascending");
  }
  if (quantiles_m[0] == quantiles_m[size - 1]) return single(quantiles_m[0]);
  SnapLength result;
  result.law_ = SnapLaw::table;
  result.a_ = quantiles_m[0];
  result.b_ = quantiles_m[size - 1];
  result.table_size_ = static_cast<int>(size);
  std::copy(quantiles_m.begin(), quantiles_m.end(), result.table_);
  result.longest_ = result.b_;
  result.mean_ = result.moment(1);
  require_within(where, "largest over mean", result.longest_ / result.mean_, 1.0, 1000.0);
  double variance = 0.0;
  for (std::size_t i = 0; i + 1 < size; ++i) {
    const double middle = 0.5 * (quantiles_m[i] + quantiles_m[i + 1]);
    variance +=
        detail::square(middle - result.mean_) + detail::square(quantiles_m[i + 1] - quantiles_m[i]) / 12.0;
  }
  BRISTLE_ASSERT(variance >= 0.0);
  result.cv_ = detail::square_root(variance / static_cast<double>(size - 1)) / result.mean_;
  return result;
}

double SnapLength::moment(int k) const {
  require_within("SnapLength::moment", "k", k, 0, 6);
  switch (law_) {
    case SnapLaw::single:
      return whole_power(a_, k);
    case SnapLaw::uniform:
      return uniform_partial_moment(k, a_, b_, b_);
    case SnapLaw::normal:
      return CutNormal(a_, b_).moment(k);
    case SnapLaw::lognormal:
      return Lognormal(a_, b_).moment(k);
    case SnapLaw::exponential: {
      double moment = 1.0;
      for (int j = 1; j <= k; ++j) moment *= j * a_;
      return moment;
    }
    case SnapLaw::table:
      break;
  }
  double sum = 0.0;
  for (int i = 0; i + 1 < table_size_; ++i)
    sum += segment_partial_moment(k, table_[i], table_[i + 1], detail::infinity);
  return sum / (table_size_ - 1);
}

double SnapLength::quantile(double u) const {
  if (!(u > 0.0 && u < 1.0)) detail::refuse("SnapLength::quantile", "u", u, "above 0 and below 1");
  switch (law_) {
    case SnapLaw::single:
      return a_;
    case SnapLaw::uniform:
      return std::min(a_ + (b_ - a_) * u, b_);
    case SnapLaw::normal:
      return CutNormal(a_, b_).quantile(u);
    case SnapLaw::lognormal:
      return Lognormal(a_, b_).quantile(u);
    case SnapLaw::exponential:
      return -a_ * detail::log1p(-u);
    case SnapLaw::table:
      break;
  }
  const double position = u * (table_size_ - 1);
  const int i = std::min(static_cast<int>(position), table_size_ - 2);
  return std::min(table_[i] + (table_[i + 1] - table_[i]) * (position - i), table_[i + 1]);
}

double SnapLength::survival(double x_m) const {
  if (x_m != x_m) return x_m;
  if (x_m < 0.0) return 1.0;
  switch (law_) {
    case SnapLaw::single:
      return a_ > x_m ? 1.0 : 0.0;
    case SnapLaw::uniform:
      return x_m <= a_ ? 1.0 : x_m >= b_ ? 0.0 : (b_ - x_m) / (b_ - a_);
    case SnapLaw::normal: {
      const CutNormal law(a_, b_);
      return std::min(detail::normal_cdf(-law.standard(x_m)) / law.kept, 1.0);
    }
    case SnapLaw::lognormal:
      return x_m == 0.0 ? 1.0 : detail::normal_cdf(-Lognormal(a_, b_).standard(0, x_m));
    case SnapLaw::exponential:
      return detail::exp(-x_m / a_);
    case SnapLaw::table:
      break;
  }
  double sum = 0.0;
  for (int i = 0; i + 1 < table_size_; ++i) {
    const double a = table_[i], b = table_[i + 1];
    if (a > x_m) {
      sum += 1.0;
    } else if (b > x_m) {
      sum += (b - x_m) / (b - a);
    }
  }
  return sum / (table_size_ - 1);
}

double SnapLength::partial_moment(int k, double x_m) const {
  require_within("SnapLength::partial_moment", "k", k, 0, 2);
  if (x_m != x_m) return x_m;
  if (x_m <= 0.0) return 0.0;
  if (x_m == detail::infinity) return moment(k);
  switch (law_) {
    case SnapLaw::single:
      return segment_partial_moment(k, a_, a_, x_m);
    case SnapLaw::uniform:
      return uniform_partial_moment(k, a_, b_, x_m);
    case SnapLaw::normal:
      return CutNormal(a_, b_).partial_moment(k, x_m);
    case SnapLaw::lognormal: {
      const Lognormal law(a_, b_);
      return law.moment(k) * detail::normal_cdf(law.standard(k, x_m));
    }
    case SnapLaw::exponential:
      return whole_power(a_, k) * unit_exponential_partial_moment(k, x_m / a_);
    case SnapLaw::table:
      break;
  }
  double sum = 0.0;
  for (int i = 0; i + 1 < table_size_; ++i) sum += segment_partial_moment(k, table_[i], table_[i + 1], x_m);
  return sum / (table_size_ - 1);
}

namespace detail {
namespace {

constexpr std::size_t at_a_time = 8;

void read_lognormal(const Lognormal& law, const double* lengths, std::size_t count, LawAt* at) {
  double z[2 * at_a_time] = {}, size[2 * at_a_time], tail[2 * at_a_time];
  for (std::size_t i = 0; i < count; ++i) {
    const double log_x = log_ratio(lengths[i], law.mean);
    for (std::size_t k = 0; k < 2; ++k) z[2 * i + k] = law.standard_of(static_cast<int>(k), log_x);
  }
  for (std::size_t i = 0; i < 2 * at_a_time; ++i) size[i] = magnitude(z[i]);
  normal_upper_tails(size, tail);
  const auto below = [&](std::size_t i) { return z[i] < 0.0 ? tail[i] : 1.0 - tail[i]; };
  for (std::size_t i = 0; i < count; ++i)
    at[i] = {below(2 * i), law.mean * below(2 * i + 1), z[2 * i] > 0.0 ? tail[2 * i] : 1.0 - tail[2 * i]};
}

}  // namespace

void read_law(const SnapLength& law, Span<const double> lengths_m, Span<LawAt> at) {
  BRISTLE_ASSERT(lengths_m.size() == at.size());
  if (law.law() == SnapLaw::lognormal) {
    const Lognormal lognormal(law.first_parameter(), law.second_parameter());
    for (std::size_t i = 0; i < at.size(); i += at_a_time)
      read_lognormal(lognormal, lengths_m.data() + i, std::min(at_a_time, at.size() - i), at.data() + i);
    return;
  }
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double x = lengths_m[i];
    at[i] = {law.partial_moment(0, x), law.partial_moment(1, x), law.survival(x)};
  }
}

}  // namespace detail

bool operator==(const SnapLength& x, const SnapLength& y) noexcept {
  return x.law_ == y.law_ && x.a_ == y.a_ && x.b_ == y.b_ && x.table_size_ == y.table_size_ &&
         std::equal(x.table_, x.table_ + x.table_size_, y.table_);
}

}  // namespace bristle
