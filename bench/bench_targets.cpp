// The speed targets of the library, one by one: the same scenes as the table of `bristle capacity --targets`,
// which takes ratios interleaved and says what is met. The limit is in the label.
#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

namespace {

constexpr Regime few_snap = {"few_snap", 0.003, false, "0.003 dbar a step one way"};
constexpr Regime tremor = {"tremor", 0.05, true, "+-0.05 dbar in turn, after sliding"};
constexpr Regime within_bound = {"within_bound", 1e-4, true, "+-0.0001 dbar in turn"};

void add_target(const std::string& name, const char* limit, OnePatchCase what, Regime regime,
                std::uint32_t bristles) {
  what.regime = regime;
  what.bristles = bristles;
  static std::vector<std::shared_ptr<std::string>>
      labels;  // Google Benchmark takes text, the regime a pointer
  labels.push_back(std::make_shared<std::string>(std::string(regime.motion) + "; target: " + limit));
  what.regime.motion = labels.back()->c_str();
  add_one_patch_benchmark("target/" + name, what);
}

OnePatchCase keep_end() {
  OnePatchCase what;
  what.outputs = Outputs::end;
  return what;
}

OnePatchCase redraw_mean() {
  OnePatchCase what;
  what.rule = SnapRule::redraw;
  return what;
}

void add_patches(const std::string& name, const char* limit, const Regime& regime, Outputs outputs,
                 int threads) {
  add_benchmark("target/" + name, [=, &regime](benchmark::State& state) {
    auto& scene = keep_while_named<MeasuredScene>(name, [&] {
      auto made = std::make_shared<MeasuredScene>(BatchOptions{}.with_threads(threads));
      for (std::uint32_t i = 0; i < 10000; ++i)
        made->add(plain_material(usual_law(), SnapRule::keep),
                  plain_options(100, usual_axes, Precision::single, outputs).with_seed(i + 1), regime);
      made->settle();
      return made;
    });
    measure(state, scene.bristles(), 0.0, [&] { return scene.step(); });
    state.SetLabel(std::string(regime.motion) + "; target: " + limit);
  });
}

void register_one_core() {
  add_target("in_cache/few_snap", "0.20 ns per bristle", keep_end(), few_snap, 14400);
  add_target("in_cache/all_snap", "0.55 ns per bristle", OnePatchCase{}, all_snap, 14400);
  if (!BRISTLE_MINIMAL)
    add_target("in_cache/redraw_one_snap", "1.0 ns per bristle", redraw_mean(), two_snaps, 14400);
  add_target("tick/900", "0.5 us a step", keep_end(), few_snap, 900);
  add_target("stuck/no_motion", "0.2 us a step", keep_end(), rest, 1000000);
  add_target("stuck/within_bound", "0.2 us a step", keep_end(), within_bound, 1000000);
  add_target("stuck/tremor", "1 % of the next row", keep_end(), tremor, 1000000);
  OnePatchCase eager = keep_end();
  eager.batch.eager = true;
  add_target("stuck/tremor_eager", "every bristle visited", eager, tremor, 1000000);
  add_target("out_of_cache/few_snap", "1.3 times rivals/presliding/.../stream per bristle", keep_end(),
             few_snap, 4000000);
  add_patches("patches/10000_resting", "30 us a step", rest, Outputs::end, 1);
}

void register_two_threads() {
  for (int threads : {1, 2}) {
    OnePatchCase what;
    what.batch.threads = threads;
    const std::string end = std::to_string(threads) + "threads";
    add_target("threads/all_snap/200000/" + end, "two threads 1.8 times one", what, all_snap, 200000);
    add_target("threads/all_snap/2000000/" + end, "1 ms a step with two", what, all_snap, 2000000);
    if (!BRISTLE_MINIMAL) {
      OnePatchCase redraw = redraw_mean();
      redraw.batch.threads = threads;
      add_target("threads/redraw_one_snap/1200000/" + end, "1 ms a step with two", redraw, two_snaps,
                 1200000);
    }
    OnePatchCase few = keep_end();
    few.batch.threads = threads;
    add_target("threads/few_snap/4000000/" + end, "1 ms a step with two", few, few_snap, 4000000);
    add_patches("patches/10000_all_snap/" + end, "1 ms a step with two", all_snap, usual_outputs(), threads);
  }
}

}  // namespace

void register_targets() {
  register_one_core();
  if (BRISTLE_WITH_TBB) register_two_threads();
}

}  // namespace bristle_bench
