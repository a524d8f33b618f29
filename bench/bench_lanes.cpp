// Measures ten thousand contacts of 8, 16 and 32 bristles that slide at their limit, beside a plain loop over
// the same springs. The two take turns, so that their ratio holds on a machine that slows down meanwhile.
#include <cmath>
#include <random>

#include "bench/plain_loops.hpp"
#include "bench/timing.hpp"
#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

namespace {

constexpr std::size_t contact_count = 10000;

/// Paths of the contacts, a tenth of a mean limit in each step.
enum class LanePath { bend, corners, ripple };
constexpr const char* path_names[] = {"bend", "corners", "ripple"};

struct LanesScene {
  LanesScene(std::uint32_t springs, LanePath the_path, int threads)
      : path(the_path), batch(BatchOptions{}.with_threads(threads)), plain(contact_count, springs, dbar) {
    const Material material = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::slide);
    const PatchOptions options =
        plain_options(springs, 2, Precision::single, Outputs::end).with_max_normal_load(1.01);
    for (std::size_t i = 0; i < contact_count; ++i) {
      motions[i].id = batch.add(material, options);
      angle[i] = 0.001 * static_cast<double>(i);
    }
    batch.warm_up();
    for (int k = 0; k < 60; ++k) step();
    seconds[0] = seconds[1] = 0.0;
  }

  void step() {
    for (std::size_t i = 0; i < contact_count; ++i) {
      if (path != LanePath::corners)
        angle[i] += 0.02;
      else if (random() % 20 == 0)
        angle[i] += random() % 2 == 0 ? 0.5 * M_PI : -0.5 * M_PI;
      dx[i] = 0.1 * dbar * std::cos(angle[i]);
      dy[i] = 0.1 * dbar * std::sin(angle[i]);
      load[i] = path == LanePath::ripple ? 1.0 + 0.01 * std::sin(0.7 * steps + static_cast<double>(i)) : 1.0;
      motions[i].displacement[0] = dx[i];
      motions[i].displacement[1] = dy[i];
      motions[i].normal_load = load[i];
    }
    ++steps;
    seconds[0] += time_of([this] { batch.step(tick, motions, responses); }, 1);
    seconds[1] += time_of([this] { plain.step(dx.data(), dy.data(), load.data(), fx.data(), fy.data()); }, 1);
    benchmark::DoNotOptimize(responses[0].end[0] + fx[0]);
  }

  LanePath path;
  PatchBatch batch;
  bristle::plain::LanesLoop plain;
  std::mt19937 random;
  double steps = 0.0;
  double seconds[2] = {};  ///< spent in patches and in the plain loop
  std::vector<bristle::Motion> motions = std::vector<bristle::Motion>(contact_count);
  std::vector<bristle::Response> responses = std::vector<bristle::Response>(contact_count);
  std::vector<double> angle = std::vector<double>(contact_count), dx = angle, dy = angle, load = angle,
                      fx = angle, fy = angle;
};

void add_lanes_benchmark(std::uint32_t springs, LanePath path, int threads) {
  const std::string name = "lanes/" + std::to_string(springs) + "springs/" +
                           path_names[static_cast<int>(path)] + "/" + std::to_string(threads) + "threads";
  add_benchmark(name, [=](benchmark::State& state) {
    LanesScene scene(springs, path, threads);
    double steps = 0.0;
    for (auto _ : state) {
      scene.step();
      ++steps;
    }
    const double contacts = steps * contact_count;
    state.counters["patches_ns"] = 1e9 * scene.seconds[0] / contacts;
    state.counters["plain_ns"] = 1e9 * scene.seconds[1] / contacts;
    state.counters["patches_over_plain"] = scene.seconds[0] / scene.seconds[1];
  });
}

}  // namespace

void register_lanes() {
  if (!bristle::plain::plain_loops_run_here()) return;
  for (const std::uint32_t springs : {8u, 16u, 32u})
    for (const LanePath path : {LanePath::bend, LanePath::corners, LanePath::ripple})
      for (const int threads : {1, 2}) add_lanes_benchmark(springs, path, threads);
}

}  // namespace bristle_bench
