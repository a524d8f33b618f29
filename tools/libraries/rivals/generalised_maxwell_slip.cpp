#include "tools/libraries/rivals/generalised_maxwell_slip.hpp"

#include <algorithm>

#include "tools/libraries/rivals/relaxation.hpp"

namespace rivals {

Force GeneralisedMaxwellSlip::step(Pair displacement, double dt_s, double load_n) noexcept {
  if (!(load_n > 0.0)) {
    force = {};
    slips = {};
    return {};
  }
  const Surface& s = surface;
  const double path = length(displacement);
  const Pair e = path > 0.0 ? (1.0 / path) * displacement : Pair{};
  const double steady = s.stribeck_force(path / dt_s, load_n);
  const double rate = attraction_rate * s.kinetic_coefficient * load_n / steady;
  const double k = s.stiffness / elements;
  Pair end, mean;
  for (int i = 0; i < elements; ++i) {
    const double limit = steady * (2 * i + 1) / (elements * elements);
    const auto at = static_cast<std::size_t>(i);
    Pair& f = force[at];
    Pair element_mean = f;
    if (!(path > 0.0)) {
      slips[at] = false;
    } else {
      if (dot(f, e) < 0.0) slips[at] = false;
      double stuck = 0.0;
      Pair bent = f;
      if (!slips[at] && (dot(f, e) < 0.0 || length(f) < limit)) {
        // Finds the path over which the element sticks. An element whose force is above the limit at this
        // speed, but is being unloaded, sticks until the force has fallen below the limit and reached it on
        // the other side. If the force misses the limit, the element sticks until the force stops falling.
        stuck = std::min(path, path_to_limit((1.0 / k) * f, e, limit / k));
        bent = f + k * stuck * e;
      }
      slips[at] = slips[at] || stuck < path;
      const double sliding = path - stuck;
      const Relaxed slid = relax(bent, limit * e, rate * dt_s * sliding / path);
      element_mean = (1.0 / path) * (stuck * (f + 0.5 * k * stuck * e) + sliding * slid.mean);
      f = sliding > 0.0 ? slid.end : bent;
    }
    end = end + f;
    mean = mean + element_mean;
  }
  const Pair viscous = (s.viscous_friction / dt_s) * displacement;
  return {-(end + viscous), -(mean + viscous)};
}

}  // namespace rivals
