// An independent model of an area of bristles that slides and spins: many points of a disc, many bristles at
// each, every point on its own arc in short straight pieces. It uses nothing of bristle.
//
// Axes are those of the surface; the points turn with the body. Results are mean deflections: force over zeta
// sigma0 and torque over zeta sigma0, both as the bristles pull the body back, > 0 against the motion.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "brute_force.hpp"

namespace bristle_test {

/// Means over all bristles of the deflection z, and of its moment r x z about the disc's centre.
struct SpinDeflection {
  double x = 0.0, y = 0.0;
  double torque = 0.0;
};

enum class BrutePressure { even, hertz };

class BruteSpin {
 public:
  /// Makes points on a sunflower's spiral, spread so that each carries an equal load. The first snap lengths
  /// of a point's bristles are stratified, all later ones random.
  BruteSpin(std::size_t points, std::size_t bristles_at_each, double radius, BrutePressure pressure,
            Quantile quantile, std::uint64_t seed)
      : per_point_(bristles_at_each), quantile_(std::move(quantile)), generator_(seed) {
    const double golden = M_PI * (3.0 - std::sqrt(5.0));
    for (std::size_t i = 0; i < points; ++i) {
      const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(points);
      const double r = pressure == BrutePressure::even ? std::sqrt(share)
                                                       : std::sqrt(1.0 - std::pow(1.0 - share, 2.0 / 3.0));
      const double angle = golden * static_cast<double>(i);
      points_.push_back({radius * r * std::cos(angle), radius * r * std::sin(angle)});
      for (std::size_t k = 0; k < per_point_; ++k)
        bristles_.push_back(
            {0.0, 0.0, quantile_((static_cast<double>(k) + uniform()) / static_cast<double>(per_point_))});
    }
  }

  /// Moves the centre by (dx, dy) and turns the body by `angle`, both uniformly, in `pieces` pieces. A piece
  /// is straight for every point, so it must be short compared with the radius.
  void move(double dx, double dy, double angle, int pieces) {
    for (int p = 0; p < pieces; ++p) {
      const double c0 = std::cos(angle_), s0 = std::sin(angle_);
      angle_ += angle / pieces;
      const double c1 = std::cos(angle_), s1 = std::sin(angle_);
      for (std::size_t i = 0; i < points_.size(); ++i) {
        const Point at = points_[i];
        const double wx = dx / pieces + (c1 - c0) * at.x - (s1 - s0) * at.y;
        const double wy = dy / pieces + (s1 - s0) * at.x + (c1 - c0) * at.y;
        for (std::size_t k = 0; k < per_point_; ++k) bend(bristles_[i * per_point_ + k], wx, wy);
      }
    }
  }

  SpinDeflection deflection() const {
    const double c = std::cos(angle_), s = std::sin(angle_);
    SpinDeflection sum;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      double zx = 0.0, zy = 0.0;
      for (std::size_t k = 0; k < per_point_; ++k) {
        zx += bristles_[i * per_point_ + k].zx;
        zy += bristles_[i * per_point_ + k].zy;
      }
      sum.x += zx;
      sum.y += zy;
      sum.torque += (c * points_[i].x - s * points_[i].y) * zy - (s * points_[i].x + c * points_[i].y) * zx;
    }
    const double share = 1.0 / static_cast<double>(bristles_.size());
    return {share * sum.x, share * sum.y, share * sum.torque};
  }

 private:
  struct Point {
    double x, y;
  };
  struct Bristle {
    double zx, zy, delta;
  };

  double uniform() { return (static_cast<double>(generator_() >> 11) + 0.5) * 0x1p-53; }

