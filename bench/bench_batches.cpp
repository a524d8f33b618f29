// Measures steps of a batch of ten thousand patches (contacts): all sliding, all resting, or a mix.
#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

namespace {

constexpr std::uint32_t patch_count = 10000;

void add_batch_benchmark(const std::string& name, const char* label,
                         std::shared_ptr<MeasuredScene> (*make)(const BatchOptions&)) {
  for (int threads : {1, 2}) {
    const std::string full = "batch/" + name + '/' + std::to_string(threads) + "threads";
    add_benchmark(full, [=](benchmark::State& state) {
      auto& scene =
          keep_while_named<MeasuredScene>(full, [&] { return make(BatchOptions{}.with_threads(threads)); });
      measure(state, scene.bristles(), 0.0, [&] { return scene.step(); });
      state.SetLabel(label);
    });
  }
}

/// Makes patches of 100 bristles, all in the same regime, each with its own seed.
template <const Regime& regime, SnapRule rule>
std::shared_ptr<MeasuredScene> make_equal(const BatchOptions& options) {
  auto scene = std::make_shared<MeasuredScene>(options);
  for (std::uint32_t i = 0; i < patch_count; ++i)
    scene->add(plain_material(usual_law(), rule),
               plain_options(100, usual_axes, Precision::single, usual_outputs()).with_seed(i + 1), regime);
  scene->settle();
  return scene;
}

/// Makes patches that rest: the step's list of motions leaves them out.
std::shared_ptr<MeasuredScene> make_unnamed(const BatchOptions& options) {
  auto scene = make_equal<rest, SnapRule::keep>(options);
  scene->name_none();
  return scene;
}

/// Makes a scene like a physics engine's: 30 to 1000 bristles each, both snap rules, one axis and two, one
/// patch in ten sliding, one in ten creeping, the rest at rest.
std::shared_ptr<MeasuredScene> make_mixed(const BatchOptions& options) {
  const std::uint32_t sizes[] = {30, 30, 30, 100, 100, 300, 1000};
  auto scene = std::make_shared<MeasuredScene>(options);
  for (std::uint32_t i = 0; i < patch_count; ++i) {
    const SnapRule rule = rules()[i % rules().size()];
    const int axes = axes_counts()[i / 2 % axes_counts().size()];
    const Regime& regime = i % 10 == 0 ? all_snap : i % 10 == 5 ? presliding : rest;
    scene->add(plain_material(usual_law(), rule),
               plain_options(sizes[i % 7], axes, Precision::single, usual_outputs()).with_seed(i + 1),
               regime);
  }
  scene->settle();
  return scene;
}

}  // namespace

void register_batches() {
  add_batch_benchmark("all_snap/keep", all_snap.motion, make_equal<all_snap, SnapRule::keep>);
  if (!BRISTLE_MINIMAL)
    add_batch_benchmark("all_snap/redraw", all_snap.motion, make_equal<all_snap, SnapRule::redraw>);
  add_batch_benchmark("presliding/keep", presliding.motion, make_equal<presliding, SnapRule::keep>);
  add_batch_benchmark("stick/keep", stick.motion, make_equal<stick, SnapRule::keep>);
  add_batch_benchmark("resting", "every patch named, displacement 0", make_equal<rest, SnapRule::keep>);
  add_batch_benchmark("resting_unnamed", "no patch named", make_unnamed);
  add_batch_benchmark("mixed", "1 in 10 slides, 1 in 10 creeps, 30 to 1000 bristles", make_mixed);
}

}  // namespace bristle_bench
