// Helpers that the benchmarks share: kinds of motion, a batch in steady state, counters.
#pragma once

#include <benchmark/benchmark.h>

#include <bristle/bristle.hpp>
#include <bristle/deadline_monitor.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "bench/steady_scene.hpp"
#include "tests/scenes.hpp"

namespace bristle_bench {

using namespace bristle_test;

/// Number of tangential axes in all benchmarks except those that compare one axis with two.
constexpr int usual_axes = 2;

struct Regime : SteadyMotion {
  const char* name;
  const char* motion;  ///< motion in words, for the benchmark's label
  constexpr Regime(const char* name_, double step_, bool there_and_back_, const char* motion_)
      : SteadyMotion{step_, there_and_back_}, name(name_), motion(motion_) {}
};
constexpr Regime rest = {"rest", 0.0, false, "no motion"};
constexpr Regime stick = {"stick", 1e-3, true, "+-0.001 dbar in turn, no snaps"};
constexpr Regime presliding = {"presliding", 0.01, false, "0.01 dbar a step one way, 1 % snap"};
constexpr Regime two_snaps = {"two_snaps", 1.0, false, "1 dbar a step one way, up to two snaps"};
constexpr Regime all_snap = {"all_snap", 1.5, false, "1.5 dbar a step one way, every bristle snaps"};

/// Returns the snap lengths of most benchmarks: uniform, so that the regimes match their names.
inline SnapLength usual_law() { return SnapLength::uniform(0.5 * dbar, 1.5 * dbar); }

inline const char* name_of(SnapRule rule) { return rule == SnapRule::keep ? "keep" : "redraw"; }
inline const char* name_of(Precision precision) {
  return precision == Precision::single ? "float" : "double";
}
inline const char* name_of(Outputs outputs) {
  switch (outputs) {
    case Outputs::end:
      return "end";
    case Outputs::mean:
      return "mean";
    case Outputs::energy:
      return "energy";
    default:
      return "all";
  }
}

inline std::vector<SnapRule> rules() { return {SnapRule::keep, SnapRule::redraw}; }
inline std::vector<Outputs> output_sets() {
  return {Outputs::end, Outputs::mean, Outputs::energy, Outputs::all};
}
inline std::vector<int> axes_counts() { return {1, 2}; }
inline Outputs usual_outputs() { return Outputs::mean; }

/// Steps that bring a scene into its regime: 54 steps of 0.37 mean snap lengths (20 in all; the odd length
/// keeps steps and snaps from coinciding), then 16 steps of the regime itself.
constexpr Settling usual_settling = {0.37, 54, 16};

/// Batch of patches in steady motion, with the benchmarks' step time and settling.
class MeasuredScene : public SteadyScene {
 public:
  explicit MeasuredScene(const BatchOptions& options = {}, bool eager = false)
      : SteadyScene(options, tick, usual_settling, eager) {}

  bristle::StepReport step() {
    const bristle::StepReport report = SteadyScene::step();
    benchmark::DoNotOptimize(report);
    benchmark::ClobberMemory();
    return report;
  }
};

/// Returns the scene of this name, made on first use and kept until another name is asked for. Google
/// Benchmark calls a function several times to find the number of iterations, and making a population of
/// millions takes long.
template <class T, class Make>
T& keep_while_named(const std::string& name, Make make) {
  static std::string kept_name;
  static std::shared_ptr<T> kept;
  if (kept_name != name || kept == nullptr) {
    kept.reset();
    kept = make();
    kept_name = name;
  }
  return *kept;
}

/// Returns the fewest bytes per bristle that a step must read and write. It reads deflections and snap
/// length, and writes deflections if bristles snap. If all snap with redraw, it also writes the snap length,
/// and reads and writes the random state.
inline double least_bytes(const Regime& regime, SnapRule rule, int axes, Precision precision) {
  const double real = precision == Precision::single ? 4.0 : 8.0;
  const double read = (axes + 1) * real;
  if (regime.there_and_back || regime.step < 1e-3) return read;
  const double moved = read + axes * real;
  return rule == SnapRule::redraw && regime.step > 0.1 ? moved + real + 8.0 : moved;
}

/// Runs `step` repeatedly and sets the counters. All benchmarks have the same ones, because the CSV reporter
/// stops at a row with others. `visited` is the share of bristles that a kernel visited, if `step` returns a
/// StepReport. Measures time itself, because Google Benchmark labels all of its own rate counters "per
/// second".
template <class Step>
void measure(benchmark::State& state, std::uint64_t bristles, double bytes_per_bristle, Step step) {
  const double start = bristle::DeadlineMonitor::wall_now();
  double visited = 0.0;
  for (auto _ : state) {
    if constexpr (std::is_same_v<decltype(step()), bristle::StepReport>) {
      visited += static_cast<double>(step().bristles_visited);
    } else {
      step();
      visited += static_cast<double>(bristles);
    }
  }
  const double elapsed = bristle::DeadlineMonitor::wall_now() - start;
  const double steps = static_cast<double>(state.iterations());
  const double n = static_cast<double>(bristles);
  const double ns_per_bristle = 1e9 * elapsed / (steps * n);
  state.counters["ns_per_bristle"] = ns_per_bristle;
  state.counters["bristles_per_ms"] = 1e6 / ns_per_bristle;
  state.counters["visited"] = visited / (steps * n);
  if (bytes_per_bristle > 0.0)
    state.SetBytesProcessed(static_cast<std::int64_t>(steps * n * bytes_per_bristle));
}

/// Registers a benchmark by name. It measures real time, because CPU time of the caller would not show the
/// work of other threads.
template <class Function>
void add_benchmark(const std::string& name, Function function) {
  benchmark::RegisterBenchmark(name.c_str(), std::move(function))
      ->UseRealTime()
      ->Unit(benchmark::kMicrosecond);
}

/// Settings of a benchmark that steps one patch in one kind of motion (regime).
struct OnePatchCase {
  Regime regime = all_snap;
  std::uint32_t bristles = 4096;
  SnapRule rule = SnapRule::keep;
  int axes = usual_axes;
  Outputs outputs = usual_outputs();
  Precision precision = Precision::single;
  SnapLength law = usual_law();
  bool eager = false;  ///< whether steps visit every bristle
  BatchOptions batch;
};

inline void add_one_patch_benchmark(const std::string& name, const OnePatchCase& what) {
  add_benchmark(name, [name, what](benchmark::State& state) {
    auto& scene = keep_while_named<MeasuredScene>(name, [&] {
      auto made = std::make_shared<MeasuredScene>(what.batch, what.eager);
      made->add(plain_material(what.law, what.rule),
                plain_options(what.bristles, what.axes, what.precision, what.outputs), what.regime);
      made->settle();
      return made;
    });
    measure(state, scene.bristles(), least_bytes(what.regime, what.rule, what.axes, what.precision),
            [&] { return scene.step(); });
    state.SetLabel(what.regime.motion);
  });
}

}  // namespace bristle_bench
