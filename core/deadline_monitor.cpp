#include "bristle/deadline_monitor.hpp"

#include <algorithm>
#include <limits>

#if defined(__unix__) || defined(__APPLE__)
#include <ctime>
#else
#include <chrono>
#endif

namespace bristle {

namespace {

constexpr int mantissa_bits = 6;  // 64 buckets per octave

// Bucket 0 holds 0 ns; below 2^6 ns every nanosecond has a bucket of its own, spread over the octaves
// as if it had all mantissa bits, so that one formula serves.
int bucket_of(std::uint64_t ns, int last) noexcept {
  if (ns == 0) return 0;
  int octave = 0;
  while (octave < 63 && (ns >> octave) > 1) ++octave;
  const std::uint64_t fraction =
      octave >= mantissa_bits ? (ns >> (octave - mantissa_bits)) & 63 : (ns << (mantissa_bits - octave)) & 63;
  return std::min(octave * 64 + static_cast<int>(fraction) + 1, last);
}

/// Largest whole number of nanoseconds in a bucket, in seconds.
double upper_edge_s(int bucket) noexcept {
  if (bucket == 0) return 0.0;
  const int octave = (bucket - 1) / 64;
  const std::uint64_t mantissa = static_cast<std::uint64_t>(64 + (bucket - 1) % 64);
  const std::uint64_t ns = octave >= mantissa_bits ? ((mantissa + 1) << (octave - mantissa_bits)) - 1
                                                   : mantissa >> (mantissa_bits - octave);
  return static_cast<double>(ns) * 1e-9;
}

#if defined(__unix__) || defined(__APPLE__)
double read_clock(clockid_t clock) noexcept {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}
#endif

}  // namespace

DeadlineMonitor::DeadlineMonitor(double deadline_s) noexcept : deadline_s_(deadline_s) {}

void DeadlineMonitor::record(double wall_s, double cpu_s) noexcept {
  if (!(wall_s >= 0.0)) wall_s = 0.0;  // a clock that went back, or NaN
  ++count_;
  sum_s_ += wall_s;
  max_s_ = std::max(max_s_, wall_s);
  if (wall_s > deadline_s_) {
    ++misses_;
    if (!(cpu_s >= 0.0) || cpu_s > deadline_s_) ++misses_ours_;
  }
  constexpr int last = buckets_per_octave * octaves;
  // Above 2^36 ns (69 s) all falls into the last bucket, whose percentile is the maximum.
  const double ns = wall_s * 1e9 + 0.5;
  const int bucket = ns < 0x1p36 ? bucket_of(static_cast<std::uint64_t>(ns), last) : last;
  std::uint32_t& cell = histogram_[bucket];
  if (cell != std::numeric_limits<std::uint32_t>::max()) ++cell;
}

void DeadlineMonitor::reset() noexcept { *this = DeadlineMonitor(deadline_s_); }

double DeadlineMonitor::percentile(double share) const noexcept {
  if (count_ == 0) return 0.0;
  constexpr int last = buckets_per_octave * octaves;
  // The smallest time that at least this share of the ticks does not exceed.
  const double wanted = std::min(std::max(share, 0.0), 1.0) * static_cast<double>(count_);
  std::uint64_t seen = 0;
  for (int bucket = 0; bucket < last; ++bucket) {
    seen += histogram_[bucket];
    if (seen > 0 && static_cast<double>(seen) >= wanted) return std::min(upper_edge_s(bucket), max_s_);
  }
  return max_s_;
}

double DeadlineMonitor::wall_now() noexcept {
#if defined(__unix__) || defined(__APPLE__)
  return read_clock(CLOCK_MONOTONIC);
#else
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
#endif
}

double DeadlineMonitor::cpu_now() noexcept {
#if defined(__unix__) || defined(__APPLE__)
  return read_clock(CLOCK_THREAD_CPUTIME_ID);
#else
  return wall_now();  // no thread clock: every late tick counts as ours
#endif
}

}  // namespace bristle
