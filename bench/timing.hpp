// Times loops by the wall clock, for the benchmarks and `bristle capacity`.
#pragma once

#include <cstdint>
#include <vector>

#include <bristle/deadline_monitor.hpp>
#include "tools/libraries/reports/quantile.hpp"

namespace bristle_bench {

/// Returns the wall time (s) that `steps` calls of `step` take together.
template <class Step>
double time_of(Step&& step, std::uint64_t steps) {
  const double start = bristle::DeadlineMonitor::wall_now();
  for (std::uint64_t i = 0; i < steps; ++i) step();
  return bristle::DeadlineMonitor::wall_now() - start;
}

/// Returns the median wall time, s, of a call of `step`, after `first` calls that wake threads and fill
/// caches. Calls wait() before each.
template <class Step, class Wait>
double median_time(Step&& step, int first, int count, Wait&& wait) {
  std::vector<double> seconds;
  for (int i = -first; i < count; ++i) {
    wait();
    const double taken = time_of(step, 1);
    if (i >= 0) seconds.push_back(taken);
  }
  return cli::quantile(std::move(seconds), 0.5);
}

}  // namespace bristle_bench
