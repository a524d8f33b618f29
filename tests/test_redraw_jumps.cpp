// Redraw at bounded cost: a step with many snaps draws its end state from the law of that state, and not each
// snap (core/MODEL.md, section 12).
// The law is tested against brute force (every snap drawn, brute_force.hpp), against the stationary law of a
// renewal process, and against renewal-reward theory: deflection, snap length, force, dissipated energy and
// its variance.
//
// Level of significance: Kolmogorov-Smirnov at 1e-5, means and variances at 5 standard deviations (6e-7),
// plus the bias of 1e-3 that the design allows a jump. Seeds are fixed, so an outcome never changes between
// runs.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <random>

#include "brute_force.hpp"
#include "expect.hpp"
#include "scenes.hpp"
#include "statistics.hpp"

namespace bristle_test::test_redraw_jumps {

namespace {

constexpr double allowed_bias = 1e-3;

struct JumpLaw {
  const char* name;
  SnapLength law;                ///< law of the snap length (m), whose mean is dbar
  Quantile quantile;             ///< quantile function in mean snap lengths, independent of the library
  std::array<double, 5> moment;  ///< moments E[delta^k] of the law in mean snap lengths, closed form

  /// Whether the law's tail is so heavy that the sampling error of a variance cannot be estimated well.
  bool heavy = false;
};

std::array<double, 5> uniform_moments(double a, double b) {
  std::array<double, 5> m{};
  for (int k = 0; k < 5; ++k)
    m[static_cast<std::size_t>(k)] = (std::pow(b, k + 1) - std::pow(a, k + 1)) / ((k + 1) * (b - a));
  return m;
}
std::array<double, 5> lognormal_moments(double cv) {
  std::array<double, 5> m{};
  for (int k = 0; k < 5; ++k) m[static_cast<std::size_t>(k)] = std::pow(1.0 + cv * cv, 0.5 * k * (k - 1));
  return m;
}
std::array<double, 5> normal_moments(double cv) {
  const double v = cv * cv;
  return {1.0, 1.0, 1.0 + v, 1.0 + 3.0 * v, 1.0 + 6.0 * v + 3.0 * v * v};
}

std::vector<JumpLaw> jump_laws() {
  // Law by a table with the mean 1: four intervals of equal probability.
  const std::vector<double> table{0.3, 0.7, 1.0, 1.3, 1.7};
  std::array<double, 5> table_moment{};
  std::vector<double> metres;
  for (double t : table) metres.push_back(t * dbar);
  for (std::size_t p = 0; p < 4; ++p) {
    const auto piece = uniform_moments(table[p], table[p + 1]);
    for (std::size_t k = 0; k < 5; ++k) table_moment[k] += 0.25 * piece[k];
  }
  return {
      {"normal, cv 0.05", SnapLength::normal(dbar, 0.05 * dbar), normal_quantile(1.0, 0.05),
       normal_moments(0.05)},
      {"lognormal, cv 0.05", SnapLength::lognormal(dbar, 0.05), lognormal_quantile(1.0, 0.05),
       lognormal_moments(0.05)},
      {"lognormal, cv 0.15", SnapLength::lognormal(dbar, 0.15), lognormal_quantile(1.0, 0.15),
       lognormal_moments(0.15)},
      {"uniform, cv 0.29", SnapLength::uniform(0.5 * dbar, 1.5 * dbar), uniform_quantile(0.5, 1.5),
       uniform_moments(0.5, 1.5)},
      {"lognormal, cv 0.3", SnapLength::lognormal(dbar, 0.3), lognormal_quantile(1.0, 0.3),
       lognormal_moments(0.3)},
      {"table, cv 0.37", SnapLength::table(metres), table_quantile(table), table_moment},
      {"lognormal, cv 1", SnapLength::lognormal(dbar, 1.0), lognormal_quantile(1.0, 1.0),
       lognormal_moments(1.0), true},
      {"exponential", SnapLength::exponential(dbar), exponential_quantile(1.0), {1.0, 1.0, 2.0, 6.0, 24.0}}};
}

/// Stationary law of sliding: delta is length-biased, z uniform on (0, delta); by prefix sums of quantiles.
class Stationary {
 public:
  explicit Stationary(const Quantile& quantile) {
    lengths_.reserve(points);
    for (std::size_t i = 0; i < points; ++i) {
      lengths_.push_back(quantile((static_cast<double>(i) + 0.5) / points));
      sums_.push_back(lengths_.back() + (i ? sums_[i - 1] : 0.0));
    }
  }
  double delta_cdf(double y) const {
    const std::size_t below = count_below(y);
    return below ? sums_[below - 1] / sums_.back() : 0.0;
  }
  double deflection_cdf(double z) const {
    const std::size_t below = count_below(z);
    return ((below ? sums_[below - 1] : 0.0) + static_cast<double>(points - below) * z) / sums_.back();
  }
  /// Draws a bristle's deflection and length from the stationary law.
  BruteBristle draw(std::mt19937_64& random) const {
    std::uniform_real_distribution<double> flat(0.0, 1.0);
    const double at = flat(random) * sums_.back();
    const auto k = static_cast<std::size_t>(std::lower_bound(sums_.begin(), sums_.end(), at) - sums_.begin());
    BruteBristle b;
    b.delta = lengths_[std::min(k, points - 1)];
    b.zx = flat(random) * b.delta;
    return b;
  }

