// Laws of snap lengths with groups, corners and tails, whose waves outlive those of a smooth law: a long
// slide of the infinite brush still ends at its kinetic force.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <ctime>
#include <vector>

#include "core/materials/slow_wave.hpp"
#include "expect.hpp"
#include "infinite_brush.hpp"
#include "scenes.hpp"

namespace bristle_test::test_odd_laws {

namespace {

struct Group {
  /// Group: share of the bristles, whose lengths are uniform between low and high (mean snap lengths).
  double share, low, high;
};

/// Returns a law, a mixture of groups of uniform lengths, as a table of 257 quantiles.
SnapLength law_of(const std::vector<Group>& groups) {
  std::vector<double> lengths;
  for (int k = 0; k <= 256; ++k) {
    double rest = k / 256.0;
    std::size_t g = 0;
    for (; g + 1 < groups.size() && rest > groups[g].share; ++g) rest -= groups[g].share;
    const double u = std::min(rest / groups[g].share, 1.0);
    lengths.push_back(dbar * (groups[g].low + u * (groups[g].high - groups[g].low)));
  }
  return SnapLength::table({lengths.data(), lengths.size()});
}

void check_kinetic(const SnapLength& law, double kappa, double path, double tolerance) {
  const double expected = steady_deflection(law, kappa);
  for (const double step : {0.25, 3.0, 40.0}) {
    Material material = plain_material(law, SnapRule::redraw);
    material.shared_renewal = kappa;
    Brush brush(material);
    for (double gone = 0.0; gone < path; gone += step) brush.step(step);
    INFO("kappa " << kappa << ", steps of " << step << ": " << brush.x() / expected);
    CHECK(std::abs(brush.x() / expected - 1.0) < tolerance);
    CHECK(brush.imbalance < 1e-9);
  }
}

}  // namespace

TEST_CASE("A slide of an infinite brush ends at its kinetic force, whatever groups its lengths have",
          "[cohorts]") {
  const struct {
    const char* name;
    SnapLength law;
  } laws[] = {
      {"half 0.4 to 0.5, half 1.55 to 1.6", law_of({{0.5, 0.4, 0.5}, {0.5, 1.55, 1.6}})},
      {"0.3 to 0.34 with 1.6 to 1.64", law_of({{0.5, 0.3, 0.34}, {0.5, 1.6, 1.64}})},
      {"80 % of 1 with 20 % of 3", law_of({{0.8, 0.92, 1.08}, {0.2, 2.76, 3.24}})},
      {"even from 0", SnapLength::uniform(0.0, 2.0 * dbar)},
  };
  for (const auto& [name, law] : laws) {
    INFO(name);
    for (const double kappa : {0.0, 1.0}) check_kinetic(law, kappa, 600.0, 2e-3);
  }
}

TEST_CASE("A first loading of any length is known at once where it has settled", "[material]") {
  const SnapLength law = law_of({{0.5, 0.1, 0.9}, {0.5, 1.2, 1.6}});
  for (const SnapRule rule : {SnapRule::redraw, SnapRule::keep}) {
    Material material = plain_material(law, rule);
    material.shared_renewal = 1.0;
    const std::clock_t begun = std::clock();  // CPU time, because the machine may be busy
    const double expected = rule == SnapRule::redraw ? steady_deflection(law, 1.0) * dbar / law.mean()
                                                     : material.kinetic_coefficient() / law.mean();
    for (const double x : {1e4, 1e5, 1e6})
      CHECK(bristle::virgin_deflection(material, x) == Approx(expected).epsilon(1e-5));
    CHECK(std::clock() - begun < 3 * CLOCKS_PER_SEC);
  }
}

TEST_CASE("The slowest wave of uniform lengths is that of its closed form", "[material]") {
  // Slowest wave for lengths between 0 and b: the transform of the density, (1 - exp(-s b)) / (s b), is 1 at
  // s b = -y, with exp(y) = 1 + y.
  const std::complex<double> y{2.088843015613044, 7.461489285654254};
  REQUIRE(std::abs(std::exp(y) - 1.0 - y) < 1e-12);
  const bristle::detail::SlowWave wave =
      bristle::detail::find_slow_wave(SnapLength::uniform(0.0, 2.0 * dbar));
  CHECK(wave.decay == Approx(0.5 * y.real()).epsilon(1e-4));
  CHECK(wave.frequency == Approx(0.5 * y.imag()).epsilon(1e-4));
}

}  // namespace bristle_test::test_odd_laws
