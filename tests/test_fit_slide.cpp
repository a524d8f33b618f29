// `bristle fit` of bristles that slide at their limit, compared with a row of springs with blocks. Choice of
// the rule, a stage that is stiffer in one direction, drift, and intervals over blocks of time.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/fit_helpers.hpp"
#include "tests/sliding_springs.hpp"
#include "tests/synthetic_friction.hpp"
#include "tools/libraries/fitting/fit.hpp"
#include "tools/libraries/fitting/judge.hpp"
#include "tools/libraries/fitting/path_force.hpp"

namespace bristle_test::test_fit_slide {

using bristle::SnapLaw;
using bristle::SnapRule;
using Catch::Matchers::Contains;

namespace {

cli::FitOptions of_rule(SnapRule rule) {
  cli::FitOptions options;
  options.rule = rule;
  options.quiet = true;
  return options;
}

}  // namespace

TEST_CASE("The force along a path follows springs whose blocks slide", "[fit]") {
  for (const double spread : {0.3, 1.0}) {
    Springs springs(sliding_limits(20000, 15e-6, spread));
    std::vector<cli::PathPoint> path;
    for (int i = 0; i < 1000; ++i) path.push_back({loops_and_strokes(0.01 * i), 2.0, true});
    const std::vector<double> force = cli::PathForce(path).find({SnapLaw::lognormal, SnapRule::slide, spread},
                                                                15e-6, {}, cli::Detail::finish);
    double worst = 0.0, x = 0.0;
    for (std::size_t i = 0; i < force.size(); ++i) {
      springs.move(path[i].x - x);
      x = path[i].x;
      worst = std::max(worst, std::abs(force[i] - 2.0 * springs.after(0.0)));
    }
    // Tolerance: 64 strata have an error of 2e-4 at a spread of 1; lengths beyond probability 1 / 40000 are
    // cut off, an error of 4e-4
    CHECK(worst < 1e-3 * 2.0);
  }
}

TEST_CASE("A fit recovers bristles that slide at their limit", "[fit]") {
  const Fitted fitted = fit(SlidingSprings{}.csv(1), of_rule(SnapRule::slide));
  check_recovered(fitted[cli::fit_kinetic], 0.35, 0.004);
  check_recovered(fitted[cli::fit_length], 15e-6, 0.8e-6);
  check_recovered(fitted[cli::fit_spread], 0.6, 0.06);
  check_recovered(fitted[cli::fit_offset], 0.03, 0.005);
  CHECK(fitted.result.residual_rms < 1.05 * 0.01);
  CHECK(fitted.result.material.snap_rule == SnapRule::slide);
  for (const auto p : {cli::fit_residual, cli::fit_renewal, cli::fit_drift}) CHECK_FALSE(fitted[p].fitted);
  const std::string scene = cli::fit_toml(fitted.data, of_rule(SnapRule::slide), fitted.result);
  CHECK_THAT(scene, Contains("rule = \"slide\"") && !Contains("drop"));
}

TEST_CASE("Without a rule a fit takes the one that predicts better", "[fit]") {
  const Fitted slid = fit(SlidingSprings{}.csv(2), any_brush());
  CHECK(slid.result.rule == SnapRule::slide);
  check_recovered(slid[cli::fit_spread], 0.6, 0.06);
  SyntheticFriction redrawn;
  redrawn.motion = loops_and_strokes;
  redrawn.rate = 100.0;
  redrawn.noise = 0.01;
  for (const unsigned seed : {3u, 4u}) {
    const Fitted brush = fit(record(redrawn, seed).csv(), any_brush());
    CHECK(brush.result.rule == SnapRule::redraw);
    check_recovered(brush[cli::fit_length], 15e-6, 1e-6);
  }
}

TEST_CASE("A fit finds a stage that is stiffer one way than the other", "[fit]") {
  SlidingSprings soft;
  soft.softening = 4e-6;
  const Fitted fitted = fit(soft.csv(5), of_rule(SnapRule::slide));
  check_recovered(fitted[cli::fit_softening], 4e-6, 0.6e-6);
  check_recovered(fitted[cli::fit_kinetic], 0.35, 0.004);
  check_recovered(fitted[cli::fit_length], 15e-6, 1.2e-6);
  CHECK(fitted.result.residual_rms < 1.1 * 0.01);
}

TEST_CASE("A fit finds the delay of the force sensor and leaves the brush as it is", "[fit]") {
  SyntheticFriction s;
  s.motion = loops_and_strokes;
  s.rate = 1000.0;
  s.every = 5;
  s.noise = 0.01;
  for (const double delay : {0.0, 0.008}) {
    s.delay = delay;
    const Fitted fitted = fit(record(s, 11).csv(), of_rule(SnapRule::redraw));
    if (delay > 0.0) check_recovered(fitted[cli::fit_delay], delay, 0.1 * delay);
    if (delay == 0.0) CHECK(fitted[cli::fit_delay].value == 0.0);
    check_recovered(fitted[cli::fit_kinetic], s.kinetic, 0.02 * s.kinetic);
    check_recovered(fitted[cli::fit_length], s.length, 0.15 * s.length);
  }
}

TEST_CASE("Friction that runs in is no drift of the sensor", "[fit]") {
  SlidingSprings runs_in;
  runs_in.seconds = 20.0;
  runs_in.motion = [](double t) { return 60e-6 * std::sin(2.0 * M_PI * t); };
  runs_in.growth = [](double t) { return t < 1.0 ? 0.8 + 0.2 * t : 1.0; };
  CHECK_FALSE(fit(runs_in.csv(7), of_rule(SnapRule::slide))[cli::fit_drift].fitted);
}

TEST_CASE("A slow swing of the sensor is no drift, as its beginning does not foretell its end", "[fit]") {
  SlidingSprings swings;
  swings.seconds = 20.0;
  swings.motion = [](double t) { return 60e-6 * std::sin(2.0 * M_PI * t); };
  swings.drift = [](double t) { return 0.1 * std::sin(2.0 * M_PI * t / 30.0); };
  CHECK_FALSE(fit(swings.csv(7), of_rule(SnapRule::slide))[cli::fit_drift].fitted);
}

TEST_CASE("Intervals hold what separate parts of a record say", "[fit]") {
  // Record of friction that wanders by 5 % to either side in a period of 20 s. A third of the record alone
  // would have an interval of 0.5 %.
  SlidingSprings wanders;
  wanders.seconds = 30.0;
  wanders.motion = [](double t) { return 60e-6 * std::sin(2.0 * M_PI * t); };
  wanders.growth = [](double t) { return 1.0 + 0.05 * std::sin(2.0 * M_PI * t / 20.0); };
  const Fitted fitted = fit(wanders.csv(8), of_rule(SnapRule::slide));
  const cli::FitEstimate& kinetic = fitted[cli::fit_kinetic];
  CHECK(kinetic.high - kinetic.low > 0.02 * kinetic.value);
}

TEST_CASE("A model that cannot be fitted is named, and does not take the verdict from the others", "[fit]") {
  cli::Judgements all;
  all.models = {{"Coulomb", 4, 0.2, {0.2, 0.2, 0.2}, "", ""},
                {"Maxwell-slip", 22, NAN, {NAN, NAN, NAN}, "", "none of 9 starts led to a finite force"}};
  const std::string table = cli::judgement_table(all);
  CHECK_THAT(table, Contains("Closest to the rest of the record: Coulomb;") &&
                        Contains("too few samples follow a reversal") &&
                        Contains("Not fitted: Maxwell-slip (none of 9 starts"));
  // Two models whose errors print alike share the verdict; beyond the fitted range there is none.
  all.models.push_back({"LuGre", 7, 0.2, {0.2005, 0.2, 0.2}, "", ""});
  all.reversal_samples = 100;
  CHECK_THAT(cli::judgement_table(all), Contains("Coulomb (LuGre as close)"));
  // A model whose error exceeds the least by less than the scatter over blocks is as close; one that is a
  // little worse in every block is not.
  all.models.resize(1);
  all.models[0].squares = {{0, 1.0}, {1, 1.0}, {2, 1.0}, {3, 1.0}};
  cli::Judgement scattered{
      "scattered", 4, 0.2, {0.25, 0.3, 0.25}, "", "", {{0, 5.0}, {1, 0.5}, {2, 1.0}, {3, 0.5}}, {}},
      steady{"steady", 4, 0.2, {0.22, 0.3, 0.22}, "", "", {{0, 1.2}, {1, 1.3}, {2, 1.2}, {3, 1.3}}, {}};
  all.models.push_back(scattered);
  all.models.push_back(steady);
  CHECK_THAT(cli::judgement_table(all),
             Contains("record: Coulomb (scattered as close); in its reversals: Coulomb."));
  all.fitted.stroke = 1e-3;
  all.judged.stroke = 3e-3;
  CHECK_THAT(cli::judgement_table(all), Contains("No verdict: the judged part has paths of 3 mm"));
}

TEST_CASE("A free law finds lengths that no family has", "[fit]") {
  SlidingSprings two;
  two.of.assign(500, 3e-6);
  two.of.resize(700, 15e-6);
  cli::FitOptions free = of_rule(SnapRule::slide);
  free.law = SnapLaw::table;
  const std::string csv = two.csv(9);
  const Fitted any = fit(csv, free), lognormal = fit(csv, of_rule(SnapRule::slide));
  CHECK(any.result.residual_rms < 1.1 * two.noise);
  CHECK(lognormal.result.residual_rms > 1.3 * two.noise);
  check_recovered(any[cli::fit_kinetic], two.kinetic, 0.004);
  CHECK(any[cli::fit_length].value == Approx(two.mean_limit()).epsilon(0.05));
  // The springs' limits are in two groups, so the fitted law may have few lengths between 6 and 10 um.
  const bristle::SnapLength& law = any.result.material.snap_length;
  CHECK(law.survival(6e-6) - law.survival(10e-6) < 0.05);
  CHECK(law.survival(10e-6) == Approx(2.0 / 7.0).margin(0.05));
  CHECK_THAT(cli::fit_toml(any.data, free, any.result), Contains("law = \"table\", quantiles = ["));
  free.rule = SnapRule::redraw;
  CHECK_THAT(refusal(csv, free), Contains("--law free is for --rule slide"));
  CHECK_THAT(refusal(csv, of_rule(SnapRule::keep)),
             Contains("data.csv: rule is keep; allowed: redraw, slide"));
}

TEST_CASE("Lengths and the damper beside them are found together", "[fit]") {
  SlidingSprings damped;
  damped.damping = 700.0;  // damper of at most 0.15 N, beside the springs' 0.7 N
  damped.stribeck = 3e-4;
  const std::string csv = damped.csv(12);
  for (const SnapLaw law : {SnapLaw::lognormal, SnapLaw::table}) {
    CAPTURE(static_cast<int>(law));
    cli::FitOptions options = of_rule(SnapRule::slide);
    options.law = law;
    const Fitted fitted = fit(csv, options);
    check_recovered(fitted[cli::fit_damping], damped.damping, 60.0);
    check_recovered(fitted[cli::fit_stribeck], damped.stribeck, 3e-5);
    check_recovered(fitted[cli::fit_kinetic], damped.kinetic, 0.004);
    CHECK(fitted.result.residual_rms < 1.1 * damped.noise);
  }
}

}  // namespace bristle_test::test_fit_slide