 private:
  static constexpr std::size_t points = 200000;
  std::size_t count_below(double y) const {
    return static_cast<std::size_t>(std::upper_bound(lengths_.begin(), lengths_.end(), y) - lengths_.begin());
  }
  std::vector<double> lengths_, sums_;
};

/// Deflections along the motion, snap lengths, and paths to the next snap, in mean snap lengths. Lengths are
/// rounded to 1e-4, because all bristles that never snapped share one deflection, which two implementations
/// may round differently.
struct Columns {
  std::vector<double> along, delta, left;
};
Columns columns(const std::vector<double>& zx, const std::vector<double>& zy,
                const std::vector<double>& delta, double ex, double ey, double unit) {
  Columns c;
  const auto rounded = [](double x) { return 1e-4 * std::round(1e4 * x); };
  for (std::size_t i = 0; i < zx.size(); ++i) {
    const double along = (zx[i] * ex + zy[i] * ey) / unit;
    const double aside = (zx[i] * ey - zy[i] * ex) / unit;
    const double d = delta[i] / unit;
    c.along.push_back(rounded(along));
    c.delta.push_back(rounded(d));
    c.left.push_back(rounded(std::sqrt(std::max(d * d - aside * aside, 0.0)) - along));
  }
  return c;
}
Columns columns(BruteForcePatch& brute, double ex, double ey) {
  std::vector<double> zx, zy, delta;
  for (const BruteBristle& b : brute.bristles()) {
    zx.push_back(b.zx);
    zy.push_back(b.zy);
    delta.push_back(b.delta);
  }
  return columns(zx, zy, delta, ex, ey, 1.0);
}
Columns columns(const OnePatch& patch, std::uint32_t n, double ex, double ey) {
  const Bristles b = read(patch, n);
  return columns(b.zx, b.zy, b.delta, ex, ey, dbar);
}

}  // namespace

TEST_CASE("After a long step with redraw, deflections and snap lengths have the law of brute force",
          "[physics][jumps]") {
  const std::uint32_t n = test_size(50000);
  for (const JumpLaw& law : jump_laws()) {
    for (double length : {3.0, 6.0, 10.0, 30.0, 300.0}) {
      const auto brute_n = static_cast<std::uint32_t>(std::min<double>(n, test_size(1500000) / length));
      BruteForcePatch brute(brute_n, law.quantile, true, 42);
      std::vector<std::pair<Precision, OnePatch>> patches;
      for (Precision precision : precisions()) {
        patches.emplace_back(
            precision, OnePatch(plain_material(law.law, SnapRule::redraw), plain_options(n, 2, precision)));
        patches.back().second.step(0.0, 0.0, n);
      }
      // The first far step jumps from rest. The second starts from that state and turns by 1.2 rad.
      int part = 0;
      for (double angle : {0.3, 1.5}) {
        const double ex = std::cos(angle);
        const double ey = std::sin(angle);
        const BruteStep expected = brute.step(length * ex, length * ey);
        const Columns b = columns(brute, ex, ey);
        const Sample z = describe(b.along);
        for (auto& [precision, patch] : patches) {
          INFO(law.name << ", " << name_of(precision) << ", a step of " << length << " mean lengths, part "
                        << part);
          const Response r = patch.step(length * dbar * ex, length * dbar * ey, n);
          const Columns a = columns(patch, n, ex, ey);
          const double critical = critical_ks(n, brute_n) + allowed_bias;
          expect_near(ks_distance(a.along, b.along), 0.0, critical, "distance of the laws of the deflection");
          expect_near(ks_distance(a.delta, b.delta), 0.0, critical,
                      "distance of the laws of the snap length");
          expect_near(ks_distance(a.left, b.left), 0.0, critical,
                      "distance of the laws of the path to the next snap");
          const double error = std::sqrt(z.variance / n + z.variance / brute_n);
          const double force = -(r.elastic[0] * ex + r.elastic[1] * ey) / (n * dbar);
          expect_near(force, expected.end_x * ex + expected.end_y * ey, sigmas * error + allowed_bias,
                      "end force");
        }
        ++part;
      }
    }
  }
}

TEST_CASE("After a very long step with redraw, bristles have the stationary law", "[physics][jumps]") {
  const std::uint32_t n = test_size(100000);
  for (const JumpLaw& law : jump_laws()) {
    const Stationary stationary(law.quantile);
    for (double length : {1e3, 3e3, 1e5, 1e9, 1e14}) {
      for (Precision precision : precisions()) {
        INFO(law.name << ", " << name_of(precision) << ", a step of " << length << " mean lengths");
        // At cv 0.05 the memory of the start decays as exp(-2 pi^2 cv^2 x), x the path in mean lengths: 4e-22
        // of it is left at 1000.
        OnePatch patch(plain_material(law.law, SnapRule::redraw), plain_options(n, 2, precision));
        patch.step(0.0, 0.0, n);
        patch.step(0.6 * length * dbar, -0.8 * length * dbar, n);
        const Columns a = columns(patch, n, 0.6, -0.8);
        const double critical = critical_ks(n) + allowed_bias;
        expect_near(ks_distance(a.along, [&](double z) { return stationary.deflection_cdf(z); }), 0.0,
                    critical, "distance of the deflection's law from the stationary one");
        expect_near(ks_distance(a.delta, [&](double d) { return stationary.delta_cdf(d); }), 0.0, critical,
                    "distance of the snap length's law from the length-biased one");
        // Among bristles of a given snap length, deflections are uniform from 0 to that length.
        std::vector<double> share;
        double covariance = 0.0;
        const Sample d = describe(a.delta);
        const Bristles exact = read(patch, n);
        for (std::size_t i = 0; i < a.along.size(); ++i) {
          share.push_back(std::hypot(exact.zx[i], exact.zy[i]) / exact.delta[i]);
          covariance += (share.back() - 0.5) * (a.delta[i] - d.mean) / n;
        }
        expect_near(ks_distance(share, [](double u) { return std::min(std::max(u, 0.0), 1.0); }), 0.0,
                    critical, "distance of z / delta from the uniform law");
        expect_near(covariance, 0.0, (sigmas / std::sqrt(n) + allowed_bias) * std::sqrt(d.variance / 12.0),
                    "covariance of z / delta and delta");
      }
    }
  }
}

TEST_CASE("Dissipation per distance of redraw has the mean and the variance of a renewal process",
          "[physics][jumps][energy]") {
  constexpr int bristles = 512;  // 512 bristles: two blocks
  const int patches = 50;
  const int steps = static_cast<int>(test_size(40));
  for (const JumpLaw& law : jump_laws()) {
    const Stationary stationary(law.quantile);
    const double c = 0.5 * law.moment[2];  // m2 / (2 m1): kinetic friction as mean deflection

    // Renewal-reward theory: between two snaps, a bristle of length delta loses delta^2/2, which differs from
    // its expected share c delta. `growth` is the variance of the difference, and the variance of the energy
    // lost grows by it per mean length of path.
    const double growth = 0.25 * law.moment[4] - c * law.moment[3] + c * c * law.moment[2];
    for (double length : {3.0, 10.0, 30.0, 300.0, 3000.0}) {
      // Variance, per bristle, of the energy that one step in steady sliding dissipates.
      double variance = growth * length;
      double variance_error = 0.01;  // relative; either end of the step adds that of one length in 3000
      double kurtosis = 0.0;
      double end_variance = law.moment[3] / 3.0 - c * c;  // variance of one bristle's deflection
      if (law.heavy) variance_error = 0.05;
      if (length <= 300.0 && !law.heavy) {
        const auto n = static_cast<std::size_t>(std::min(1e5, test_size(2000000) / length));
        BruteForcePatch brute(n, law.quantile, true, 7);
        std::mt19937_64 random(8);
        for (BruteBristle& b : brute.bristles()) b = stationary.draw(random);
        brute.step(length, 0.0);
        std::vector<double> lost;
        for (const BruteBristle& b : brute.bristles()) lost.push_back(b.dissipated);
        const Sample s = describe(lost);
        INFO(law.name << ", " << length);
        expect_near(s.mean, c * length, sigmas * s.error(), "brute force against renewal-reward theory");
        variance = s.variance;
        for (double x : lost)
          kurtosis += std::pow(x - s.mean, 4) / (s.variance * s.variance * static_cast<double>(n));
        kurtosis = std::max(kurtosis - 3.0, 0.0);
        variance_error = error_of_variance(static_cast<double>(n), kurtosis);
      }

      for (Precision precision : precisions()) {
        INFO(law.name << ", " << name_of(precision) << ", steps of " << length << " mean lengths");
        PatchBatch batch;
        const std::vector<PatchId> ids =
            add_patches(batch, patches, plain_material(law.law, SnapRule::redraw),
                        plain_options(bristles, 1, precision).with_seed(1000));
        std::vector<Response> responses(ids.size());
        batch.step(tick, same_motion(ids, 0.0, 0.0, bristles), responses);
        for (int k = 0; k < 3; ++k)
          batch.step(tick, same_motion(ids, 400.0 * dbar, 0.0, bristles), responses);
        std::vector<double> lost, mean_force, end_force;
        double snaps = 0.0;
        for (int k = 0; k < steps; ++k) {
          batch.step(tick, same_motion(ids, length * dbar, 0.0, bristles), responses);
          for (const Response& r : responses) {
            lost.push_back(r.dissipated / (bristles * dbar * dbar));
            mean_force.push_back(-r.mean[0] / (bristles * dbar));
            end_force.push_back(-r.elastic[0] / (bristles * dbar));
            snaps += static_cast<double>(r.snaps);
          }
        }
        const Sample s = describe(lost);
        const double samples = static_cast<double>(s.size);
        // Tolerance of the mean loss: sampling, and a bias of 1e-3 of the energy of one snap.
        expect_near(s.mean, c * length,
                    sigmas * std::sqrt(variance / (bristles * samples)) + allowed_bias * law.moment[2],
                    "dissipated per bristle and step");
        // Variance of the loss over steps and patches. With a heavy law the sums over patches have an excess
        // kurtosis of about 1.
        if (!law.heavy || length >= 300.0) {
          const double patch_kurtosis = law.heavy ? 1.2 * 300.0 / length : kurtosis / bristles;
          const double error = std::hypot(error_of_variance(samples, patch_kurtosis), variance_error);
          expect_near(s.variance * bristles, variance, sigmas * error * variance,
                      "variance of the dissipation, per bristle");
        }
        // Compares force at the end of the step, and mean force, with kinetic friction.
        const double end_error = sigmas * std::sqrt(end_variance / (bristles * samples));
        expect_near(describe(end_force).mean, c, end_error + allowed_bias, "end force");
        const double mean_error =
            sigmas * std::sqrt(variance / (bristles * samples)) / length + end_error / length;
        expect_near(describe(mean_force).mean, c, mean_error + allowed_bias * law.moment[2] / length + 1e-6,
                    "step mean of the force");
        // Expects one snap per bristle and mean length of path.
        const double cv2 = law.moment[2] - 1.0;
        expect_near(snaps / (bristles * samples), length,
                    sigmas * std::sqrt((cv2 * length + 1.0) / (bristles * samples)) + 0.02,
                    "snaps per bristle and step");
      }
    }
  }
}

TEST_CASE("With a single snap length redraw is keep, and stays in phase over any distance",
          "[physics][jumps]") {
  for (Precision precision : precisions()) {
    INFO(name_of(precision));
    OnePatch keep(plain_material(SnapLength::single(dbar), SnapRule::keep), plain_options(300, 2, precision));
    OnePatch redraw(plain_material(SnapLength::single(dbar), SnapRule::redraw),
                    plain_options(300, 2, precision));
    double travelled = 0.0;
    double snaps = 0.0;
    keep.step(0.0, 0.0, 300.0);
    redraw.step(0.0, 0.0, 300.0);
    for (double length : {0.3, 3.1, 10.7, 30.4, 300.9, 3000.2, 100000.6, 0.7, 12345.6, 0.17}) {
      travelled += length;
      const Response a = keep.step(length * dbar, 0.0, 300.0);
      Response b = redraw.step(length * dbar, 0.0, 300.0);
      b.id = a.id;
      CHECK(first_difference(a, b) == "");
      snaps += static_cast<double>(a.snaps) / 300.0;
      const double expected = travelled - std::floor(travelled);
      // Tolerance in float: the deflection is rounded in each step, by 2^-24 of its length. The rounding of
      // the snap length is constant, and its effect grows with the path.
      const double tolerance = precision == Precision::double_ ? 1e-9 : 1e-6 + 0x1p-24 * travelled;
      expect_near(-a.elastic[0] / (300.0 * dbar), expected, tolerance,
                  "deflection, travelled modulo the snap length");
      expect_near(snaps, std::floor(travelled), 1e-9, "snaps");
    }
  }
}

TEST_CASE("A jump of a single or a fractional bristle dissipates what the law says, and never gains energy",
          "[physics][jumps][energy]") {
  const int steps = static_cast<int>(test_size(20000));
  for (const JumpLaw& law : jump_laws()) {
    const double c = 0.5 * law.moment[2];
    for (double length : {3.7, 5.05, 12.0, 100.0}) {
      for (Precision precision : precisions()) {
        double variance_of_one = 0.0;
        for (double active : {1.0, 0.3, 0.02}) {
          INFO(law.name << ", " << name_of(precision) << ", " << active << " of a bristle, steps of "
                        << length << " mean lengths");
          OnePatch patch(plain_material(law.law, SnapRule::redraw), plain_options(8, 2, precision));
          patch.step(0.0, 0.0, active);
          for (int k = 0; k < 3; ++k) patch.step(400.0 * dbar, 0.0, active);
          std::vector<double> lost;
          int wrong = 0;
          for (int k = 0; k < steps; ++k) {
            const Response r = patch.step(length * dbar, 0.0, active);
            lost.push_back(r.dissipated / (active * dbar * dbar));
            wrong += !(r.dissipated >= 0.0) || (r.snaps > 0) != (r.dissipated > 0.0);
          }
          expect_near(wrong, 0, 0, "steps that gain energy, or lose some without a snap");
          const Sample s = describe(lost);
          expect_near(s.mean, c * length, sigmas * 1.2 * s.error() + allowed_bias * law.moment[2],
                      "dissipated per step");
          // Under a load of a fraction of a bristle one bristle bends, so the energy lost, over that
          // fraction, varies as much as for a whole one.
          if (active == 1.0) variance_of_one = s.variance;
          if (!law.heavy)
            expect_near(s.variance, variance_of_one, 0.25 * variance_of_one, "variance of the dissipation");
        }
      }
    }
  }
}

}  // namespace bristle_test::test_redraw_jumps
