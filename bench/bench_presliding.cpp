// Measures steps in presliding, in which few bristles snap: their cost by the length of a step, and the share
// of bristles that are visited. The patch moves one way, after sliding. In steps shorter than a snap length
// only blocks with a bristle near its snap should be visited.
#include <cstdio>

#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

void register_presliding() {
  for (SnapRule rule : rules()) {
    for (bool eager : {false, true}) {
      for (double step : {1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0}) {
        char text[32];
        std::snprintf(text, sizeof text, "%g", step);
        OnePatchCase what;
        what.regime = {"", step, false, "one way, step over mean snap length last in the name"};
        what.rule = rule;
        what.outputs = Outputs::end;
        what.bristles = 262144;
        what.eager = eager;
        add_one_patch_benchmark(
            std::string("presliding/") + name_of(rule) + (eager ? "/eager/" : "/skipping/") + text, what);
      }
    }
  }
}

}  // namespace bristle_bench
