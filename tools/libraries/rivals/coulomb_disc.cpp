#include "tools/libraries/rivals/coulomb_disc.hpp"

#include <cmath>

namespace rivals {

DiscFriction coulomb_disc(double eps) noexcept {
  const double e2 = eps * eps;
  // Uses series for small and large eps, because the terms of the closed forms cancel there.
  if (eps < 1e-3) return {eps * (1.0 - 0.125 * e2), 2.0 / 3.0 * (1.0 - 0.75 * e2)};
  if (eps > 100.0) return {1.0 - 0.125 / e2, 0.25 / eps * (1.0 + 1.0 / (12.0 * e2))};
  if (eps == 1.0) return {8.0 / (3.0 * M_PI), 8.0 / (9.0 * M_PI)};
  const double modulus = eps < 1.0 ? eps : 1.0 / eps;
  const double k = std::comp_ellint_1(modulus), e = std::comp_ellint_2(modulus);
  if (eps < 1.0)
    return {4.0 / (3.0 * M_PI * eps) * ((e2 + 1.0) * e + (e2 - 1.0) * k),
            4.0 / (9.0 * M_PI) * ((4.0 - 2.0 * e2) * e + (e2 - 1.0) * k)};
  return {4.0 / (3.0 * M_PI) * ((e2 + 1.0) * e - (e2 - 1.0) * k),
          4.0 * eps / (9.0 * M_PI) * ((4.0 - 2.0 * e2) * e + (2.0 * e2 - 5.0 + 3.0 / e2) * k)};
}

}  // namespace rivals
