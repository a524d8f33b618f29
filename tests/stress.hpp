// Helpers of tests that bound computing time. They use thread CPU time and ratios to a plain loop in the same
// run, the best of several tries, so that neither other programs nor the speed of the machine decide.
#pragma once

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include <bristle/deadline_monitor.hpp>

namespace bristle_test {

#if defined(__OPTIMIZE__) && defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
constexpr bool timed_build = true;
#else
constexpr bool timed_build = false;  // whether to assert bounds on times; if false, only the work is done
#endif

inline void check_below(double value, double limit, const char* what) {
  std::printf("%s: %.4g (limit %.4g)\n", what, value, limit);
  if (timed_build) CHECK(value < limit);
}

/// Runs a test once, or repeatedly if BRISTLE_STRESS_SECONDS asks for a long form: each test that uses this
/// gets its share of that time, and must pass in every round.
template <class Test>
void in_rounds(Test&& test) {
  constexpr double tests = 6.0;
  const char* text = std::getenv("BRISTLE_STRESS_SECONDS");
  const double seconds = text ? std::atof(text) / tests : 0.0;
  const double start = bristle::DeadlineMonitor::wall_now();
  do {
    test();
  } while (bristle::DeadlineMonitor::wall_now() - start < seconds);
}

/// Thread CPU time of a step, s, the least of several tries.
struct StepTimes {
  double p50 = 1e9, p90 = 1e9, p99 = 1e9;
};

/// Times two kinds of steps alternately, `tries` times `steps` of each; each step gets its number.
template <class First, class Second>
std::pair<StepTimes, StepTimes> times_in_turns(First&& first, Second&& second, int steps = 200,
                                               int tries = 7) {
  std::pair<StepTimes, StepTimes> best;
  const auto measure = [steps](auto&& step, StepTimes& times) {
    std::vector<double> seconds(static_cast<std::size_t>(steps));
    for (int k = 0; k < steps; ++k) {
      const double start = bristle::DeadlineMonitor::cpu_now();
      step(k);
      seconds[static_cast<std::size_t>(k)] = bristle::DeadlineMonitor::cpu_now() - start;
    }
    std::sort(seconds.begin(), seconds.end());
    const auto percentile = [&](double share) {
      return seconds[static_cast<std::size_t>(std::ceil(share * steps)) - 1];
    };
    times.p50 = std::min(times.p50, percentile(0.50));
    times.p90 = std::min(times.p90, percentile(0.90));
    times.p99 = std::min(times.p99, percentile(0.99));
  };
  for (int t = 0; t < tries; ++t) {
    measure(first, best.first);
    measure(second, best.second);
  }
  return best;
}

}  // namespace bristle_test
