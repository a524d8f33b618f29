// `bristle fit`: finds stage and sensor between the friction and the file, separates them from friction and
// from each other, or says that it cannot. The data come from brute_force.hpp, stage and sensor from closed
// forms.
#include <catch2/catch.hpp>

#include <cmath>

#include "tests/fit_helpers.hpp"
#include "tests/synthetic_friction.hpp"

namespace bristle_test::test_fit_stage {

using Catch::Matchers::Contains;

namespace {

/// Returns settings of loops and strokes of growing speed, recorded at 200 Hz, simulated at 1 kHz.
SyntheticFriction fine() {
  SyntheticFriction s;
  s.motion = loops_and_strokes;
  s.rate = 1000.0;
  s.every = 5;
  s.noise = 0.01;
  return s;
}

void check_brush(const Fitted& fitted, const SyntheticFriction& s) {
  check_recovered(fitted[cli::fit_kinetic], s.kinetic, 0.02 * s.kinetic);
  check_recovered(fitted[cli::fit_length], s.length, 0.15 * s.length);
  check_recovered(fitted[cli::fit_spread], s.spread, 0.3 * s.spread);
}

}  // namespace

TEST_CASE("A fit finds the delay of the force sensor and leaves the brush as it is", "[fit]") {
  SyntheticFriction s = fine();
  s.delay = 0.008;
  const Fitted fitted = fit(record(s, 11).csv());
  check_recovered(fitted[cli::fit_delay], s.delay, 0.1 * s.delay);
  check_brush(fitted, s);
  CHECK_FALSE(fitted[cli::fit_compliance].fitted);
  CHECK_FALSE(fitted[cli::fit_damping].fitted);
}

TEST_CASE("A fit finds the compliance of the stage where loads differ", "[fit]") {
  SyntheticFriction s = fine();
  s.compliance = 4e-6;  // stage that yields by 2.8 um under 0.7 N; presliding length 15 um
  s.load = [](double t) { return 2.0 + std::sin(1.3 * t); };
  s.most_load = 3.0;
  s.bristles = 2700;
  const Fitted fitted = fit(record(s, 11).csv());
  check_recovered(fitted[cli::fit_compliance], s.compliance, 0.5 * s.compliance);
  check_brush(fitted, s);
  CHECK_FALSE(fitted[cli::fit_delay].fitted);
}

TEST_CASE("Delay and offset and drift and an encoder are told apart", "[fit]") {
  SyntheticFriction s = fine();
  s.delay = 0.008;
  s.encoder = 0.5e-6;
  s.drift = [](double t) { return 0.05 + 0.004 * (t - 5.0); };
  const Fitted fitted = fit(record(s, 12).csv());
  check_recovered(fitted[cli::fit_delay], s.delay, 0.15 * s.delay);
  check_recovered(fitted[cli::fit_offset], 0.05, 0.01);
  check_recovered(fitted[cli::fit_drift], 0.004, 0.004);
  CHECK(fitted.data.quantum == Approx(s.encoder));
  check_brush(fitted, s);
}

TEST_CASE("Delay and compliance are told apart where speeds and loads differ", "[fit]") {
  SyntheticFriction s = fine();
  s.delay = 0.008;
  s.compliance = 4e-6;
  s.load = [](double t) { return 2.0 + std::sin(1.3 * t); };
  s.most_load = 3.0;
  s.bristles = 2700;
  const Fitted fitted = fit(record(s, 11).csv());
  check_recovered(fitted[cli::fit_delay], s.delay, 0.2 * s.delay);
  check_recovered(fitted[cli::fit_compliance], s.compliance, 0.5 * s.compliance);
  check_brush(fitted, s);
}

TEST_CASE("Neither delay nor compliance is found where there is none, and the reason is given", "[fit]") {
  SyntheticFriction s = fine();
  const Fitted fitted = fit(record(s, 11).csv());
  for (const cli::FitParameter p : {cli::fit_delay, cli::fit_compliance}) {
    CHECK_FALSE(fitted[p].fitted);
    CHECK(fitted[p].value == 0.0);
  }
  CHECK_THAT(fitted[cli::fit_compliance].why,
             Contains("one number in sticking") && Contains("loads that differ"));
  CHECK_THAT(fitted[cli::fit_delay].why, Contains("not seen"));
  // The fit leaves out terms that its linearised model finds no sign of, so it needs hardly more evaluations
  // than a fit in which all these terms are held.
  cli::FitOptions held;
  held.delay = held.compliance = held.residual = held.renewal = 0.0;
  const Fitted known = fit(record(s, 11).csv(), held);
  CHECK(fitted.result.evaluations < known.result.evaluations + 40);
  for (const cli::FitParameter p : {cli::fit_kinetic, cli::fit_length, cli::fit_spread})
    CHECK(fitted[p].value == known[p].value);
}

TEST_CASE("A stiff spring in series under one load is left to the brush, and the report says so", "[fit]") {
  // Record of loops that never slide, which show one slope of force over displacement, the combined stiffness
  // of stage and bristles.
  SyntheticFriction s = fine();
  s.compliance = 4e-6;
  s.motion = [](double t) { return 2e-6 * std::sin(2.0 * M_PI * t); };
  const Fitted fitted = fit(record(s, 1).csv());
  CHECK_FALSE(fitted[cli::fit_compliance].fitted);
  CHECK_THAT(fitted[cli::fit_compliance].why, Contains("one number in sticking"));
  // Finds no length without sliding: bristles of twenty times the length and equal stiffness fit as well.
  CHECK_FALSE(fitted[cli::fit_kinetic].fitted);
  CHECK_THAT(fitted[cli::fit_kinetic].why, Contains("no sliding"));
  const double bristles = s.kinetic / (0.5 * (1.0 + s.spread * s.spread) * s.length) * 2.0;  // N/m
  const double both = 1.0 / (1.0 / bristles + s.compliance) / 2.0;
  check_recovered(fitted.result.stiffness, both, 0.04 * both);
  // Checks that with the stage's compliance known and held the fit finds the bristles' own stiffness.
  cli::FitOptions held;
  held.compliance = s.compliance;
  const Fitted own = fit(record(s, 1).csv(), held);
  CHECK(own[cli::fit_compliance].why == "held");
  check_recovered(own.result.stiffness, 0.5 * bristles, 0.04 * bristles);
}

}  // namespace bristle_test::test_fit_stage
