#include "core/materials/strata.hpp"

#include <algorithm>

#include "core/materials/elementary.hpp"

namespace bristle::detail {
namespace {

/// Points of the law close to each other towards both ends.
double share_at(double t) noexcept { return t * t * t * (10.0 - 15.0 * t + 6.0 * t * t); }

double cube_root(double x) noexcept { return x > 0.0 ? exp(log(x) / 3.0) : 0.0; }

}  // namespace

Strata make_strata(const SnapLength& law, std::uint32_t n) {
  Strata strata;
  strata.length.assign(n, 1.0);
  strata.share.assign(n, 1.0 / n);
  constexpr double negligible_cv = 1e-9;
  if (n == 1 || law.cv() < negligible_cv) return strata;

  // The integral of p^(1/3) over a cell of probability u and width x is u^(1/3) x^(2/3).
  const auto cells = std::max(std::uint32_t{4096}, 16 * n);
  std::vector<double> length(cells + 1), integral(cells + 1);
  double before = 0.0;
  for (std::uint32_t k = 0; k <= cells; ++k) {
    const double u = share_at(static_cast<double>(k) / cells);
    length[k] = k == 0       ? law.quantile(0x1p-52)
                : k == cells ? law.longest()
                             : law.quantile(std::clamp(u, 0x1p-52, 1.0 - 0x1p-52));
    if (k > 0) {
      length[k] = std::min(std::max(length[k], length[k - 1]), law.longest());
      const double width = cube_root(length[k] - length[k - 1]);
      integral[k] = integral[k - 1] + cube_root(u - before) * width * width;
    }
    before = u;
  }

  double low = 0.0, above = 1.0, first_moment = 0.0;  // of the stratum's lower end
  std::uint32_t k = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    double high = law.longest(), beyond = 0.0, moment = law.mean();
    if (i + 1 < n) {
      const double wanted = integral[cells] * (static_cast<double>(i + 1) / n);
      while (k + 1 < cells && integral[k + 1] < wanted) ++k;
      const double cell = integral[k + 1] - integral[k];
      const double part = cell > 0.0 ? std::clamp((wanted - integral[k]) / cell, 0.0, 1.0) : 1.0;
      high = std::max(length[k] + part * (length[k + 1] - length[k]), low);
      beyond = law.survival(high);
      moment = law.partial_moment(1, high);
    }
    const double share = std::max(above - beyond, 0.0);
    const double mean = share > 0.0 ? (moment - first_moment) / share : high;
    strata.share[i] = share;
    strata.length[i] = std::clamp(mean, low, high) / law.mean();
    low = high;
    above = beyond;
    first_moment = moment;
  }
  return strata;
}

}  // namespace bristle::detail
