#include "bristle/time_histogram.hpp"

#include <algorithm>
#include <limits>

#include "core/common/assert.hpp"

namespace bristle {

namespace {

// Number of leading mantissa bits by which a time is sorted into one of the 64 buckets of its octave.
constexpr int mantissa_bits = 6;
constexpr int last = TimeHistogram::buckets - 1;

// Returns the number of the bucket into which a time falls. Bucket 0 is 0 ns. Below 2^6 ns every nanosecond
// has a bucket: such a time has fewer bits than the mantissa part needs, zeros are appended, and one formula
// serves for all.
int bucket_of(std::uint64_t ns) noexcept {
  if (ns == 0) return 0;
  int octave = 0;
  while (octave < 63 && (ns >> octave) > 1) ++octave;
  const std::uint64_t fraction =
      octave >= mantissa_bits ? (ns >> (octave - mantissa_bits)) & 63 : (ns << (mantissa_bits - octave)) & 63;
  BRISTLE_ASSERT((ns >> octave) == 1 && fraction < 64);
  return std::min(octave * 64 + static_cast<int>(fraction) + 1, last);
}

/// Returns the upper end of a bucket, in seconds: its largest whole number of nanoseconds.
double upper_edge_s(int bucket) noexcept {
  BRISTLE_ASSERT(bucket >= 0 && bucket <= last);
  if (bucket == 0) return 0.0;
  const int octave = (bucket - 1) / 64;
  const std::uint64_t mantissa = static_cast<std::uint64_t>(64 + (bucket - 1) % 64);
  const std::uint64_t ns = octave >= mantissa_bits ? ((mantissa + 1) << (octave - mantissa_bits)) - 1
                                                   : mantissa >> (mantissa_bits - octave);
  return static_cast<double>(ns) * 1e-9;
}

}  // namespace

void TimeHistogram::record(double time_s) noexcept {
  if (!(time_s >= 0.0)) time_s = 0.0;  // counts as 0 if the clock went back or gave NaN
  sum_s_.add(time_s);
  if (time_s > max_s_.get()) max_s_.set(time_s);
  // Puts times above 2^36 ns (69 s) into the last bucket. Percentiles that fall into it are reported as the
  // maximum.
  const double ns = time_s * 1e9 + 0.5;
  detail::SharedNumber<std::uint32_t>& cell =
      cells_[ns < 0x1p36 ? bucket_of(static_cast<std::uint64_t>(ns)) : last];
  if (cell.get() != std::numeric_limits<std::uint32_t>::max()) cell.add(1);
  count_.add(1);
}

double TimeHistogram::percentile(double share) const noexcept {
  std::uint64_t count = 0;  // number of times in the buckets; less than count_ if a bucket is full
  for (const auto& cell : cells_) count += cell.get();
  if (count == 0) return 0.0;
  const double wanted = std::min(std::max(share, 0.0), 1.0) * static_cast<double>(count);
  std::uint64_t seen = 0;
  for (int bucket = 0; bucket < last; ++bucket) {
    seen += cells_[bucket].get();
    if (seen > 0 && static_cast<double>(seen) >= wanted) return std::min(upper_edge_s(bucket), max());
  }
  return max();
}

TimeHistogram::Bucket TimeHistogram::bucket(int index) const noexcept {
  return {index == 0 ? 0.0 : upper_edge_s(index - 1), index == last ? max() : upper_edge_s(index),
          cells_[index].get()};
}

}  // namespace bristle
