// `bristle fit` of a full disc that turns about its middle, whose torque is not that of a force at one
// radius.
#include <catch2/catch.hpp>

#include <cmath>
#include <string>
#include <vector>

#include "tests/fit_helpers.hpp"
#include "tests/synthetic_friction.hpp"
#include "tools/libraries/fitting/solve.hpp"

namespace bristle_test::test_fit_disc {

using Catch::Matchers::Contains;

namespace {

constexpr double radius = 0.02;

cli::FitOptions of_disc() {
  cli::FitOptions options;
  options.reading.radius = radius;
  options.reading.disc = true;
  return options;
}

/// Returns the settings of a turning disc of 60 annuli with 30 bristles each: 10 s of samples at 50 Hz.
SyntheticFriction turning() {
  SyntheticFriction s;
  s.motion = loops_and_strokes;
  s.noise = 0.01;
  s.every = 4;
  s.annuli = 60;
  return s;
}

}  // namespace

TEST_CASE("A fit finds the material of a disc from its torque", "[fit]") {
  SyntheticFriction s = turning();
  s.viscous = 60.0;
  s.drift = [](double t) { return 0.03 + 0.004 * (t - 5.0); };
  const std::string csv = record(s, 11).disc_csv(radius);
  const Fitted fitted = fit(csv, of_disc());
  check_recovered(fitted[cli::fit_kinetic], s.kinetic, 0.02 * s.kinetic);
  check_recovered(fitted[cli::fit_length], s.length, 0.08 * s.length);
  check_recovered(fitted[cli::fit_spread], s.spread, 0.2 * s.spread);
  check_recovered(fitted[cli::fit_viscous], s.viscous, 0.35 * s.viscous);
  check_recovered(fitted[cli::fit_offset], 0.03, 0.01);
  CHECK_FALSE(fitted[cli::fit_residual].fitted);
  CHECK_FALSE(fitted.result.peak.fitted);
  CHECK_THAT(fitted.result.peak.why, Contains("disc"));
  // A fit that takes the disc for a ring at the rim finds only 2/3 of the friction coefficient.
  cli::FitOptions ring = of_disc();
  ring.reading.disc = false;
  CHECK(fit(csv, ring)[cli::fit_kinetic].value == Approx(s.kinetic * 2.0 / 3.0).epsilon(0.02));
}

TEST_CASE("Eight rings are a disc", "[fit]") {
  std::vector<cli::PathPoint> path;
  for (int i = 0; i <= 300; ++i)
    path.push_back({60e-6 * std::sin(0.031 * i) * i / 300.0, 2.0, true, 0.01 * i});
  cli::PathForce disc(path, 1, true), point(path);
  const struct {
    // spread of the law; allowed error, larger for the narrow law
    double spread, error;
  } cases[] = {{0.15, 4e-3}, {0.4, 1e-3}};
  for (const auto& [spread, error] : cases) {
    CAPTURE(spread);
    const cli::BrushShape shape{bristle::SnapLaw::lognormal, bristle::SnapRule::redraw, spread};
    const std::vector<double> found = disc.find(shape, 15e-6, {}, cli::Detail::finish);
    const int rings = 150;  // expected torque: sum over 150 rings of equal width, by the midpoint rule
    std::vector<double> sum(path.size(), 0.0);
    for (int k = 0; k < rings; ++k) {
      const double lever = (k + 0.5) / rings;
      const std::vector<double> force = point.find(shape, 15e-6 / lever, {}, cli::Detail::finish);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += 2.0 * lever * lever / rings * force[i];
    }
    double squares = 0.0, off = 0.0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
      squares += sum[i] * sum[i];
      off += (found[i] - sum[i]) * (found[i] - sum[i]);
    }
    CHECK(std::sqrt(off / squares) < error);
  }
}

TEST_CASE("A radius is that of a ring or of a disc", "[fit]") {
  const cli::FitColumns read = cli::parse_fit_columns(
      "t,angle [deg],load,torque [mN m]\n0,0,1,10\n1,90,1,20\n", "data.csv", of_disc().reading);
  CHECK(read.disc);
  CHECK(read.x[1] == Approx(0.5 * M_PI * radius));
  CHECK_THAT(read.understood.back(), Contains("full disc under an even pressure") && Contains("20 mm"));
  CHECK_THROWS_WITH(cli::parse_fit_columns("t,x,load,force\n0,0,1,1\n", "data.csv", of_disc().reading),
                    Contains("--disc is for columns angle and torque"));
  CHECK_THROWS_WITH(cli::parse_fit_columns("t,angle,load,torque\n0,0,1,1\n", "data.csv"),
                    Contains("--radius") && Contains("--disc"));
}

}  // namespace bristle_test::test_fit_disc
