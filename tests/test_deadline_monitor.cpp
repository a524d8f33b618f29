// DeadlineMonitor, compared with sorted arrays of times.
#include <catch2/catch.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>

#include "shared_core.hpp"
#endif

#include <bristle/deadline_monitor.hpp>
#include <bristle/version.hpp>

#include "expect.hpp"

namespace bristle_test::test_deadline_monitor {

using bristle::DeadlineMonitor;
using bristle::ThreadEvents;
using bristle::Tick;
using bristle::TimeHistogram;

namespace {

/// Returns the smallest of the times that at least `share` of them do not exceed.
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
    monitor.record(100.0, 0.0);  // a large time, so that the maximum does not limit the percentiles
    if (!(monitor.p50() >= t - 0.6e-9 && monitor.p50() <= t * (1.0 + 1.0 / 64) + 0.6e-9)) {
      FAIL_CHECK("a time of " << t << " s is reported as " << monitor.p50() << " s");
    }
  }
  DeadlineMonitor monitor(1e-3);
  monitor.record(1e-3, 0.0);
  CHECK(monitor.p50() == 1e-3);  // a single time is its own percentile, not the end of its bucket
}

TEST_CASE("A late tick is ours when its thread used more than the budget, else the machine's", "[deadline]") {
  DeadlineMonitor monitor(1e-3);
  monitor.record(0.5e-3, 0.4e-3);  // a tick in time
  monitor.record(1e-3, 1e-3);      // a tick that ends exactly at its deadline
  monitor.record(2e-3, 1.5e-3);    // a late tick, the program's fault
  monitor.record(2e-3, 0.2e-3);    // a late tick that was preempted: the machine's fault
  monitor.record(3e-3, 1e-3);      // a late tick whose CPU time did not exceed the deadline
  monitor.record(2e-3);            // a late tick of unknown CPU time: the program's fault
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

TEST_CASE("Buckets hold every record once, within their edges", "[deadline]") {
  std::mt19937_64 random(3);
  std::lognormal_distribution<double> law(std::log(2e-6), 3.0);
  TimeHistogram histogram;
  std::vector<double> times;
  for (int i = 0; i < 20000; ++i) {
    // Whole nanoseconds, which the buckets' edges hold exactly.
    times.push_back(std::round(law(random) * 1e9) * 1e-9);
    histogram.record(times.back());
  }
  std::uint64_t all = 0;
  for (int b = 0; b < TimeHistogram::buckets; ++b) {
    const TimeHistogram::Bucket bucket = histogram.bucket(b);
    all += bucket.count;
    if (bucket.count == 0) continue;
    const auto inside = std::count_if(times.begin(), times.end(), [&](double t) {
      return (t > bucket.low_s + 0.5e-9 || b == 0) && t < bucket.high_s + 0.5e-9;
    });
    if (inside != bucket.count) FAIL_CHECK(bucket.low_s << " to " << bucket.high_s << " s: " << bucket.count);
  }
  CHECK(all == times.size());
  CHECK(histogram.count() == times.size());
}

TEST_CASE("Jitter is how far the time from start to start is off the period, pauses left out", "[deadline]") {
  DeadlineMonitor monitor(1e-3, 1e-3);
  const auto tick = [&](double due_s, double late_s) {
    monitor.record_tick(Tick{due_s, due_s + late_s, due_s + late_s + 0.2e-3, 0.1e-3});
  };
  tick(5.000, 10e-6);
  tick(5.001, 40e-6);  // a period 30 us too long
  tick(5.002, 20e-6);  // a period 20 us too short
  tick(5.005, 0e-6);   // two ticks are skipped: the period is 2 ms - 20 us too long
  monitor.pause();
  tick(9.000, 70e-6);
  tick(9.001, 70e-6);  // the first tick after a pause has no period
  const TimeHistogram& jitter = monitor.period_jitter();
  REQUIRE(jitter.count() == 4);
  CHECK(jitter.max() == Approx(2e-3 - 20e-6).epsilon(1e-9));
  CHECK(jitter.mean() == Approx((30e-6 + 20e-6 + 2e-3 - 20e-6 + 0.0) / 4.0).epsilon(1e-9));
  CHECK(jitter.percentile(0.75) == Approx(30e-6).epsilon(1.0 / 64));
  CHECK(jitter.percentile(0.5) == Approx(20e-6).epsilon(1.0 / 64));
  CHECK(monitor.p50() == Approx(0.2e-3).epsilon(1.0 / 64));
  CHECK(monitor.misses() == 0);

  DeadlineMonitor aperiodic(1e-3);
  aperiodic.record_tick(Tick{1.0, 1.0, 1.1, 0.0});
  aperiodic.record_tick(Tick{2.0, 2.0, 2.1, 0.0});
  CHECK(aperiodic.period_jitter().count() == 0);
}

TEST_CASE("A tick is late when it ends too long after it was due, however short its step", "[deadline]") {
  DeadlineMonitor monitor(1e-3, 1e-3);
  monitor.record_tick(Tick{1.000, 1.0000, 1.0009, 0.9e-3});  // a tick in time
  monitor.record_tick(Tick{1.001, 1.0015, 1.0019, 0.4e-3});  // a tick that started late but ended in time
  // A tick that was woken too late: caused by the machine.
  monitor.record_tick(Tick{1.002, 1.0029, 1.0033, 0.4e-3});
  // A tick whose step took too long: caused by this program.
  monitor.record_tick(Tick{1.004, 1.0040, 1.0056, 1.5e-3});
  CHECK(monitor.misses() == 2);
  CHECK(monitor.misses_ours() == 1);
  CHECK(monitor.misses_machine() == 1);
  CHECK(monitor.longest_run() == 2);
  const DeadlineMonitor::WorstTick worst = monitor.worst();
  CHECK(worst.number == 3);
  CHECK(worst.late);
  CHECK(worst.end_after_due == Approx(1.6e-3));
  CHECK(worst.started_late == 0.0);
  CHECK(worst.step == Approx(1.6e-3));
  CHECK(worst.cpu == 1.5e-3);
  monitor.record_tick(Tick{1.006, 1.0090, 1.0091, 0.1e-3});
  CHECK(monitor.worst().number == 4);
  CHECK(monitor.worst().started_late == Approx(3e-3));
  CHECK(monitor.worst().step == Approx(0.1e-3));
  CHECK(monitor.max() == Approx(1.6e-3));  // step time of tick 3, the longest
}

TEST_CASE("The longest run counts late and skipped ticks in a row", "[deadline]") {
  DeadlineMonitor monitor(1e-3, 1e-3);
  const auto run = [&](int late, int in_time) {
    for (int i = 0; i < late; ++i) monitor.record(2e-3, 0.0);
    for (int i = 0; i < in_time; ++i) monitor.record(0.5e-3, 0.0);
  };
  run(0, 3);
  CHECK(monitor.longest_run() == 0);
  run(3, 1);
  run(2, 5);
  CHECK(monitor.longest_run() == 3);
  run(1, 0);
  monitor.record_skipped(4);
  CHECK(monitor.longest_run() == 5);
  run(1, 1);
  CHECK(monitor.longest_run() == 6);
  CHECK(monitor.skipped() == 4);
  CHECK(monitor.misses() == 7);
  run(4, 0);
  monitor.pause();  // ends the present run of late ticks
  run(4, 0);
  CHECK(monitor.longest_run() == 6);
  monitor.reset();
  CHECK(monitor.longest_run() == 0);
  CHECK(monitor.skipped() == 0);
  CHECK(monitor.worst().number == 0);
}

#if defined(__linux__)
TEST_CASE("Page faults and preemptions since the last reading are told of late ticks only", "[deadline]") {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const auto touch = [page](std::size_t pages) {  // touches fresh memory: a page fault for each page
    void* block = mmap(nullptr, pages * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    REQUIRE(block != MAP_FAILED);
    madvise(block, pages * page, MADV_NOHUGEPAGE);
    for (std::size_t i = 0; i < pages; ++i) static_cast<volatile char*>(block)[i * page] = 1;
    munmap(block, pages * page);
  };
  DeadlineMonitor monitor(1e-3);
  monitor.record(0.1e-3, 0.0);
  touch(1000);
  monitor.record(0.1e-3, 0.0);  // a tick in time reads no counters
  CHECK(monitor.late_events().minor_faults == 0);
  monitor.refresh_events();
  touch(100);
  // Expects for the late tick only the hundred page faults since the last refresh, not the thousand before
  // it.
  monitor.record(5e-3, 0.0);
  CHECK(monitor.late_events().minor_faults >= 100);
  CHECK(monitor.late_events().minor_faults < 1000);
  CHECK(monitor.worst().events.minor_faults == monitor.late_events().minor_faults);

  const SharedCore shared;
  monitor.refresh_events();
  const std::uint64_t known = monitor.late_events().involuntary_switches;
  const double start = DeadlineMonitor::wall_now();
  while (ThreadEvents::now().other_switches == 0 || DeadlineMonitor::wall_now() - start < 0.05) {
    if (DeadlineMonitor::wall_now() - start > 5.0) break;
  }
  monitor.record(DeadlineMonitor::wall_now() - start, 0.0);
  CHECK(monitor.late_events().involuntary_switches > known);
  CHECK(monitor.late_events().other_switches > 0);
}
#endif

TEST_CASE("Counters that were not read at one moment never differ by less than nothing", "[deadline]") {
  const ThreadEvents before{5, 8, 100, 3}, after{7, 7, 100, 4};
  const ThreadEvents since = after - before;
  CHECK(since.involuntary_switches == 2);
  CHECK(since.other_switches == 0);
  CHECK(since.minor_faults == 0);
  CHECK(since.major_faults == 1);
}

TEST_CASE("A reader finds a monitor that is assigned or reset as it was or as it is", "[deadline][threads]") {
  const auto with = [](int ticks) {
    DeadlineMonitor m(1e-3);
    for (int i = 0; i < ticks; ++i) m.record(2e-3, 2e-3);
    return m;
  };
  const DeadlineMonitor few = with(10), many = with(1000);
  DeadlineMonitor monitor = few;
  std::atomic<bool> done{false};
  std::atomic<int> turns{0};  // number of times that the reader saw new numbers
  std::uint64_t torn = 0, negative = 0;
  std::thread reader([&] {
    DeadlineMonitor seen;
    std::uint64_t last = 0;
    while (!done) {
      for (int k = 0; k < 1000; ++k) negative += monitor.misses_machine() > 1000;
      if (!monitor.snapshot(seen)) continue;
      turns += seen.count() != last;
      last = seen.count();
      torn += seen.misses() != seen.count() || seen.misses_ours() != seen.count() ||
              (seen.count() > 0 && seen.max() != 2e-3);
    }
  });
  // Runs until the reader has looked often enough, or for three seconds; on a busy machine until it has
  // looked once, or for a minute.
  const double start = DeadlineMonitor::wall_now();
  const auto elapsed = [&] { return DeadlineMonitor::wall_now() - start; };
  for (int k = 0; turns < 1000 && elapsed() < (turns == 0 ? 60.0 : 3.0); ++k) {
    monitor = k % 2 ? few : many;
    if (k % 4 == 0) monitor.reset();
    const double gap = DeadlineMonitor::wall_now();  // leaves a gap between two ticks, as in a servo loop
    while (DeadlineMonitor::wall_now() - gap < 1e-5) continue;
  }
  done = true;
  reader.join();
  CHECK(turns > 0);
  CHECK(torn == 0);
  CHECK(negative == 0);
  CHECK(monitor.deadline() == 1e-3);
}

TEST_CASE("A snapshot taken while another thread records holds whole ticks only", "[deadline][threads]") {
  // Records ticks: tick k ends k us after it was due, and every second one has used more CPU time than the
  // deadline, so for any whole number of ticks the numbers are related in closed form.
  const std::uint64_t ticks = bristle_test::test_size(20000);
  const double longest_s = 1e-6 * static_cast<double>(ticks);
  constexpr double us = 1e-6;
  DeadlineMonitor monitor(0.5 * us, 1e-3);
  std::atomic<bool> done{false};
  std::atomic<std::uint64_t> snapshots{0};
  std::uint64_t refused = 0, torn = 0, backward = 0, last_count = 0;
  std::thread reader([&] {
    DeadlineMonitor seen;
    while (!done) {
      if (!monitor.snapshot(seen)) {
        ++refused;
        // Lets the other thread go on, which may have lost its core in the middle of a tick.
        std::this_thread::yield();
        continue;
      }
      ++snapshots;
      const std::uint64_t n = seen.count();
      std::uint64_t in_buckets = 0;
      for (int b = 0; b < TimeHistogram::buckets; ++b) in_buckets += seen.step_times().bucket(b).count;
      const double d = static_cast<double>(n);
      const bool whole =
          in_buckets == n && seen.misses() == n && seen.misses_ours() == n / 2 && seen.longest_run() == n &&
          seen.period_jitter().count() == (n > 0 ? n - 1 : 0) && std::fabs(seen.max() - d * us) < 1e-9 &&
          std::fabs(seen.mean() * d - 0.5 * d * (d + 1.0) * us) < 1e-6 * (d + 1.0) * us * d + 1e-12 &&
          (n == 0 || seen.worst().number == n - 1);
      if (!whole) ++torn;
      if (n < last_count) ++backward;
      last_count = n;
      // Getters called after a snapshot never return older numbers than the snapshot.
      if (monitor.count() < n || monitor.misses_machine() > ticks || monitor.p99() > longest_s * 1.02) ++torn;
    }
  });
  for (std::uint64_t k = 1; k <= ticks; ++k) {
    const double due = static_cast<double>(k) * 1e-3;
    monitor.record_tick(Tick{due, due, due + static_cast<double>(k) * us, k % 2 == 0 ? us : 0.0});
    const double start = DeadlineMonitor::wall_now();
    while (k % 4 == 0 && DeadlineMonitor::wall_now() - start < 20e-6) {  // records ticks in bursts of four
    }
  }
  const double end_of_ticks = DeadlineMonitor::wall_now();
  while (snapshots <= 10 && DeadlineMonitor::wall_now() - end_of_ticks < 10.0) std::this_thread::yield();
  done = true;
  reader.join();
  INFO(snapshots << " snapshots, " << refused << " refused");
  CHECK(snapshots > 10);
  CHECK(torn == 0);
  CHECK(backward == 0);
  DeadlineMonitor end;
  REQUIRE(monitor.snapshot(end));
  CHECK(end.count() == ticks);
  CHECK(end.p50() == monitor.p50());
  CHECK(end.deadline() == 0.5 * us);
}

TEST_CASE("The library's version is that of the headers", "[version]") {
  const std::string expected = std::to_string(BRISTLE_VERSION_MAJOR) + "." +
                               std::to_string(BRISTLE_VERSION_MINOR) + "." +
                               std::to_string(BRISTLE_VERSION_PATCH);
  CHECK(bristle::library_version() == expected);
}

}  // namespace bristle_test::test_deadline_monitor
