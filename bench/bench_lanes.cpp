// Measures ten thousand contacts of 8, 16 and 32 bristles that slide at their limit, as a group and as
// patches, beside a plain loop over the same springs. The three take turns, so that their ratios hold on a
// machine that slows down meanwhile.
#include "bench/lanes_scene.hpp"
#include "bench/timing.hpp"
#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

namespace {

void add_lanes_benchmark(std::uint32_t springs, LanePath path, int threads) {
  const std::string name = "lanes/" + std::to_string(springs) + "springs/" +
                           lane_path_names[static_cast<int>(path)] + "/" + std::to_string(threads) +
                           "threads";
  add_benchmark(name, [=](benchmark::State& state) {
    const BatchOptions options = BatchOptions{}.with_threads(threads);
    LaneGroup group(springs, path, options);
    LanePatches patches(springs, path, options);
    LanePlain plain(springs, path);
    double seconds[3] = {}, steps = 0.0;
    for (auto _ : state) {
      seconds[0] += time_of([&] { benchmark::DoNotOptimize(group.step()); }, 1);
      seconds[1] += time_of([&] { benchmark::DoNotOptimize(patches.step()); }, 1);
      seconds[2] += time_of([&] { benchmark::DoNotOptimize(plain.step()); }, 1);
      ++steps;
    }
    const double contacts = steps * static_cast<double>(::bristle_bench::LaneMotions::contacts);
    state.counters["group_ns"] = 1e9 * seconds[0] / contacts;
    state.counters["patches_ns"] = 1e9 * seconds[1] / contacts;
    state.counters["plain_ns"] = 1e9 * seconds[2] / contacts;
    state.counters["group_over_plain"] = seconds[0] / seconds[2];
    state.counters["patches_over_plain"] = seconds[1] / seconds[2];
  });
}

}  // namespace

void register_lanes() {
  if (!bristle::plain::plain_loops_run_here()) return;
  for (const std::uint32_t springs : {8u, 16u, 32u})
    for (const LanePath path : lane_paths)
      for (const int threads : {1, 2}) add_lanes_benchmark(springs, path, threads);
}

}  // namespace bristle_bench
