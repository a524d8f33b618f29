// Step times against a deadline, in constant memory.
#pragma once

#include <cstdint>

#include "bristle/export.hpp"

namespace bristle {

/// Histogram of step times with logarithmic buckets (64 per octave from 1 ns to 64 s: percentiles are
/// at most 1.6 % high). Plain data; one thread records. No allocation, no lock.
///
/// A late tick is ours when the thread's CPU time in it exceeds the budget; other late ticks are the
/// machine's (preemption, steal).
class BRISTLE_API DeadlineMonitor {
 public:
  explicit DeadlineMonitor(double deadline_s = 1e-3) noexcept;

  /// One step: wall time and CPU time of the stepping thread, s. A negative cpu_s means "not measured":
  /// a late tick then counts as ours.
  void record(double wall_s, double cpu_s = -1.0) noexcept;
  void reset() noexcept;

  double deadline() const noexcept { return deadline_s_; }
  std::uint64_t count() const noexcept { return count_; }
  double percentile(double share) const noexcept;  ///< s; share in [0, 1], e.g. 0.999
  double p50() const noexcept { return percentile(0.5); }
  double p99() const noexcept { return percentile(0.99); }
  double p999() const noexcept { return percentile(0.999); }
  double max() const noexcept { return max_s_; }  ///< s, exact
  double mean() const noexcept { return count_ ? sum_s_ / static_cast<double>(count_) : 0.0; }
  std::uint64_t misses() const noexcept { return misses_; }            ///< ticks over the deadline
  std::uint64_t misses_ours() const noexcept { return misses_ours_; }  ///< of these, with CPU time over it
  std::uint64_t misses_machine() const noexcept { return misses_ - misses_ours_; }

  /// Wall clock (monotonic) and CPU time of the calling thread, s. For record().
  static double wall_now() noexcept;
  static double cpu_now() noexcept;

 private:
  static constexpr int buckets_per_octave = 64;
  static constexpr int octaves = 36;
  double deadline_s_;
  double max_s_ = 0.0;
  double sum_s_ = 0.0;
  std::uint64_t count_ = 0;
  std::uint64_t misses_ = 0;
  std::uint64_t misses_ours_ = 0;
  std::uint32_t histogram_[buckets_per_octave * octaves + 1] = {};
};

}  // namespace bristle
