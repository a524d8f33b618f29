// Data of the room's plots: the points of the last seconds, and a histogram of their ticks' computing times.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "tools/products/virtual_room/room_state.hpp"

namespace room {

class History {
 public:
  static constexpr std::size_t capacity = std::size_t{1} << 17;

  History() : points_(capacity) {}

  /// Adds a plot point, unless it contains a NaN. A time that goes back (reset, replay) clears the history.
  void add(const PlotPoint& point);
  void clear();

  std::size_t size() const { return size_; }
  /// Returns plot point number i; 0 is the oldest.
  const PlotPoint& operator[](std::size_t i) const {
    return points_[(next_ + capacity - size_ + i) % capacity];
  }
  const PlotPoint& newest() const { return (*this)[size_ - 1]; }
  /// Returns the index of the first plot point within the last `seconds`.
  std::size_t first_of_last(float seconds) const;

 private:
  std::vector<PlotPoint> points_;
  std::size_t next_ = 0, size_ = 0;
};

/// Curve of friction while the bristles bend for the first time since the reset. It stays when the other
/// plots move on.
class FirstBending {
 public:
  static constexpr std::size_t capacity = 4000;
  static constexpr float lengths = 4.0f;  ///< end of the curve, in presliding lengths
  static constexpr float back = 0.5f;     ///< return of the block that ends the curve, in presliding lengths

  /// Adds a plot point. Call it once for each tick, in order. A time that goes back restarts the curve.
  void add(const PlotPoint& point);
  /// Sets the presliding length (m), from which the curve's resolution and range follow.
  void set_length(double presliding_length);

  std::size_t size() const { return points_.size(); }
  /// Returns point i of the curve: displacement since the reset (m) and the friction against it (N).
  const std::pair<float, float>& operator[](std::size_t i) const { return points_[i]; }

 private:
  std::vector<std::pair<float, float>> points_;
  float length_ = 1e-3f, begin_ = 0.0f, last_time_ = 0.0f, farthest_ = 0.0f;
  bool begun_ = false, complete_ = false;
};

/// Histogram of the computing times of the newest ticks, in classes of equal ratio.
class TimeHistogram {
 public:
  static constexpr int per_decade = 12, decades = 6;
  static constexpr int classes = per_decade * decades;
  static constexpr double least = 1e-7;  ///< lower end of the first class of times, s
  /// Largest number of ticks counted: 8 s at 1 kHz, within which the figures of a slow scene fade.
  static constexpr std::size_t most = 8000;

  /// Counts a tick's time. When `most` ticks are counted, removes the oldest.
  void add(double seconds);
  void clear() { *this = {}; }
  std::uint64_t count(int which) const { return counts_[static_cast<std::size_t>(which)]; }
  std::uint64_t total() const { return total_; }
  static double begin_of(int which);
  /// Returns the time (s) within which this share of the ticks was computed, as the upper end of a class; 0
  /// without ticks.
  double within(double share) const;

 private:
  std::array<std::uint64_t, classes> counts_{};
  std::array<unsigned char, most> newest_{};  // class of each counted tick, in a ring
  std::uint64_t total_ = 0;
  std::size_t next_ = 0;
};

}  // namespace room
