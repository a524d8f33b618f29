#include "tools/libraries/rivals/maxwell_slip.hpp"

#include <algorithm>

#include "tools/libraries/rivals/relaxation.hpp"

namespace rivals {
namespace {

// Lets a spring of length `limit` drag its block while its end moves by `path` along the unit vector
// e. The angle a between spring and e obeys da/ds = -sin(a)/limit, where s is the path.
Relaxed drag(Pair z, Pair e, double limit, double path) noexcept {
  const Pair aside_axis{-e.y, e.x};
  const double ahead = dot(z, e), aside = dot(z, aside_axis);
  const double t0 = aside / (limit + ahead);  // tan(a/2) at the beginning; |a| <= 90 degrees
  const double t1 = t0 * std::exp(-path / limit);
  const auto on_circle = [&](double along, double across) { return along * e + across * aside_axis; };
  const Pair end = on_circle(limit * (1.0 - t1 * t1) / (1.0 + t1 * t1), limit * 2.0 * t1 / (1.0 + t1 * t1));
  if (!(path > 0.0)) return {end, end};
  const double share = limit / path;
  const Pair mean = on_circle(limit * (1.0 - share * std::log((1.0 + t0 * t0) / (1.0 + t1 * t1))),
                              limit * share * 2.0 * (std::atan(t0) - std::atan(t1)));
  return {end, mean};
}

}  // namespace

Force MaxwellSlip::step(Pair displacement, double /*dt_s*/, double load_n) noexcept {
  if (!(load_n > 0.0)) {
    z = {};
    return {};
  }
  const double path = length(displacement);
  const Pair e = path > 0.0 ? (1.0 / path) * displacement : Pair{};
  const double unit = surface.kinetic_coefficient * load_n / surface.stiffness;
  Pair end, mean;
  for (int i = 0; i < elements; ++i) {
    const auto at = static_cast<std::size_t>(i);
    Pair& element = z[at];
    const double limit = unit * slip_length[at], k = surface.stiffness * stiffness_share[at];
    const double size = length(element);
    if (size > limit) element = (limit / size) * element;
    Pair element_mean = element;
    if (path > 0.0) {
      const double stuck = std::min(path, path_to_limit(element, e, limit));
      const Pair bent = element + stuck * e;
      const Relaxed slid = stuck < path ? drag(bent, e, limit, path - stuck) : Relaxed{bent, bent};
      element_mean = (1.0 / path) * (stuck * (element + 0.5 * stuck * e) + (path - stuck) * slid.mean);
      element = slid.end;
    }
    end = end + k * element;
    mean = mean + k * element_mean;
  }
  return {-end, -mean};
}

}  // namespace rivals
