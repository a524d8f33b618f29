// Timing, with generous margins: an executable of its own that runs alone (label `stress`).
//
// Thread CPU time, the best of several tries: what else runs on the machine should not decide.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "expect.hpp"
#include "scenes.hpp"

using namespace bristle_test;

namespace {

#if defined(__OPTIMIZE__) && defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
constexpr bool timed_build = true;
#else
constexpr bool timed_build = false;  // the same work, without asserting on time
#endif

/// Median thread CPU time of a step (s), the best of several tries.
template <class Step>
double step_time(Step&& step, int steps = 60, int tries = 7) {
  double best = 1e9;
  for (int t = 0; t < tries; ++t) {
    std::vector<double> times;
    for (int k = 0; k < steps; ++k) {
      const double start = bristle::DeadlineMonitor::cpu_now();
      step();
      times.push_back(bristle::DeadlineMonitor::cpu_now() - start);
    }
    std::nth_element(times.begin(), times.begin() + steps / 2, times.end());
    best = std::min(best, times[static_cast<std::size_t>(steps / 2)]);
  }
  return best;
}

void check_below(double value, double limit, const char* what) {
  std::printf("%s: %.4g (limit %.4g)\n", what, value, limit);
  if (timed_build) CHECK(value < limit);
}

OnePatch sliding_patch(std::uint32_t n, SnapRule rule, Outputs outputs) {
  OnePatch patch(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), rule),
                 plain_options(n, 2, Precision::single, outputs));
  patch.step(0.0, 0.0, n);
  for (int k = 0; k < 10; ++k) patch.step(0.9 * dbar, 0.3 * dbar, n);
  return patch;
}

}  // namespace

TEST_CASE(
    "Ninety thousand bristles, a hundred times the paper's, all snap within a millisecond on one thread",
    "[stress]") {
  constexpr std::uint32_t n = 90000;
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    OnePatch patch = sliding_patch(n, rule, Outputs::mean);
    std::uint64_t snapped = 0;
    {
      OnePatch counted = sliding_patch(n, rule, Outputs::all);
      snapped = counted.step(1.6 * dbar, 0.0, n).snaps;
    }
    REQUIRE(snapped >= n);  // 1.6 is beyond every length
    const double time = step_time([&] { patch.step(1.6 * dbar, 0.0, n); });
    check_below(time, 1e-3, rule == SnapRule::keep ? "keep, all snap, s" : "redraw, all snap, s");
  }
}

TEST_CASE("The cost of a step grows linearly with the number of bristles", "[stress]") {
  double per_bristle[3];
  int at = 0;
  for (std::uint32_t n : {3000u, 30000u, 300000u}) {
    OnePatch patch = sliding_patch(n, SnapRule::keep, Outputs::end);
    per_bristle[at++] = step_time([&] { patch.step(1.6 * dbar, 0.0, n); }, n > 100000 ? 20 : 60) / n;
  }
  check_below(per_bristle[1] / per_bristle[0], 3.0, "30,000 against 3,000 bristles, cost per bristle");
  check_below(per_bristle[2] / per_bristle[1], 3.0, "300,000 against 30,000 bristles, cost per bristle");
}

TEST_CASE("A patch at rest costs at most a tenth of a sliding one", "[stress]") {
  constexpr std::uint32_t n = 100000;
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    OnePatch patch = sliding_patch(n, rule, Outputs::all);
    const double sliding = step_time([&] { patch.step(1.6 * dbar, 0.0, n); });
    const double at_rest = step_time([&] { patch.step(0.0, 0.0, n); });
    check_below(at_rest / sliding, 0.1, "rest against sliding");
  }
}

TEST_CASE("The cost of redraw is bounded at any speed", "[stress]") {
  constexpr std::uint32_t n = 50000;
  for (const SnapLength& law :
       {SnapLength::normal(dbar, 0.05 * dbar), SnapLength::uniform(0.5 * dbar, 1.5 * dbar),
        SnapLength::lognormal(dbar, 0.3), SnapLength::exponential(dbar)}) {
    OnePatch patch(plain_material(law, SnapRule::redraw),
                   plain_options(n, 2, Precision::single, Outputs::all));
    patch.step(0.0, 0.0, n);
    const double slow = step_time([&] { patch.step(10.0 * dbar, 0.0, n); }, 10, 5);
    for (double length : {100.0, 1e4, 1e7}) {
      const double fast = step_time([&] { patch.step(length * dbar, 0.0, n); }, 10, 5);
      std::printf("%s, %g mean lengths a step: ", to_string(law.law()), length);
      check_below(fast / slow, 4.0, "cost against 10 mean lengths");
    }
  }
}

TEST_CASE("Ten thousand patches at rest cost less than as many that slide", "[stress]") {
  PatchBatch batch;
  const std::vector<PatchId> ids =
      add_patches(batch, 10000, plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw),
                  plain_options(100));
  std::vector<Response> responses(ids.size());
  const std::vector<Motion> sliding = same_motion(ids, 0.9 * dbar, 0.3 * dbar, 100.0);
  const std::vector<Motion> resting = same_motion(ids, 0.0, 0.0, 100.0);
  for (int k = 0; k < 5; ++k) batch.step(tick, sliding, responses);
  const double slide = step_time([&] { batch.step(tick, sliding, responses); }, 10, 3);
  const double rest = step_time([&] { batch.step(tick, resting, responses); }, 10, 3);
  std::printf("10,000 patches of 100 bristles: %.3g s sliding, %.3g s at rest\n", slide, rest);
  check_below(rest / slide, 0.6, "rest against sliding");
}
