#include "tools/products/virtual_room/history.hpp"

#include <algorithm>
#include <cmath>
#include <ranges>

namespace room {

void History::add(const PlotPoint& point) {
  for (const float value : {point.time, point.displacement, point.friction, point.applied}) {
    if (!std::isfinite(value)) return;
  }
  if (size_ > 0 && point.time < newest().time) clear();
  points_[next_] = point;
  next_ = (next_ + 1) % capacity;
  size_ = std::min(size_ + 1, capacity);
}

void History::clear() { next_ = size_ = 0; }

std::size_t History::first_of_last(float seconds) const {
  if (size_ == 0) return 0;
  const auto indices = std::views::iota(std::size_t{0}, size_);
  const float begin = newest().time - seconds;
  return *std::ranges::lower_bound(indices, begin, {}, [&](std::size_t i) { return (*this)[i].time; });
}

void FirstBending::set_length(double presliding_length) {
  if (presliding_length > 0 && std::isfinite(presliding_length))
    length_ = static_cast<float>(presliding_length);
}

void FirstBending::add(const PlotPoint& point) {
  if (!std::isfinite(point.time) || !std::isfinite(point.displacement) || !std::isfinite(point.friction))
    return;
  if (!begun_ || point.time < last_time_) {
    points_.clear();
    begin_ = point.displacement;
    farthest_ = 0.0f;
    begun_ = true;
    complete_ = false;
  }
  last_time_ = point.time;
  if (complete_) return;
  const float x = point.displacement - begin_;
  farthest_ = std::max(farthest_, std::abs(x));
  complete_ =
      farthest_ > lengths * length_ || std::abs(x) < farthest_ - back * length_ || points_.size() == capacity;
  const bool moved = points_.empty() || std::abs(x - points_.back().first) > 0.004f * length_;
  if (moved && !complete_) points_.emplace_back(x, -point.friction);
}

void TimeHistogram::add(double seconds) {
  if (!(seconds > 0)) return;
  const double which = std::floor(per_decade * std::log10(seconds / least));
  if (total_ == most) {
    --counts_[newest_[next_]];
    --total_;
  }
  newest_[next_] = static_cast<unsigned char>(std::clamp(which, 0.0, classes - 1.0));
  ++counts_[newest_[next_]];
  ++total_;
  next_ = (next_ + 1) % most;
}

double TimeHistogram::within(double share) const {
  std::uint64_t counted = 0;
  for (int i = 0; i < classes; ++i) {
    counted += count(i);
    if (counted > 0 && static_cast<double>(counted) >= share * static_cast<double>(total_))
      return begin_of(i + 1);
  }
  return 0.0;
}

double TimeHistogram::begin_of(int which) {
  return least * std::pow(10.0, static_cast<double>(which) / per_decade);
}

}  // namespace room
