// Friction of springs with blocks, as an experiment would record it, to check `bristle fit --rule slide`. It
// uses nothing of bristle.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/synthetic_friction.hpp"

namespace bristle_test {

/// Springs in parallel, each with a block that slides at its own limit.
class Springs {
 public:
  explicit Springs(std::vector<double> limits) : limit_(std::move(limits)), z_(limit_.size(), 0.0) {
    for (const double l : limit_) sum_ += l;
  }
  /// Returns the friction at a displacement d, over that of full sliding. Leaves the springs as they are.
  double after(double d) const {
    double force = 0.0;
    for (std::size_t i = 0; i < z_.size(); ++i) force += std::clamp(z_[i] + d, -limit_[i], limit_[i]);
    return force / sum_;
  }
  void move(double d) {
    for (std::size_t i = 0; i < z_.size(); ++i) z_[i] = std::clamp(z_[i] + d, -limit_[i], limit_[i]);
  }

 private:
  std::vector<double> limit_, z_;
  double sum_ = 0.0;
};

/// Returns the limits of `count` springs: quantiles of a lognormal law, each in the middle of an equal share.
inline std::vector<double> sliding_limits(std::size_t count, double mean, double spread) {
  const auto quantile = lognormal_quantile(mean, spread);
  std::vector<double> all;
  for (std::size_t i = 0; i < count; ++i)
    all.push_back(quantile((static_cast<double>(i) + 0.5) / static_cast<double>(count)));
  return all;
}

/// Record of an experiment with such springs under a load of 2 N, sampled at 100 Hz.
struct SlidingSprings {
  double kinetic = 0.35, noise = 0.01, offset = 0.03, seconds = 10.0;
  double spread = 0.6;
  std::vector<double> of = sliding_limits(1000, 15e-6, spread);
  // Softening q of the stage (m/N^2): where x and the force F are recorded, the contact is at x - q F^2.
  double softening = 0.0;
  double damping = 0.0, stribeck = 1e-3;  // damper over load, s/m, and the speed over which it fades, m/s
  std::function<double(double)> motion = loops_and_strokes;
  std::function<double(double)> growth = [](double) { return 1.0; };  // growth of friction over time (s)
  std::function<double(double)> drift = [](double) { return 0.0; };   // sensor's drift, N, over time (s)

  double mean_limit() const {
    double sum = 0.0;
    for (const double l : of) sum += l;
    return sum / static_cast<double>(of.size());
  }
  std::string csv(unsigned seed) const {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> sensor(0.0, noise);
    Springs springs(of);
    std::string text = "t,x,load,force\n";
    double x = 0.0, force = 0.0;
    for (int i = 0; i < static_cast<int>(100.0 * seconds); ++i) {
      const double t = 0.01 * i, next = motion(t), most = 2.0 * kinetic * growth(t);
      const auto moved = [&](double f) { return next - x - softening * (f * f - force * force); };
      double low = -most, high = most;
      for (int k = 0; k < 50; ++k) {
        const double middle = 0.5 * (low + high);
        (middle < most * springs.after(moved(middle)) ? low : high) = middle;
      }
      const double f = 0.5 * (low + high);
      springs.move(moved(f));
      force = f;
      x = next;
      const double v = (motion(t + 1e-4) - motion(t - 1e-4)) / 2e-4;
      const double damper = 2.0 * damping * v * std::exp(-std::abs(v) / stribeck);
      const double shown = f + damper + offset + drift(t) + sensor(generator);
      text += fmt::format("{:.17g},{:.17g},2,{:.17g}\n", t, x, shown);
    }
    return text;
  }
};

}  // namespace bristle_test
