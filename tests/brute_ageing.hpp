// An independent model of bristles that grow stronger while they hold, to check the library against: bristle
// by bristle in the plane, every snap at its own time, in double precision. It uses nothing of bristle.
//
// A bristle holds up to |z| = residual + delta0 g(a), a the time since its last snap; then z becomes residual
// e, e the direction of motion, and the bristle draws a fresh length or, with keep, has its own again.
// Lengths and times may be in any unit; results are means over the bristles.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "brute_force.hpp"

namespace bristle_test {

class AgedBristles {
 public:
  /// Makes straight bristles. `growth`: the function g of a bristle's age, concave, with g(0) = 1.
  AgedBristles(std::size_t count, Quantile quantile, std::function<double(double)> growth, std::uint64_t seed,
               double residual = 0.0, bool keep = false)
      : quantile_(std::move(quantile)),
        growth_(std::move(growth)),
        generator_(seed),
        residual_(residual),
        keep_(keep),
        bristles_(count) {
    for (Bristle& b : bristles_) b.fresh = draw();
  }
  /// Sets the snap lengths of the first bristles, as many as are given.
  void set_lengths(const std::vector<double>& lengths) {
    for (std::size_t i = 0; i < lengths.size(); ++i) bristles_[i].fresh = lengths[i];
  }

  /// Moves the body by (dx, dy) at constant velocity within the given time.
  void step(double dx, double dy, double seconds) {
    for (Bristle& b : bristles_) advance(b, dx / seconds, dy / seconds, seconds);
  }
  void wait(double seconds) {
    for (Bristle& b : bristles_) b.age += seconds;
  }
  double x() const { return mean(&Bristle::x); }
  double y() const { return mean(&Bristle::y); }
  double x(std::size_t i) const { return bristles_[i].x; }
  double y(std::size_t i) const { return bristles_[i].y; }
  double snaps_per_bristle() const { return snaps_ / static_cast<double>(bristles_.size()); }

 private:
  struct Bristle {
    double x = 0.0, y = 0.0, age = 0.0, fresh = 0.0;
  };

  double draw() { return quantile_((static_cast<double>(generator_() >> 11) + 0.5) * 0x1p-53); }
  double mean(double Bristle::*value) const {
    double sum = 0.0;
    for (const Bristle& b : bristles_) sum += b.*value;
    return sum / static_cast<double>(bristles_.size());
  }
  /// Returns a bristle's deflection less its snap length after the time s of sticking. It is convex in s, so
  /// it crosses 0 once.
  double excess(const Bristle& b, double vx, double vy, double s) const {
    const double bent = std::hypot(b.x + s * vx, b.y + s * vy);
    // As g >= 1, a bristle within its fresh snap length is within the aged one, so g need not be found.
    return bent <= residual_ + b.fresh ? -1.0 : bent - (residual_ + b.fresh * growth_(b.age + s));
  }
  void advance(Bristle& b, double vx, double vy, double left) {
    const double per_speed = residual_ / std::hypot(vx, vy);
    while (excess(b, vx, vy, left) > 0.0) {
      double low = 0.0, high = left;
      for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (low + high);
        (excess(b, vx, vy, middle) > 0.0 ? high : low) = middle;
      }
      left -= high;
      b = {per_speed * vx, per_speed * vy, 0.0, keep_ ? b.fresh : draw()};
      snaps_ += 1.0;
    }
    b.x += left * vx;
    b.y += left * vy;
    b.age += left;
  }

  Quantile quantile_;
  std::function<double(double)> growth_;
  std::mt19937_64 generator_;
  double residual_;
  bool keep_;
  std::vector<Bristle> bristles_;
  double snaps_ = 0.0;  ///< number of snaps of all bristles so far
};

}  // namespace bristle_test
