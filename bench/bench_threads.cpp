// Measures what sharing a step between threads costs and gains. Rows: waking a worker once a millisecond; the
// number of bristles from which sharing pays; the size of the pieces shared; the gain of two threads, in
// steps that follow each other at once and in a paced 1 kHz loop. Each row has the same number of steps,
// timed one by one; p50 and p99 are in its counters.
#include <atomic>
#include <cstdlib>

#include "bench/paced_loop.hpp"
#include "core/runtime/workers.hpp"
#include "measured_scene.hpp"
#include "suites.hpp"
#include "tools/libraries/reports/quantile.hpp"

namespace bristle_bench {

namespace {

constexpr int timed_steps = 600;

enum class Pacing { back_to_back, paced };
const char* name_of(Pacing pacing) { return pacing == Pacing::paced ? "paced" : "back_to_back"; }

/// Times every call of `step`, which returns how many threads took part, and sets the benchmark's counters.
template <class Step>
void measure_steps(benchmark::State& state, Pacing pacing, std::uint64_t bristles, Step step) {
  std::vector<double> seconds;
  double threads = 0.0;
  for (int i = 0; i < 20; ++i) step();
  PacedLoop pace;
  for (auto _ : state) {
    if (pacing == Pacing::paced) pace.wait();
    const double start = bristle::DeadlineMonitor::wall_now();
    threads += step();
    seconds.push_back(bristle::DeadlineMonitor::wall_now() - start);
    state.SetIterationTime(seconds.back());
  }
  const double p50 = cli::quantile(seconds, 0.5);
  state.counters["ns_per_bristle"] = bristles ? p50 * 1e9 / static_cast<double>(bristles) : 0.0;
  state.counters["p50_us"] = p50 * 1e6;
  state.counters["p99_us"] = cli::quantile(seconds, 0.99) * 1e6;
  state.counters["threads"] = threads / static_cast<double>(seconds.size());
}

template <class Function>
void add_timed_benchmark(const std::string& name, Function function) {
  benchmark::RegisterBenchmark(name.c_str(), std::move(function))
      ->UseManualTime()
      ->Iterations(timed_steps)
      ->Unit(benchmark::kMicrosecond);
}

/// Fork and join of tasks that do nothing or, with `wait`, wait for at most 5 ms until a second thread joins.
struct Meeting {
  bool wait = false;
  long number = 0;  ///< number of the present fork and join, counted from the start of the program
  std::atomic<int> come{0};

  static void attend(void* self, int) {
    Meeting& meeting = *static_cast<Meeting*>(self);
    static thread_local long attended = 0;
    if (!meeting.wait) return;
    if (attended != meeting.number) {
      attended = meeting.number;
      ++meeting.come;
    }
    const double start = bristle::DeadlineMonitor::wall_now();
    while (meeting.come < 2 && bristle::DeadlineMonitor::wall_now() - start < 5e-3) {
    }
  }
};

/// Registers two benchmarks of fork and join: eight empty tasks, whose time is what sharing costs the caller;
/// and tasks that wait for a worker, whose time is that of waking one.
void register_fork_join() {
  for (bool wait : {false, true}) {
    for (Pacing pacing : {Pacing::back_to_back, Pacing::paced}) {
      const std::string name = wait ? "threads/worker_comes/" : "threads/fork_join/";
      add_timed_benchmark(name + name_of(pacing), [=](benchmark::State& state) {
        bristle::detail::Workers workers(2);
        workers.warm_up();
        static long forks = 0;
        Meeting meeting;
        meeting.wait = wait;
        measure_steps(state, pacing, 0, [&] {
          meeting.number = ++forks;
          meeting.come = 0;
          workers.run(8, &Meeting::attend, &meeting);
          return wait ? static_cast<double>(meeting.come) : 1.0;
        });
      });
    }
  }
}

struct SharedStep {
  Pacing pacing = Pacing::back_to_back;
  bool shared = true;
  Regime regime = all_snap;
  std::uint32_t bristles = 200000;
  std::uint32_t patches = 1;
  /// Smallest number of bristles that a thread takes at a time; 0: the library decides, and shares large
  /// steps only.
  std::uint32_t piece = 0;
};

void add_shared_step(const std::string& name, const SharedStep& what) {
  add_timed_benchmark(name, [what](benchmark::State& state) {
    // Shares steps of any size among threads, to find the size from which sharing pays.
    if (what.piece) setenv("BRISTLE_SHARING", ("0," + std::to_string(what.piece) + ",100").c_str(), 1);
    MeasuredScene scene(BatchOptions{}.with_threads(what.shared ? 2 : 1));
    unsetenv("BRISTLE_SHARING");
    for (std::uint32_t i = 0; i < what.patches; ++i)
      scene.add(plain_material(usual_law(), SnapRule::keep),
                plain_options(what.bristles / what.patches, usual_axes, Precision::single, usual_outputs())
                    .with_seed(i + 1),
                what.regime);
    scene.settle();
    measure_steps(state, what.pacing, what.bristles,
                  [&] { return static_cast<double>(scene.step().threads); });
  });
}

/// Registers steps of growing size on one thread and shared between two, to find from how many bristles
/// sharing pays, and how much.
void register_share() {
  for (Pacing pacing : {Pacing::back_to_back, Pacing::paced}) {
    for (std::uint32_t n : {10000u, 20000u, 40000u, 60000u, 100000u, 200000u, 400000u, 1000000u}) {
      const std::string group =
          std::string("threads/share/") + name_of(pacing) + '/' + std::to_string(n) + '/';
      SharedStep what;
      what.pacing = pacing;
      what.bristles = n;
      what.piece = 4096;
      what.shared = false;
      add_shared_step(group + "alone", what);
      what.shared = true;
      add_shared_step(group + "shared", what);
    }
  }
}

/// Registers a step of 200,000 bristles, as one patch and as 2,000 patches, shared in pieces of different
/// size.
void register_grain() {
  for (std::uint32_t patches : {1u, 2000u}) {
    for (std::uint32_t piece : {1024u, 4096u, 8192u, 16384u, 32768u, 65536u}) {
      SharedStep what;
      what.patches = patches;
      what.piece = piece;
      add_shared_step("threads/grain/" + std::to_string(patches) + "patches/" + std::to_string(piece), what);
    }
  }
}

/// Registers ten thousand patches of a few bristles on one thread, to find the cost of a patch besides its
/// bristles.
void register_patches() {
  for (std::uint32_t size : {1u, 16u, 64u, 256u}) {
    SharedStep what;
    what.shared = false;
    what.patches = 10000;
    what.bristles = 10000 * size;
    add_shared_step("threads/patch_overhead/10000x" + std::to_string(size), what);
  }
}

}  // namespace

void register_threads() {
  register_patches();
  if (!BRISTLE_WITH_TBB) return;
  register_fork_join();
  register_share();
  register_grain();
}

}  // namespace bristle_bench
