#include "tools/libraries/scene/snap_law.hpp"

#include <cmath>

namespace cli {

using bristle::SnapLaw;
using bristle::SnapLength;
using bristle::SnapRule;

SnapLength make_snap_length(SnapLaw family, double mean_m, double spread) {
  switch (family) {
    case SnapLaw::single:
      return SnapLength::single(mean_m);
    case SnapLaw::uniform: {
      const double half_width = std::sqrt(3.0) * spread;
      return SnapLength::uniform(mean_m * (1.0 - half_width), mean_m * (1.0 + half_width));
    }
    case SnapLaw::normal: {
      // Ratio by which cutting a normal law at 0 raises its mean. The uncut law gets a mean that is smaller
      // by it.
      const double raised = SnapLength::normal(1.0, spread).mean();
      return SnapLength::normal(mean_m / raised, spread * mean_m / raised);
    }
    case SnapLaw::exponential:
      return SnapLength::exponential(mean_m);
    default:
      return SnapLength::lognormal(mean_m, spread);
  }
}

double largest_spread(SnapLaw family, SnapRule rule) {
  switch (family) {
    case SnapLaw::uniform:
      return 0.57735;  // standard deviation over mean of a uniform law that begins at 0
    case SnapLaw::normal:
    case SnapLaw::exponential:
      return 1.0;
    default:
      return rule == SnapRule::redraw ? widest_redraw_cv : widest_cv;
  }
}

double kinetic_bend(SnapRule rule, double cv) {
  return rule == SnapRule::slide ? 1.0 : rule == SnapRule::keep ? 0.5 : 0.5 * (1.0 + cv * cv);
}

}  // namespace cli
