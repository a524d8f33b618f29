// DeadlineMonitor against sorted arrays.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <bristle/deadline_monitor.hpp>
#include <bristle/version.hpp>

using bristle::DeadlineMonitor;

namespace {

/// The smallest of the times that at least this share of them does not exceed.
double percentile_of(std::vector<double> times, double share) {
  std::sort(times.begin(), times.end());
  const double rank = std::ceil(share * static_cast<double>(times.size()));
  return times[static_cast<std::size_t>(std::max(rank - 1.0, 0.0))];
}

}  // namespace

TEST_CASE("Percentiles are those of the sorted times within 1.6 per cent, never below them", "[deadline]") {
  std::mt19937_64 random(7);
  std::lognormal_distribution<double> law(std::log(20e-6), 2.0);
  DeadlineMonitor monitor(1e-3);
  std::vector<double> times;
  double sum = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const double t = law(random);
    times.push_back(t);
    sum += t;
    monitor.record(t, t);
  }
  REQUIRE(monitor.count() == times.size());
  for (double share : {0.0, 0.001, 0.1, 0.5, 0.9, 0.99, 0.999, 0.9999, 1.0}) {
    INFO(share);
    const double exact = percentile_of(times, share);
    CHECK(monitor.percentile(share) >= exact * (1.0 - 1e-12) - 0.6e-9);
    CHECK(monitor.percentile(share) <= exact * (1.0 + 1.0 / 64) + 1e-9);
  }
  CHECK(monitor.p50() == monitor.percentile(0.5));
  CHECK(monitor.p99() == monitor.percentile(0.99));
  CHECK(monitor.p999() == monitor.percentile(0.999));
  CHECK(monitor.max() == *std::max_element(times.begin(), times.end()));
  CHECK(monitor.percentile(1.0) == monitor.max());
  CHECK(monitor.mean() == Approx(sum / 100000.0).epsilon(1e-12));
}

TEST_CASE("Every time from a nanosecond to a minute falls into a bucket that holds it", "[deadline]") {
  for (double t = 1e-9; t < 64.0; t *= 1.003) {
    DeadlineMonitor monitor(1e-3);
    monitor.record(t, 0.0);
    monitor.record(100.0, 0.0);  // so that the maximum does not clip
    if (!(monitor.p50() >= t - 0.6e-9 && monitor.p50() <= t * (1.0 + 1.0 / 64) + 0.6e-9)) {
      FAIL_CHECK("a time of " << t << " s is reported as " << monitor.p50() << " s");
    }
  }
  DeadlineMonitor monitor(1e-3);
  monitor.record(1e-3, 0.0);
  CHECK(monitor.p50() == 1e-3);  // one value: the maximum clips its bucket
}

TEST_CASE("A late tick is ours when its thread used more than the budget, else the machine's", "[deadline]") {
  DeadlineMonitor monitor(1e-3);
  monitor.record(0.5e-3, 0.4e-3);  // in time
  monitor.record(1e-3, 1e-3);      // just in time
  monitor.record(2e-3, 1.5e-3);    // late, ours
  monitor.record(2e-3, 0.2e-3);    // late, preempted
  monitor.record(3e-3, 1e-3);      // late, budget not exceeded
  monitor.record(2e-3);            // late, CPU time unknown: ours
  CHECK(monitor.deadline() == 1e-3);
  CHECK(monitor.count() == 6);
  CHECK(monitor.misses() == 4);
  CHECK(monitor.misses_ours() == 2);
  CHECK(monitor.misses_machine() == 2);
}

TEST_CASE("An empty or reset monitor reports nothing, and odd times do no harm", "[deadline]") {
  DeadlineMonitor monitor(5e-4);
  CHECK(monitor.count() == 0);
  CHECK(monitor.p99() == 0.0);
  CHECK(monitor.mean() == 0.0);
  CHECK(monitor.max() == 0.0);
  monitor.record(-1.0, 0.0);
  monitor.record(std::numeric_limits<double>::quiet_NaN(), 0.0);
  CHECK(monitor.max() == 0.0);
  CHECK(monitor.percentile(1.0) == 0.0);
  monitor.record(1e4, 0.0);
  monitor.record(std::numeric_limits<double>::infinity(), 0.0);
  CHECK(monitor.count() == 4);
  CHECK(monitor.misses() == 2);
  CHECK(std::isinf(monitor.p99()));
  monitor.reset();
  CHECK(monitor.count() == 0);
  CHECK(monitor.misses() == 0);
  CHECK(monitor.deadline() == 5e-4);
  CHECK(monitor.p50() == 0.0);
}

TEST_CASE("The clocks run forward, and the thread clock counts work", "[deadline]") {
  const double wall = DeadlineMonitor::wall_now(), cpu = DeadlineMonitor::cpu_now();
  volatile double sum = 0.0;
  while (DeadlineMonitor::cpu_now() - cpu < 2e-3) sum = sum + 1.0;
  CHECK(DeadlineMonitor::wall_now() - wall >= 1.9e-3);
}

TEST_CASE("The library's version is that of the headers", "[version]") {
  const std::string expected = std::to_string(BRISTLE_VERSION_MAJOR) + "." +
                               std::to_string(BRISTLE_VERSION_MINOR) + "." +
                               std::to_string(BRISTLE_VERSION_PATCH);
  CHECK(bristle::library_version() == expected);
}
