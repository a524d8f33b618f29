// Compares the infinite brush with 900 and 10,000 representatives of the same law: a step of 1, 100 and
// 10,000 patches in each kind of motion, a call of find_force, and the most expensive step of a long random
// walk.
#include <algorithm>
#include <cmath>
#include <random>

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
constexpr double golden_turn = 2.399963229728653;  // rad

struct CohortMotion {
  const char* name;
  const char* label;
  double stroke;  ///< path of a step in mean snap lengths
  double turn;    ///< turn of the direction from step to step, rad
  double noise;   ///< deviation of the load from its mean, relative, up and down in turn
};
constexpr CohortMotion motions[] = {
    {"slide", "0.1 dbar a step, straight", 0.1, 0.0, 0.0},
    {"stick", "+-0.05 dbar in turn", 0.05, M_PI, 0.0},
    {"wind", "0.1 dbar a step, turned by 0.1 rad", 0.1, 0.1, 0.0},
    {"turn", "1 dbar a step, turned by 137.5 degrees", 1.0, golden_turn, 0.0},
    {"far", "100 dbar a step, turned by 137.5 degrees", 100.0, golden_turn, 0.0},
    {"load_noise", "0.1 dbar a step, turned by 0.1 rad, 1 % of noise in the load", 0.1, 0.1, 0.01},
};

/// Patches that slide to a steady state and then move as prescribed, each in its own direction.
class CohortScene {
 public:
  CohortScene(const Subject& subject, std::uint32_t patches, const CohortMotion& motion) : motion_(motion) {
    const Material material = plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw);
    const PatchOptions options =
        plain_options(subject.bristles, 2, Precision::single, Outputs::end).with_max_normal_load(load_n);
    for (std::uint32_t i = 0; i < patches; ++i) {
      Motion moved;
      moved.id =
          batch_.add(material, PatchOptions(options).with_population(subject.population).with_seed(i + 1));
      moved.normal_load = 0.9 * load_n;
      moved_.push_back(moved);
      angles_.push_back(golden_turn * i);
    }
    responses_.resize(patches);
    batch_.warm_up();
    for (int i = 0; i < usual_settling.slides; ++i) {
      place(usual_settling.slide, 0.0);
      batch_.step(tick, moved_, responses_);
    }
    for (int i = 0; i < 200; ++i) step();
  }

  std::uint32_t patches() const { return static_cast<std::uint32_t>(moved_.size()); }

  /// Sets the motion of each patch (a few nanoseconds each) and steps them all.
  bristle::StepReport step() {
    next();
    return batch_.step(tick, moved_, responses_);
  }
  /// Returns the time, ns, of a step that moves by `stroke` mean snap lengths.
  double time_step(double stroke, double angle) {
    place(stroke, angle);
    const auto start = std::chrono::steady_clock::now();
    benchmark::DoNotOptimize(batch_.step(tick, moved_, responses_));
    return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
  }
  void find_forces() {
    next();
    for (const Motion& m : moved_) benchmark::DoNotOptimize(batch_.find_force(tick, m));
  }

 private:
  void next() {
    ++count_;
    const double odd = count_ % 2 == 0 ? -1.0 : 1.0;
    place(motion_.stroke, motion_.turn * static_cast<double>(count_ % 628));
    if (motion_.noise > 0.0)
      for (Motion& m : moved_) m.normal_load = 0.9 * load_n * (1.0 + odd * motion_.noise);
  }
  void place(double stroke, double angle) {
    const double c = stroke * dbar * std::cos(angle), s = stroke * dbar * std::sin(angle);
    if (directions_.empty())
      for (double a : angles_) directions_.push_back({std::cos(a), std::sin(a)});
    for (std::size_t i = 0; i < moved_.size(); ++i) {
      moved_[i].displacement[0] = c * directions_[i].x - s * directions_[i].y;
      moved_[i].displacement[1] = s * directions_[i].x + c * directions_[i].y;
    }
  }

  struct Direction {
    double x, y;
  };
  PatchBatch batch_;
  CohortMotion motion_;
  std::vector<Motion> moved_;
  std::vector<Response> responses_;
  std::vector<double> angles_;
  std::vector<Direction> directions_;
  std::uint64_t count_ = 0;
};

void add_cohort_benchmark(const std::string& name, const CohortMotion& motion, const Subject& subject,
                          std::uint32_t patches, bool asks) {
  add_benchmark(name, [=](benchmark::State& state) {
    auto& scene = keep_while_named<CohortScene>(
        name, [&] { return std::make_shared<CohortScene>(subject, patches, motion); });
    const auto start = std::chrono::steady_clock::now();
    for (auto _ : state) {
      if (asks)
        scene.find_forces();
      else
        benchmark::DoNotOptimize(scene.step());
      benchmark::ClobberMemory();
    }
    const std::chrono::duration<double, std::nano> elapsed = std::chrono::steady_clock::now() - start;
    state.counters["ns_per_patch"] =
        elapsed.count() / (static_cast<double>(state.iterations()) * scene.patches());
    state.SetLabel(motion.label);
  });
}

constexpr int walk_steps = 4000;
constexpr int walk_passes = 7;

/// Adds a benchmark of a random walk. Every pass repeats the same walk, and of each step the least time over
/// the passes counts, which excludes disturbances by other work.
void add_walk_benchmark(const Subject& subject, double stroke) {
  const std::string name = std::string("cohorts/walk/") + (stroke < 1.0 ? "short/" : "long/") + subject.name;
  benchmark::RegisterBenchmark(
      name.c_str(),
      [=](benchmark::State& state) {
        std::vector<double> least(walk_steps, 1e300);
        for (auto _ : state) {
          CohortScene scene(subject, 1, motions[0]);
          std::mt19937 random(1);
          for (double& ns : least)
            ns = std::min(ns, scene.time_step(stroke, static_cast<double>(random()) * (2.0 * M_PI / 0x1p32)));
        }
        std::sort(least.begin(), least.end());
        state.counters["median_ns"] = least[walk_steps / 2];
        state.counters["p99_ns"] = least[walk_steps * 99 / 100];
        state.counters["worst_ns"] = least.back();
        state.SetLabel(stroke < 1.0 ? "0.1 dbar a step, any direction" : "1 dbar a step, any direction");
      })
      ->Iterations(walk_passes)
      ->Unit(benchmark::kMillisecond);
}

}  // namespace

void register_cohorts() {
  if (BRISTLE_MINIMAL) return;
  for (const CohortMotion& motion : motions)
    for (std::uint32_t patches : {1u, 100u, 10000u})
      for (const Subject& subject : subjects) {
        // Leaves out this case: ten thousand patches of 10,000 bristles take a gigabyte.
        if (patches == 10000 && subject.bristles == 10000) continue;
        const std::string name =
            std::string(motion.name) + '/' + std::to_string(patches) + '/' + subject.name;
        add_cohort_benchmark("cohorts/step/" + name, motion, subject, patches, false);
        add_cohort_benchmark("cohorts/find_force/" + name, motion, subject, patches, true);
      }
  for (double stroke : {0.1, 1.0})
    for (const Subject& subject : subjects) add_walk_benchmark(subject, stroke);
}

}  // namespace bristle_bench
