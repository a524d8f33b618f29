// Measures cost against the length of the step. It must stay bounded however many snaps a step holds, and
// however the path bends.
#include <cstdio>

#include "hand_scene.hpp"
#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

namespace {

/// Registers the default material on every path of a hand (hand_scene.hpp). On the path that turns, registers
/// the paper's material as well, with either snap rule.
void register_hand_paths() {
  const auto add = [](const std::string& subject, const Material& material, const HandPath& path) {
    for (const double mm_per_s : {0.1, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0}) {
      char text[32];
      std::snprintf(text, sizeof text, "/%gmm_per_s", mm_per_s);
      const std::string name = "hand_path/" + subject + path.name + text;
      add_benchmark(name, [=](benchmark::State& state) {
        auto& scene = keep_while_named<HandScene>(
            name, [&] { return std::make_shared<HandScene>(material, path, mm_per_s); });
        measure(state, HandScene::bristles, 0.0, [&] { return scene.step(); });
        state.SetLabel("rad a step, strokes of 50 steps, load +-10 %");
      });
    }
  };
  for (const HandPath& path : hand_paths) add("", Material::from_coefficients({}), path);
  for (const SnapRule rule : rules()) {
    Material material = Material::from_coefficients(bristle::Coefficients::paper());
    material.snap_rule = rule;
    add(std::string("paper_") + name_of(rule) + '/', material, hand_paths[2]);
  }
}

}  // namespace

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
  register_hand_paths();
}

}  // namespace bristle_bench
