// An independent model of the brush, to check the library against: one patch, bristle by bristle, in double
// precision, with the standard library's functions and generator. It uses nothing of bristle.
//
// Lengths may be in any unit. Results are per bristle: the mean deflection, not the force (the force on the
// moving body is -stiffness x count x deflection).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <stdexcept>
#include <vector>

namespace bristle_test {

/// Quantile function Q(u): the snap length below which a share u of the bristles lies, 0 < u < 1.
using Quantile = std::function<double(double)>;

/// Returns the inverse of the normal distribution function: a start by Acklam's rational function, then one
/// step of Halley's method on erfc.
inline double inverse_normal(double u) {
  if (!(u > 0.0 && u < 1.0)) throw std::domain_error("inverse_normal needs 0 < u < 1");
  const auto tail = [](double p) {
    const double q = std::sqrt(-2.0 * std::log(p));
    const double top =
        ((((-7.784894002430293e-03 * q - 3.223964580411365e-01) * q - 2.400758277161838e+00) * q -
          2.549732539343734e+00) *
             q +
         4.374664141464968e+00) *
            q +
        2.938163982698783e+00;
    const double bottom =
        (((7.784695709041462e-03 * q + 3.224671290700398e-01) * q + 2.445134137142996e+00) * q +
         3.754408661907416e+00) *
            q +
        1.0;
    return top / bottom;
  };
  double x;
  if (u < 0.02425) {
    x = tail(u);
  } else if (u > 1.0 - 0.02425) {
    x = -tail(1.0 - u);
  } else {
    const double q = u - 0.5;
    const double r = q * q;
    const double top =
        (((((-3.969683028665376e+01 * r + 2.209460984245205e+02) * r - 2.759285104469687e+02) * r +
           1.383577518672690e+02) *
              r -
          3.066479806614716e+01) *
             r +
         2.506628277459239e+00) *
        q;
    const double bottom =
        ((((-5.447609879822406e+01 * r + 1.615858368580409e+02) * r - 1.556989798598866e+02) * r +
          6.680131188771972e+01) *
             r -
         1.328068155288572e+01) *
            r +
        1.0;
    x = top / bottom;
  }
  const double error =
      (0.5 * std::erfc(-x / std::sqrt(2.0)) - u) * std::sqrt(2.0 * M_PI) * std::exp(0.5 * x * x);
  return x - error / (1.0 + 0.5 * x * error);
}

inline Quantile single_quantile(double length) {
  return [=](double) { return length; };
}
inline Quantile uniform_quantile(double low, double high) {
  return [=](double u) { return low + u * (high - low); };
}
/// Returns the quantile function of a snap-length law: normal, cut at 0.
inline Quantile normal_quantile(double mean, double deviation) {
  const double below_zero = 0.5 * std::erfc(mean / (deviation * std::sqrt(2.0)));
  return [=](double u) {
    return std::max(0.0, mean + deviation * inverse_normal(below_zero + u * (1.0 - below_zero)));
  };
}
inline Quantile lognormal_quantile(double mean, double cv) {
  const double s = std::sqrt(std::log1p(cv * cv));
  return [=](double u) { return mean * std::exp(-0.5 * s * s + s * inverse_normal(u)); };
}
inline Quantile exponential_quantile(double mean) {
  return [=](double u) { return -mean * std::log1p(-u); };
}
/// Returns the quantile function of a law by a table: values at 0, 1/(n-1), ..., 1, linear in between.
inline Quantile table_quantile(std::vector<double> values) {
  return [values = std::move(values)](double u) {
    const double position = u * static_cast<double>(values.size() - 1);
    const auto k = std::min(static_cast<std::size_t>(position), values.size() - 2);
    return values[k] + (position - static_cast<double>(k)) * (values[k + 1] - values[k]);
  };
}

struct BruteBristle {
  double zx = 0.0;
  double zy = 0.0;
  double delta = 0.0;
  double dissipated = 0.0;  ///< sum of delta^2 / 2 over the bristle's snaps in the last step
  double mean_x = 0.0;      ///< bristle's deflection, averaged over the last step
  double mean_y = 0.0;
  std::uint64_t snaps = 0;  ///< number of the bristle's snaps in the last step
};

/// Results of a step, as means over the bristles.
struct BruteStep {
  double end_x = 0.0;
  double end_y = 0.0;
  double mean_x = 0.0;
  double mean_y = 0.0;
  double dissipated = 0.0;
  double snaps = 0.0;
};

class BruteForcePatch {
 public:
  /// Makes straight bristles with random snap lengths. With `redraw` each snap samples a fresh length.
  BruteForcePatch(std::size_t bristles, Quantile quantile, bool redraw, std::uint64_t seed)
      : quantile_(std::move(quantile)), redraw_(redraw), generator_(seed), bristles_(bristles) {
    for (BruteBristle& b : bristles_) b.delta = draw();
  }

