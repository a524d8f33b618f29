// Measures cost against the length of the step. It must stay bounded however many snaps a step holds.
#include <cstdio>

#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

void register_long_motion() {
  struct Case {
    const char* name;
    SnapRule rule;
    SnapLength law;
  };
  const Case cases[] = {{"keep/uniform", SnapRule::keep, usual_law()},
                        {"redraw/uniform", SnapRule::redraw, usual_law()},
                        {"redraw/normal_cv0.2", SnapRule::redraw, SnapLength::normal(dbar, 0.2 * dbar)},
                        {"redraw/lognormal_cv0.1", SnapRule::redraw, SnapLength::lognormal(dbar, 0.1)},
                        {"redraw/lognormal_cv0.3", SnapRule::redraw, SnapLength::lognormal(dbar, 0.3)},
                        {"redraw/lognormal_cv1", SnapRule::redraw, SnapLength::lognormal(dbar, 1.0)},
                        {"redraw/exponential", SnapRule::redraw, SnapLength::exponential(dbar)}};
  const double steps[] = {1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.03, 0.1,   0.3,   0.5, 1.0, 1.5, 2.0,
                          3.0,  5.0,  7.0,  10.0, 20.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4};
  for (const Case& each : cases) {
    for (double step : steps) {
      char text[32];
      std::snprintf(text, sizeof text, "%g", step);
      OnePatchCase what;
      what.regime = {"", step, false, "one way, step over mean snap length last in the name"};
      what.rule = each.rule;
      what.law = each.law;
      add_one_patch_benchmark(std::string("long_motion/") + each.name + '/' + text, what);
    }
  }
}

}  // namespace bristle_bench
