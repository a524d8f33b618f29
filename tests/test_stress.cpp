// Bounds on computing time, wide ones, in an executable of their own that runs alone (label `stress`).
//
// Uses thread CPU time, the best of several tries, so that other programs do not decide.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "expect.hpp"
#include "scenes.hpp"
#include "stress.hpp"

using namespace bristle_test;

namespace {

/// Returns the least, over several tries, of the median thread CPU time of a step, s.
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

OnePatch sliding_patch(std::uint32_t n, SnapRule rule, Outputs outputs) {
  OnePatch patch(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), rule),
                 plain_options(n, 2, Precision::single, outputs));
  patch.step(0.0, 0.0, n);
  for (int k = 0; k < 10; ++k) patch.step(0.9 * dbar, 0.3 * dbar, n);
  return patch;
}

}  // namespace

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

namespace {

/// Returns the thread CPU time of `slow` over that of `usual`. The two run in turns, 50 steps at a time, and
/// the shortest times count.
template <class Usual, class Slow>
double time_ratio(Usual&& usual, Slow&& slow) {
  const auto time = [](auto&& step) {
    const double start = bristle::DeadlineMonitor::cpu_now();
    for (int k = 0; k < 50; ++k) step(k);
    return bristle::DeadlineMonitor::cpu_now() - start;
  };
  double best_usual = 1e9, best_slow = 1e9;
  for (int turn = 0; turn < 9; ++turn) {
    best_usual = std::min(best_usual, time(usual));
    best_slow = std::min(best_slow, time(slow));
  }
  return best_slow / best_usual;
}

}  // namespace

TEST_CASE("Denormal numbers never slow a step by more than two times", "[stress]") {
  constexpr std::uint32_t n = 4000;
  constexpr double denormal = 1e-310;
  const SnapLength law = SnapLength::uniform(0.5 * dbar, 1.5 * dbar);
  for (Precision precision : precisions()) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      for (int axes : {1, 2}) {
        std::printf("%s, %s, axes %d\n", name_of(precision), table_name(rule), axes);
        const Material material =
            plain_material(law, rule).with_bristle_damping(0.01).with_viscous_friction(1.0);
        const auto make = [&](const Material& m) {
          OnePatch patch(m, plain_options(n, axes, precision));
          patch.step(0.0, 0.0, n);
          for (int k = 0; k < 10; ++k) patch.step(0.9 * dbar, 0.0, n);
          return patch;
        };
        const double aside = axes == 2 ? denormal : 0.0;
        OnePatch usual = make(material);
        OnePatch other = make(material);
        check_below(time_ratio([&](int) { usual.step(1e-4 * dbar, 0.0, n); },
                               [&](int) { other.step(denormal, aside, n); }),
                    2.0, "a denormal path against a tiny one");
        check_below(time_ratio([&](int) { usual.step(1.6 * dbar, 0.0, n); },
                               [&](int) { other.step(1.6 * dbar, aside, n); }),
                    2.0, "a denormal path aside against none");
        // Motion that shrinks from a snap length to nothing, again and again, as a decaying swing does.
        check_below(time_ratio([&](int k) { usual.step(dbar * (k % 50 == 0 ? 1.0 : 1e-8), 0.0, n); },
                               [&](int k) { other.step(dbar * std::pow(10.0, -8.0 * (k % 50)), 0.0, n); }),
                    2.0, "a motion that decays to nothing against one that decays to little");
        check_below(time_ratio([&](int k) { usual.step(0.3 * dbar, 0.0, k % 2 == 0 ? n : 0.0); },
                               [&](int k) { other.step(0.3 * dbar, 0.0, k % 2 == 0 ? n : denormal); }),
                    2.0, "a denormal load against none");
        // Motion with an across component that is denormal in float, as are the deflections it leaves.
        const double faint_y = axes == 2 ? 1e-41 : 0.0;
        const auto far_and_near = [&](OnePatch& patch, double y) {
          return [&patch, y](int k) {
            const double d = k % 2 == 0 ? 5000.0 * dbar : 0.7 * dbar;
            patch.step(d, k % 2 == 0 ? d * y : 0.0, n);
          };
        };
        check_below(time_ratio(far_and_near(usual, axes == 2 ? 0.3 : 0.0), far_and_near(other, faint_y)), 2.0,
                    "a denormal direction against another");
        // A load that rises beyond the maximum shrinks deflections below the normal range of float.
        OnePatch shrunk = make(material);
        for (int round = 0; round < 40; ++round)
          for (double load : {1e8, 1e12, 1e15 / 3.0, 1.0 * n}) shrunk.step(0.0, 0.0, load);
        check_below(time_ratio([&](int k) { usual.step(0.0, 0.0, k % 2 == 0 ? 2.0 * n : n); },
                               [&](int k) { shrunk.step(0.0, 0.0, k % 2 == 0 ? 2.0 * n : n); }),
                    2.0, "denormal deflections against others");
        // Material with bristles so soft that forces and energies are denormal doubles.
        OnePatch faint = make(Material(material)
                                  .with_bristle_stiffness(1e-15)
                                  .with_normal_stiffness(1e15)
                                  .with_asperity_height_deviation(1e15)
                                  .with_stribeck_velocity(std::numeric_limits<double>::denorm_min()));
        check_below(time_ratio([&](int) { usual.step(1.6 * dbar, 0.0, n); },
                               [&](int) { faint.step(1.6 * dbar, 0.0, n); }),
                    2.0, "faint forces against others");
      }
    }
  }
}