  /// Bends a bristle by the piece (wx, wy) of its path. Where |z| reaches delta it becomes straight, samples
  /// a fresh length, and bends on with the rest of the piece.
  void bend(Bristle& b, double wx, double wy) {
    for (;;) {
      const double zx = b.zx + wx, zy = b.zy + wy;
      if (zx * zx + zy * zy < b.delta * b.delta) {
        b.zx = zx;
        b.zy = zy;
        return;
      }
      // Finds the share t of the piece, 0 to 1, at which |z + t w| = delta, the bristle's snap length.
      const double ww = wx * wx + wy * wy, zw = b.zx * wx + b.zy * wy;
      const double inside = b.delta * b.delta - b.zx * b.zx - b.zy * b.zy;
      const double t = (std::sqrt(zw * zw + ww * inside) - zw) / ww;
      b.zx = b.zy = 0.0;
      b.delta = quantile_(uniform());
      wx *= 1.0 - t;
      wy *= 1.0 - t;
    }
  }

  std::size_t per_point_;
  Quantile quantile_;
  std::mt19937_64 generator_;
  std::vector<Point> points_;
  std::vector<Bristle> bristles_;
  double angle_ = 0.0;
};

/// Returns the torque of a disc of radius 1 turned from rest, over the kinetic torque of short bristles, at
/// every `turn` s = phi R / length, ascending; `length` is the mean snap length. Uses rings and renewal
/// theory instead of random draws: the tangential deflection of a ring follows from the density of its snaps
/// over the angle, a Volterra equation. `survival(l)` = P(delta > l), lengths over the mean; `kinetic` = mean
/// deflection in sliding over the mean length.
inline std::vector<double> turned_from_rest(const std::vector<double>& turns, double length,
                                            BrutePressure pressure,
                                            const std::function<double(double)>& survival, double kinetic,
                                            int rings = 200, int steps_per_length = 100) {
  // Angle turned per step, rad; on the rim of radius 1 this is also the path per step.
  const double step = length / steps_per_length;
  const auto steps = static_cast<std::size_t>(std::llround(turns.back() * steps_per_length));
  std::vector<double> torque(steps + 1, 0.0), alive(steps + 1), pull(steps + 1), born(steps + 1);
  for (int i = 0; i < rings; ++i) {
    const double share = (i + 0.5) / rings;
    const double r = pressure == BrutePressure::even ? std::sqrt(share)
                                                     : std::sqrt(1.0 - std::pow(1.0 - share, 2.0 / 3.0));
    for (std::size_t k = 0; k <= steps; ++k) {  // k: number of steps since bristles were straight
      const double angle = step * static_cast<double>(k);
      // Largest deflection of these since then.
      const double chord = 2.0 * r * std::sin(0.5 * std::fmin(angle, M_PI));
      alive[k] = survival(chord / length);
      pull[k] = alive[k] * r * std::sin(angle);
    }
    // Averages a quantity over the two ends of a step, because the share born[k] of bristles that became
    // straight in step k did so in its middle.
    const auto middle = [&](const std::vector<double>& of, std::size_t k) {
      return 0.5 * (of[k] + of[k - 1]);
    };
    for (std::size_t k = 1; k <= steps; ++k) {
      double left = alive[k];
      for (std::size_t j = 1; j < k; ++j) left += born[j] * middle(alive, k - j + 1);
      born[k] = (1.0 - left) / middle(alive, 1);
      double sum = pull[k];
      for (std::size_t j = 1; j <= k; ++j) sum += born[j] * middle(pull, k - j + 1);
      torque[k] += r * sum / rings;
    }
  }
  const double mean_arm = pressure == BrutePressure::even ? 2.0 / 3.0 : 3.0 * M_PI / 16.0;
  std::vector<double> result;
  for (const double turn : turns) {
    const double position = turn * steps_per_length;
    const auto k = std::min(static_cast<std::size_t>(position), steps - 1);
    const double between = position - static_cast<double>(k);
    result.push_back(((1.0 - between) * torque[k] + between * torque[k + 1]) / (kinetic * length * mean_arm));
  }
  return result;
}

}  // namespace bristle_test
