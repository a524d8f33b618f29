// A histogram of times, in constant memory.
#pragma once

#include <atomic>
#include <cstdint>

#include "bristle/export.hpp"

namespace bristle {

namespace detail {

/// A number that one thread writes and any thread reads, never half-written; as cheap as a plain one. Access
/// is by release and acquire, so a reader that sees a number also sees everything written before it.
template <class T>
class SharedNumber {
 public:
  SharedNumber(T value = T()) noexcept : value_(value) {}
  SharedNumber(const SharedNumber& other) noexcept : value_(other.get()) {}
  SharedNumber& operator=(const SharedNumber& other) noexcept {
    set(other.get());
    return *this;
  }
  T get() const noexcept { return value_.load(std::memory_order_acquire); }
  void set(T value) noexcept { value_.store(value, std::memory_order_release); }
  void add(T value) noexcept { set(static_cast<T>(value_.load(std::memory_order_relaxed) + value)); }

 private:
  std::atomic<T> value_;
  static_assert(std::atomic<T>::is_always_lock_free, "a lock would stop the thread that records");
};

}  // namespace detail

/// Times, rounded to 1 ns, in logarithmic buckets, 64 per octave from 1 ns to 69 s: percentiles are at most
/// 1.6 % high and never low, the maximum is exact. 9 kB, no allocation, no lock.
///
/// One thread records; any thread may read at the same time. Each number read is whole, but two of them may
/// be some records apart: DeadlineMonitor::snapshot gives all numbers of one moment.
class BRISTLE_API TimeHistogram {
 public:
  /// Records a time in s; negative times and NaN count as 0. A bucket counts to at most 2^32 - 1, five days
  /// at 10 kHz if all times are in one bucket. Percentiles follow from the buckets.
  void record(double time_s) noexcept;

  std::uint64_t count() const noexcept { return count_.get(); }
  /// Returns the smallest time, s, that at least this share of the records does not exceed; share in [0, 1].
  double percentile(double share) const noexcept;
  double max() const noexcept { return max_s_.get(); }  ///< longest time, s, exact
  double mean() const noexcept {
    const std::uint64_t n = count();
    return n ? sum_s_.get() / static_cast<double>(n) : 0.0;
  }

  /// Times in one bucket of the histogram: above low_s and up to high_s. The last bucket has no upper limit
  /// but max().
  struct Bucket {
    double low_s, high_s;
    std::uint32_t count;
  };
  static constexpr int buckets = 64 * 36 + 1;
  /// Returns the bucket with this index, in [0, buckets).
  Bucket bucket(int index) const noexcept;

 private:
  detail::SharedNumber<std::uint64_t> count_;
  detail::SharedNumber<double> max_s_, sum_s_;
  detail::SharedNumber<std::uint32_t> cells_[buckets];
};

}  // namespace bristle
