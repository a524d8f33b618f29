// Compares the infinite brush with 900 and 10,000 representatives of the same law: a step of 1, 100 and
// 10,000 patches in each kind of motion, and a call of find_force.
#include <numbers>

#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

namespace {

using bristle::Population;

struct Subject {
  const char* name;
  Population population;
  std::uint32_t bristles;  ///< number of representatives
};
constexpr Subject subjects[] = {{"900", Population::representatives, 900},
                                {"10000", Population::representatives, 10000},
                                {"infinite", Population::infinite, 900}};
constexpr double load_n = 900.0;
constexpr double golden_turn = (3.0 - 2.2360679774997896964) * std::numbers::pi;

struct CohortMotion {
  const char* name;
  const char* label;
  SteadyMotion steady;
  double turn;    ///< turn of the direction from step to step, rad
  double ripple;  ///< share by which the load falls at most, at random in each step
};
constexpr CohortMotion motions[] = {
    {"slide", "0.1 dbar a step, straight", {0.1}, 0.0, 0.0},
    {"stick", "+-0.05 dbar in turn", {0.05, true}, 0.0, 0.0},
    {"wind", "0.1 dbar a step, turned by 0.1 rad", {0.1}, 0.1, 0.0},
    {"turn", "1 dbar a step, turned by 137.5 degrees", {1.0}, golden_turn, 0.0},
    {"far", "100 dbar a step, turned by 137.5 degrees", {100.0}, golden_turn, 0.0},
    {"load_noise", "0.1 dbar a step, turned by 0.1 rad, load falling by up to 1 %", {0.1}, 0.1, 0.01},
};

std::shared_ptr<SteadyScene> make_scene(const Subject& subject, std::uint32_t patches,
                                        const CohortMotion& motion) {
  auto scene = std::make_shared<SteadyScene>(BatchOptions{}, tick,
                                             Settling{usual_settling.slide, usual_settling.slides, 200});
  const Material material = plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw);
  const PatchOptions options = plain_options(subject.bristles, 2, Precision::single, Outputs::end)
                                   .with_max_normal_load(load_n)
                                   .with_population(subject.population);
  for (std::uint32_t i = 0; i < patches; ++i)
    scene->add(material, PatchOptions(options).with_seed(i + 1), motion.steady);
  scene->vary(motion.turn, false, motion.ripple);
  scene->settle();
  return scene;
}

void add_cohort_benchmark(const std::string& name, const CohortMotion& motion, const Subject& subject,
                          std::uint32_t patches, bool asks) {
  add_benchmark(name, [=](benchmark::State& state) {
    auto& scene = keep_while_named<SteadyScene>(name, [&] { return make_scene(subject, patches, motion); });
    const double start = bristle::DeadlineMonitor::wall_now();
    for (auto _ : state) {
      if (asks)
        scene.find_forces([](const Response& force) { benchmark::DoNotOptimize(force); });
      else
        benchmark::DoNotOptimize(scene.step());
      benchmark::ClobberMemory();
    }
    const double elapsed = bristle::DeadlineMonitor::wall_now() - start;
    state.counters["ns_per_patch"] = 1e9 * elapsed / (static_cast<double>(state.iterations()) * patches);
    state.SetLabel(motion.label);
  });
}

}  // namespace

void register_cohorts() {
  for (const CohortMotion& motion : motions)
    for (std::uint32_t patches : {1u, 100u, 10000u})
      for (const Subject& subject : subjects) {
        // Leaves out ten thousand patches of 10,000 representatives, because they would take a gigabyte.
        if (patches == 10000 && subject.bristles == 10000) continue;
        const std::string name =
            std::string(motion.name) + '/' + std::to_string(patches) + '/' + subject.name;
        add_cohort_benchmark("cohorts/step/" + name, motion, subject, patches, false);
        add_cohort_benchmark("cohorts/find_force/" + name, motion, subject, patches, true);
      }
}

}  // namespace bristle_bench
