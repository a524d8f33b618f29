// What the plots look back on: the points of the last seconds, and how long ticks took.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tools/virtual_room/room_state.hpp"

namespace room {

class History {
 public:
  static constexpr std::size_t capacity = std::size_t{1} << 17;

  History() : points_(capacity) {}

  /// A time before that of the last point (reset, replay) begins anew; one that is no number is
  /// left out.
  void add(const PlotPoint& point);
  void clear();

  std::size_t size() const { return size_; }
  /// 0 is the oldest.
  const PlotPoint& operator[](std::size_t i) const {
    return points_[(next_ + capacity - size_ + i) % capacity];
  }
  const PlotPoint& newest() const { return (*this)[size_ - 1]; }
  /// Index of the first point of the last `seconds`.
  std::size_t first_of_last(float seconds) const;

 private:
  std::vector<PlotPoint> points_;
  std::size_t next_ = 0, size_ = 0;
};

/// Counts of computing times in classes of equal ratio.
class TimeHistogram {
 public:
  static constexpr int per_decade = 12, decades = 5;
  static constexpr int classes = per_decade * decades;
  static constexpr double least = 1e-7;  ///< s, where the first class begins

  void add(double seconds);
  void clear() {
    counts_ = {};
    total_ = 0;
  }
  std::uint64_t count(int which) const { return counts_[static_cast<std::size_t>(which)]; }
  std::uint64_t total() const { return total_; }
  static double begin_of(int which);

 private:
  std::array<std::uint64_t, classes> counts_{};
  std::uint64_t total_ = 0;
};

}  // namespace room
