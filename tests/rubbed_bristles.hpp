// Bristles that can be rubbed, written for reading: one axis, bristle by bristle, in steps so short that the
// order of snaps and renewals within one does not matter. Nothing here comes from bristle itself.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "tests/brute_force.hpp"

namespace bristle_test {

class RubbedBristles {
 public:
  /// Straight, snap lengths drawn. `finest` (m) bounds a step.
  RubbedBristles(std::size_t count, Quantile quantile, double residual, double renewal, double finest,
                 std::uint64_t seed)
      : quantile_(std::move(quantile)),
        residual_(residual),
        renewal_(renewal),
        finest_(finest),
        generator_(seed),
        z_(count, 0.0),
        delta_(count) {
    for (double& delta : delta_) delta = quantile_(share());
  }

  /// Moves by d.
  void move(double d) {
    const auto pieces = static_cast<int>(std::ceil(std::abs(d) / finest_));
    for (int i = 0; i < pieces; ++i) piece(d / pieces);
  }

  double mean_deflection() const {
    double sum = 0.0;
    for (const double z : z_) sum += z;
    return sum / static_cast<double>(z_.size());
  }

 private:
  double share() { return (static_cast<double>(generator_() >> 11) + 0.5) * 0x1p-53; }

  void piece(double d) {
    const double e = d > 0.0 ? 1.0 : -1.0;
    std::size_t snaps = 0;
    for (std::size_t i = 0; i < z_.size(); ++i) {
      z_[i] += d;
      if (std::abs(z_[i]) < residual_ + delta_[i]) continue;
      // It goes on from the place where it snapped.
      z_[i] = residual_ * e + e * (std::abs(z_[i]) - residual_ - delta_[i]);
      delta_[i] = quantile_(share());
      ++snaps;
    }
    // As many draws over all bristles: each hits one, and counts if it is bent along the motion.
    draws_ += renewal_ * static_cast<double>(snaps);
    for (; draws_ >= 1.0; draws_ -= 1.0) {
      const auto i = static_cast<std::size_t>(share() * static_cast<double>(z_.size()));
      if (z_[i] * e <= residual_) continue;
      z_[i] = residual_ * e;
      delta_[i] = quantile_(share());
    }
  }

  Quantile quantile_;
  double residual_, renewal_, finest_, draws_ = 0.0;
  std::mt19937_64 generator_;
  std::vector<double> z_, delta_;
};

}  // namespace bristle_test
