// An independent model of the brush with residual, shared renewal and ageing: bristle by bristle, in steps so
// small that the order of events within one does not matter. It uses nothing of bristle.
//
// A bristle snaps at |z| = residual + delta g(age) to z = residual e, e the direction of motion. A snap draws
// `renewal` bristles on average, from all; if a drawn one is bent along the motion by more than the residual,
// it slips to the residual and samples a fresh length, unless it keeps its own. Lengths and times may be in
// any unit; results are means over the bristles.
#pragma once

#include <cmath>
#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "brute_force.hpp"

namespace bristle_test {

class RubbedBristles {
 public:
  /// Makes bristles. `growth`: the function g of a bristle's age, 1 at age 0, never falling.
  RubbedBristles(
      std::size_t count, Quantile quantile, double residual, double renewal, std::uint64_t seed,
      std::function<double(double)> growth = [](double) { return 1.0; })
      : quantile_(std::move(quantile)),
        growth_(std::move(growth)),
        residual_(residual),
        renewal_(renewal),
        generator_(seed),
        bristles_(count) {
    for (Bristle& b : bristles_) b.delta = quantile_(flat());
  }

  /// Moves the body by (dx, dy) within the given time, cut into pieces of at most `piece`.
  void step(double dx, double dy, double piece, double seconds = 0.0) {
    const double path = std::hypot(dx, dy);
    const int pieces = static_cast<int>(path / piece) + 1;
    for (int k = 0; k < pieces; ++k) {
      now_ += seconds / pieces;
      if (path > 0.0) small_step(dx / path, dy / path, path / pieces, seconds / path);
    }
  }

  double x() const { return mean(&Bristle::x); }
  double y() const { return mean(&Bristle::y); }
  bool keep = false;     ///< whether a bristle has its own length for ever
  double snaps = 0.0;    ///< number of snaps of all bristles so far
  double renewed = 0.0;  ///< number of renewals of all bristles so far

 private:
  struct Bristle {
    double x = 0.0, y = 0.0, delta = 0.0, birth = 0.0;
  };

  double flat() { return (static_cast<double>(generator_() >> 11) + 0.5) * 0x1p-53; }
  double mean(double Bristle::*value) const {
    double sum = 0.0;
    for (const Bristle& b : bristles_) sum += b.*value;
    return sum / static_cast<double>(bristles_.size());
  }

  /// Restarts a bristle at the residual deflection with a fresh length, and moves it on by the path `left`.
  void renew(Bristle& b, double ex, double ey, double left, double per_length) {
    const double delta = keep ? b.delta : quantile_(flat());
    b = {(residual_ + left) * ex, (residual_ + left) * ey, delta, now_ - left * per_length};
  }
  void small_step(double ex, double ey, double h, double per_length) {
    double snapped = 0.0;
    for (Bristle& b : bristles_) {
      b.x += h * ex;
      b.y += h * ey;
      while (std::hypot(b.x, b.y) > residual_ + b.delta) {
        const double strength = residual_ + b.delta * growth_(now_ - b.birth);
        if (std::hypot(b.x, b.y) <= strength) break;
        const double along = b.x * ex + b.y * ey;
        const double across = b.x * ey - b.y * ex;
        const double over =
            std::fmin(along - std::sqrt(std::fmax(strength * strength - across * across, 0.0)), h);
        renew(b, ex, ey, over, per_length);
        snapped += 1.0;
      }
    }
    snaps += snapped;
    drawn_ += renewal_ * snapped;
    for (; drawn_ >= 1.0; drawn_ -= 1.0) {
      Bristle& b = bristles_[static_cast<std::size_t>(flat() * static_cast<double>(bristles_.size()))];
      // Path left in the piece after the bristle's renewal, which happens at a random point of the piece.
      const double left = h * flat();
      if (b.x * ex + b.y * ey - left <= residual_) continue;
      renew(b, ex, ey, left, per_length);
      renewed += 1.0;
    }
  }

  Quantile quantile_;
  std::function<double(double)> growth_;
  double residual_, renewal_;
  std::mt19937_64 generator_;
  std::vector<Bristle> bristles_;
  double now_ = 0.0;  ///< time since the start of the simulation
  /// Number of renewals due to earlier snaps and not yet made, below one.
  double drawn_ = 0.0;
};

/// Returns the mean deflection in steady sliding by simulation, without a formula.
inline double kinetic_bend(RubbedBristles sliding, double length, double piece) {
  sliding.step(20.0 * length, 0.0, piece);
  double sum = 0.0;
  for (int i = 0; i < 40; ++i) {
    sliding.step(0.25 * length, 0.0, piece);
    sum += sliding.x() / 40.0;
  }
  return sum;
}

/// Record of a simulated experiment in a file: strokes of one to four presliding lengths (18 um, a third of
/// it residual) to either side, at 50 Hz under 2 N, with noise of 10 mN.
struct RubbedStrokes {
  static constexpr double kinetic = 0.35, length = 12e-6, residual = 6e-6, renewal = 1.5, spread = 0.4;
  std::string csv(std::uint64_t seed) const {
    const auto brush = [](std::size_t bristles, std::uint64_t of) {
      return RubbedBristles(bristles, lognormal_quantile(length, spread), residual, renewal, of);
    };
    static const double bend = kinetic_bend(brush(20000, 18), length, length / 50.0);
    RubbedBristles bristles = brush(1800, seed);
    std::mt19937_64 generator(seed + 1);
    std::normal_distribution<double> noise(0.0, 0.01);
    std::string text = "t,x,load,force\n";
    double x = 0.0;
    for (int i = 0; i < 500; ++i) {
      const double t = 0.02 * i, swing = 18e-6 * (1.0 + 3.0 * t / 10.0);
      const double next = swing * std::sin(2.0 * M_PI * 0.8 * t);
      bristles.step(next - x, 0.0, length / 50.0);
      x = next;
      text += fmt::format("{},{},2,{}\n", t, x, kinetic * 2.0 * bristles.x() / bend + noise(generator));
    }
    return text;
  }
};

}  // namespace bristle_test