  std::vector<BruteBristle>& bristles() { return bristles_; }

  /// Moves the body by (dx, dy); every bristle snaps at its exact position in the step.
  BruteStep step(double dx, double dy) {
    const double path = std::hypot(dx, dy);
    BruteStep sum;
    for (BruteBristle& b : bristles_) {
      b.dissipated = 0.0;
      b.snaps = 0;
      b.mean_x = b.zx;
      b.mean_y = b.zy;
      if (path > 0.0) advance(b, dx / path, dy / path, path);
      add(sum, b);
    }
    return average(sum);
  }

  /// Moves the body by (dx, dy) with the paper's literal rule: z += d; if |z| > delta then z = 0.
  BruteStep literal_step(double dx, double dy) {
    BruteStep sum;
    for (BruteBristle& b : bristles_) {
      b.dissipated = 0.0;
      b.snaps = 0;
      b.zx += dx;
      b.zy += dy;
      const double length = std::hypot(b.zx, b.zy);
      if (length > b.delta) {
        b.zx = b.zy = 0.0;
        b.dissipated = 0.5 * length * length;
        b.snaps = 1;
        if (redraw_) b.delta = draw();
      }
      b.mean_x = b.zx;
      b.mean_y = b.zy;
      add(sum, b);
    }
    return average(sum);
  }

 private:
  double draw() {
    // Returns a number of 53 random bits between 0 and 1, never 0 or 1 itself.
    const double u = (static_cast<double>(generator_() >> 11) + 0.5) * 0x1p-53;
    return quantile_(u);
  }

  /// Moves a bristle along the unit vector e, from snap to snap, until the path is used up.
  void advance(BruteBristle& b, double ex, double ey, double path) {
    double left = path;
    double integral_x = 0.0;
    double integral_y = 0.0;
    for (;;) {
      const double along = b.zx * ex + b.zy * ey;
      const double aside = b.zx * ey - b.zy * ex;
      // Finds the positive path t after which |z + t e| = delta, the bristle's snap length.
      const double to_snap =
          std::max(std::sqrt(std::max(b.delta * b.delta - aside * aside, 0.0)) - along, 0.0);
      const double t = std::min(to_snap, left);
      integral_x += t * (b.zx + 0.5 * t * ex);
      integral_y += t * (b.zy + 0.5 * t * ey);
      left -= t;
      if (left <= 0.0) {
        b.zx += t * ex;
        b.zy += t * ey;
        break;
      }
      b.dissipated += 0.5 * b.delta * b.delta;
      ++b.snaps;
      b.zx = b.zy = 0.0;
      if (redraw_) b.delta = draw();
    }
    b.mean_x = integral_x / path;
    b.mean_y = integral_y / path;
  }

  static void add(BruteStep& sum, const BruteBristle& b) {
    sum.end_x += b.zx;
    sum.end_y += b.zy;
    sum.mean_x += b.mean_x;
    sum.mean_y += b.mean_y;
    sum.dissipated += b.dissipated;
    sum.snaps += static_cast<double>(b.snaps);
  }

  BruteStep average(BruteStep sum) const {
    const double n = static_cast<double>(bristles_.size());
    return {sum.end_x / n, sum.end_y / n, sum.mean_x / n, sum.mean_y / n, sum.dissipated / n, sum.snaps / n};
  }

  Quantile quantile_;
  bool redraw_;
  std::mt19937_64 generator_;
  std::vector<BruteBristle> bristles_;
};

}  // namespace bristle_test
