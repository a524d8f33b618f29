#include "core/materials/strata.hpp"

#include <algorithm>
#include <cmath>

#include "core/materials/solve.hpp"

namespace bristle::detail {
namespace {

/// Law to be divided into strata, as cells between quantiles, with the integral of p^(1/2) up to each
/// quantile, where p is the density. Strata of equal integrals give the least error.
class Cells {
 public:
  Cells(const SnapLength& law, std::uint32_t count) : law_(law), length_(count + 1), integral_(count + 1) {
    double before = 0.0;
    for (std::uint32_t k = 0; k <= count; ++k) {
      const double u = crowded_share(static_cast<double>(k) / count);
      length_[k] = k == count ? law.longest() : law.quantile(std::clamp(u, 0x1p-52, 1.0 - 0x1p-52));
      if (k > 0) {
        length_[k] = std::min(std::max(length_[k], length_[k - 1]), law.longest());
        // Takes p as constant in the cell: the integral of p^(1/2) over a cell of probability u and width x
        // is then u^(1/2) x^(1/2).
        integral_[k] =
            integral_[k - 1] + std::sqrt(std::max(u - before, 0.0) * (length_[k] - length_[k - 1]));
      }
      before = u;
    }
  }

  double integral() const noexcept { return integral_.back(); }
  double integral_at(double x) const noexcept { return interpolate(length_, integral_, x); }
  double length_at(double integral) const noexcept { return interpolate(integral_, length_, integral); }

  double shorter(double x) const { return 1.0 - law_.survival(x); }          ///< Returns P(l < x).
  double short_moment(double x) const { return law_.partial_moment(1, x); }  ///< Returns E[l; l < x].
  double long_moment(double x) const { return law_.mean() - short_moment(x); }

  /// Finds the length at which a function of the length that does not fall reaches 0.
  template <class Function>
  double find_length(const Function& function) const {
    const double longest = law_.longest();
    return find_zero(function, 0.0, longest, function(0.0), function(longest), {longest * 0x1p-44});
  }

 private:
  static double interpolate(const std::vector<double>& from, const std::vector<double>& to, double x) {
    const auto next = std::upper_bound(from.begin() + 1, from.end() - 1, x) - from.begin();
    const auto k = static_cast<std::size_t>(next);
    const double width = from[k] - from[k - 1];
    const double part = width > 0.0 ? std::clamp((x - from[k - 1]) / width, 0.0, 1.0) : 1.0;
    return to[k - 1] + part * (to[k] - to[k - 1]);
  }

  const SnapLength& law_;
  std::vector<double> length_, integral_;
};

/// Inner ends of the first and the last stratum. The error of the mean deflection (see Strata) is -e at
/// either of them and +e at the length of its stratum.
struct Edges {
  double first, last;  ///< upper end of the first stratum, lower end of the last
  double error;        ///< e, largest error of the mean deflection in first loading, m

  Edges(const SnapLength& law, const Cells& cells, double e) : error(e) {
    const double shortest =
        cells.find_length([&](double x) { return x * cells.shorter(x) - cells.short_moment(x) - e; });
    first =
        cells.find_length([&](double x) { return cells.short_moment(x) - shortest * cells.shorter(x) - e; });
    const double longest =
        cells.find_length([&](double x) { return e - (cells.long_moment(x) - x * law.survival(x)); });
    last =
        cells.find_length([&](double x) { return e - (longest * law.survival(x) - cells.long_moment(x)); });
  }
};

/// Finds the inner ends of the first and the last stratum with which their error e equals that of the n - 2
/// strata between them.
Edges find_edges(const SnapLength& law, const Cells& cells, std::uint32_t n) {
  double low = 0.0, high = law.mean();
  double e = cells.integral() / n;
  e *= e / 16.0;
  for (int i = 0; i < 12; ++i) {
    const Edges edges(law, cells, e);
    const double between = cells.integral_at(edges.last) - cells.integral_at(edges.first);
    const double wanted = between > 0.0 ? between * between / (16.0 * (n - 2.0) * (n - 2.0)) : 0.0;
    if (std::abs(wanted - e) < 1e-3 * e) break;
    (wanted > e ? low : high) = e;
    e = wanted > low && wanted < high ? wanted : 0.5 * (low + high);
  }
  return Edges(law, cells, e);
}

}  // namespace

Strata make_strata(const SnapLength& law, std::uint32_t n) {
  Strata strata;
  strata.length.assign(n, 1.0);
  strata.share.assign(n, 1.0 / n);
  constexpr double negligible_cv = 1e-9;
  if (n == 1 || law.cv() < negligible_cv) return strata;

  const Cells cells(law, std::max(std::uint32_t{4096}, 16 * n));
  const double all = cells.integral();
  double first = 0.0, last = all, error = 0.0;  // values for n = 2: two equal integrals of p^(1/2), no shift
  if (n > 2) {
    const Edges edges = find_edges(law, cells, n);
    first = cells.integral_at(edges.first);
    last = cells.integral_at(edges.last);
    error = edges.error;
  }
  // Share of lengths above the lower end of the stratum in progress, and partial moment of the law there.
  double low = 0.0, above = 1.0, first_moment = 0.0;
  for (std::uint32_t i = 0; i < n; ++i) {
    double high = law.longest(), beyond = 0.0, moment = law.mean();
    if (i + 1 < n) {
      high = std::max(cells.length_at(n > 2 ? first + (last - first) * i / (n - 2.0) : 0.5 * all), low);
      beyond = law.survival(high);
      moment = cells.short_moment(high);
    }
    const double share = std::max(above - beyond, 0.0);
    const double shift = i == 0 ? -error : i + 1 == n ? error : 0.0;
    const double mean = share > 0.0 ? (moment - first_moment + shift) / share : high;
    strata.share[i] = share;
    strata.length[i] = std::clamp(mean, low, high) / law.mean();
    low = high;
    above = beyond;
    first_moment = moment;
  }
  return strata;
}

}  // namespace bristle::detail
