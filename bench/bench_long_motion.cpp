// Cost against the length of the step: it must stay bounded however many snaps a step holds, and however the
// path bends.
#include <cmath>
#include <cstdio>
#include <random>

#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

namespace {

/// How a hand moves.
struct HandPath {
  const char* name;
  double turn, wander;  ///< rad a step, steady and at random
  int stroke;           ///< steps after which the path reverses; 0 = never
  double ripple;        ///< of the load, share of its mean, over 20 steps
};

/// 10,000 representatives of the default material that move as a hand does, at 1 kHz.
class HandScene {
 public:
  HandScene(const HandPath& path, double step_m) : path_(path), step_m_(step_m) {
    motion_.id =
        batch_.add(Material::from_coefficients({}), PatchOptions{}.with_bristles(bristles).with_axes(2));
    batch_.warm_up();
    for (int k = 0; k < 100; ++k) step();
  }

  bristle::StepReport step() {
    ++steps_;
    heading_ += path_.turn + path_.wander * normal_(random_);
    if (path_.stroke > 0 && steps_ % path_.stroke == 0) heading_ += pi;
    motion_.displacement[0] = step_m_ * std::cos(heading_);
    motion_.displacement[1] = step_m_ * std::sin(heading_);
    motion_.normal_load = (1.0 + path_.ripple * std::sin(pi * steps_ / 10.0)) / (1.0 + path_.ripple);
    return batch_.step(tick, {&motion_, 1}, {&response_, 1});
  }

  static constexpr std::uint32_t bristles = 10000;

 private:
  static constexpr double pi = 3.141592653589793;
  PatchBatch batch_;
  HandPath path_;
  double step_m_;
  Motion motion_;
  Response response_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double heading_ = 0.0;
  int steps_ = 0;
};

void register_hand_paths() {
  for (const HandPath& path :
       {HandPath{"straight", 0.0, 0.0, 0, 0.0}, HandPath{"slow_turn", 0.02, 0.0, 0, 0.0},
        HandPath{"turn_0.3", 0.3, 0.0, 0, 0.0}, HandPath{"random_turn", 0.0, 0.1, 0, 0.0},
        HandPath{"strokes", 0.0, 0.0, 50, 0.0}, HandPath{"ripple", 0.0, 0.0, 0, 0.1}}) {
    for (const double mm_per_s : {0.1, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0}) {
      char text[64];
      std::snprintf(text, sizeof text, "hand_path/%s/%gmm_per_s", path.name, mm_per_s);
      const std::string name = text;
      add_benchmark(name, [=](benchmark::State& state) {
        auto& scene = keep_while_named<HandScene>(
            name, [&] { return std::make_shared<HandScene>(path, mm_per_s * 1e-3 * tick); });
        measure(state, HandScene::bristles, 0.0, [&] { return scene.step(); });
        state.SetLabel("default material; rad a step, strokes of 50 steps, load +-10 %");
      });
    }
  }
}

}  // namespace

void register_long_motion() {
  struct Case {
    const char* name;
    SnapRule rule;
    SnapLength law;
  };
  std::vector<Case> cases = {{"keep/uniform", SnapRule::keep, usual_law()}};
  if (!BRISTLE_MINIMAL) {
    cases.push_back({"redraw/uniform", SnapRule::redraw, usual_law()});
    cases.push_back({"redraw/normal_cv0.2", SnapRule::redraw, SnapLength::normal(dbar, 0.2 * dbar)});
    cases.push_back({"redraw/lognormal_cv0.1", SnapRule::redraw, SnapLength::lognormal(dbar, 0.1)});
    cases.push_back({"redraw/lognormal_cv0.3", SnapRule::redraw, SnapLength::lognormal(dbar, 0.3)});
    cases.push_back({"redraw/lognormal_cv1", SnapRule::redraw, SnapLength::lognormal(dbar, 1.0)});
    cases.push_back({"redraw/exponential", SnapRule::redraw, SnapLength::exponential(dbar)});
  }
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
  if (!BRISTLE_MINIMAL) register_hand_paths();
}

}  // namespace bristle_bench
