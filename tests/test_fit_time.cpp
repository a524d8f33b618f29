// `bristle fit` of effects of time, speed and direction, and in the plane: finds known parameters, and says
// what the data cannot separate. The data come from brute_ageing.hpp and brute_force.hpp.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/fit_helpers.hpp"
#include "tests/synthetic_friction.hpp"
#include "tools/libraries/fitting/judge.hpp"
#include "tools/libraries/fitting/path_force.hpp"

namespace bristle_test::test_fit_time {

using bristle::SnapRule;
using Catch::Matchers::Contains;

namespace {

constexpr double beta = 0.02, tau = 1e-3;  // strength of ageing per e-fold; age (s) from which bristles age

double grown(double age) { return logarithmic_growth(age, beta, tau); }

SyntheticFriction noisy(const std::vector<Piece>& pieces) {
  SyntheticFriction s;
  s.rate = 100.0;
  s.noise = 0.01;
  s.motion = programme(pieces);
  s.duration = programme_length(pieces);
  return s;
}

/// Writes a record in the plane: a spiral that opens to 60 um at 1.5 turns a second.
std::string spiral(double kinetic, double length, double spread, double offset_x, double offset_y) {
  BruteForcePatch brush(1800, lognormal_quantile(length, spread), true, 5);
  const double bend = 0.5 * length * (1.0 + spread * spread), load = 2.0;
  std::mt19937_64 generator(7);
  std::normal_distribution<double> noise(0.0, 0.01);
  std::string csv = "t,x,y,load,fx,fy\n";
  double x = 0.0, y = 0.0;
  for (int i = 0; i < 800; ++i) {
    const double t = 0.01 * i, radius = 60e-6 * t / 8.0, angle = 2.0 * M_PI * 1.5 * t;
    const double next_x = radius * std::cos(angle), next_y = 0.6 * radius * std::sin(angle);
    const BruteStep step = brush.step(next_x - x, next_y - y);
    x = next_x;
    y = next_y;
    csv += fmt::format("{},{},{},{},{},{}\n", t, x, y, load,
                       kinetic * load * step.end_x / bend + offset_x + noise(generator),
                       kinetic * load * step.end_y / bend + offset_y + noise(generator));
  }
  return csv;
}

}  // namespace

TEST_CASE("The force along a path follows bristles that age, through slides, rests and reversals", "[fit]") {
  // The tolerance is five times the fluctuation of 20,000 bristles, 0.5 % of the kinetic force, and the
  // second-order error of pieces of 1/16 lengths.
  const double length = 1e-5, spread = 0.3, strength = 0.05, time = 0.01;
  AgedBristles bristles(
      20000, lognormal_quantile(length, spread),
      [=](double age) { return logarithmic_growth(age, strength, time); }, 3);
  std::vector<cli::PathPoint> path{{0.0, 2.0, false, 0.0}};
  std::vector<double> expected;
  const auto go = [&](double lengths, double seconds, int pieces) {
    for (int i = 0; i < pieces; ++i) {
      const cli::PathPoint last = path.back();
      bristles.step(lengths * length / pieces, 0.0, seconds / pieces);
      path.push_back({last.x + lengths * length / pieces, 2.0, true, last.t + seconds / pieces});
      expected.push_back(bristles.x() / length);
    }
  };
  go(6.0, 0.6, 60);
  go(0.0, 100.0, 1);
  go(3.0, 0.3, 30);
  go(-5.0, 5.0, 50);
  go(0.0, 10.0, 5);
  go(-4.0, 0.004, 40);
  cli::BrushShape shape{bristle::SnapLaw::lognormal, SnapRule::redraw, spread};
  shape.ageing_strength = strength;
  shape.ageing_time = time;
  const std::vector<double> force = cli::PathForce(path).find(shape, length, {}, cli::Detail::finish);
  const double bend = 0.5 * (1.0 + spread * spread);
  double worst = 0.0;
  for (std::size_t i = 0; i < force.size(); ++i)
    worst = std::max(worst, std::abs(0.5 * force[i] * bend - expected[i]));
  CHECK(worst < 0.025 * bend);
}

TEST_CASE("Every shape that a search may come by is a material", "[fit]") {
  // Expected lengths: with strong growth at rest, bristles that have just snapped are weak and so take up
  // little of the presliding length.
  for (const double growth : {1.0, 3.0, 30.0}) {
    cli::BrushShape shape{bristle::SnapLaw::lognormal, SnapRule::redraw, 0.3};
    shape.residual_share = cli::widest_residual;
    shape.growth = growth;
    CAPTURE(growth);
    CHECK_NOTHROW(shape.material(1e-5).validate());
  }
}

TEST_CASE("Strokes for ever leave the expected force of a slide as it is", "[fit]") {
  // Moves by a stroke of 27 mean lengths, which erases all memory: not one bristle in ten million is
  // longer.
  const double length = 1e-5;
  std::vector<cli::PathPoint> path{{0.0, 1.0, false}};
  const int strokes = 60, samples = 27;
  for (int k = 0; k < strokes; ++k) {
    for (int i = 1; i <= samples; ++i)
      path.push_back({length * (k % 2 ? samples - i : i), 1.0, true, static_cast<double>(path.size())});
  }
  const cli::BrushShape shape{bristle::SnapLaw::lognormal, SnapRule::redraw, 0.4};
  const std::vector<double> force = cli::PathForce(path).find(shape, length, {}, cli::Detail::finish);
  for (int k : {1, strokes - 2, strokes - 1})
    CHECK(std::abs(force[static_cast<std::size_t>(samples * (k + 1) - 1)]) == Approx(1.0).epsilon(1e-3));
}

TEST_CASE("A length holds where few samples show the spread", "[fit]") {
  // True lengths are 16.4 um at a spread of 0.4; in sliding, samples are 2.5 and 5 um apart.
  SyntheticFriction s = noisy(slide_hold_slide());
  s.growth = grown;
  for (const double rate : {40.0, 20.0}) {
    s.rate = rate;
    const Fitted found = fit(record(s, 11).csv());
    const double age = found.result.frame.age;
    CAPTURE(rate);
    check_recovered(found[cli::fit_length], s.length * grown(age), 3e-6);
    check_recovered(found[cli::fit_kinetic], kinetic_at(s, 100e-6), 0.01);
    CHECK_FALSE(found[cli::fit_spread].fitted);
    CHECK_THAT(found[cli::fit_spread].why, Contains("do as well"));
    CHECK(found[cli::fit_spread].value == Approx(s.spread).epsilon(0.2));
  }
}

TEST_CASE("An interval holds the lengths of every spread that does as well", "[fit]") {
  SyntheticFriction s = noisy(slide_hold_slide());
  s.spread = 0.8;
  s.rate = 20.0;
  const Fitted found = fit(record(s, 11).csv());
  double least = 0.0, most = 0.0;
  REQUIRE(std::sscanf(found[cli::fit_spread].why.c_str(), "%lg to %lg do as well", &least, &most) == 2);
  // The record shows only kinetic force over length (1 + spread^2) / 2, so length and spread trade off.
  const cli::FitEstimate& length = found[cli::fit_length];
  const auto wide = [](double spread) { return 1.0 + spread * spread; };
  const double same = length.value * wide(found[cli::fit_spread].value);
  CHECK(length.low < same / wide(most));
  CHECK(length.high > same / wide(least));
}

TEST_CASE("Samples farther apart than the bristles are long show kinetic friction alone", "[fit]") {
  SyntheticFriction s = noisy(slide_hold_slide());
  s.growth = grown;
  // Records at rates so low that samples of sliding are 10 and 20 um apart.
  for (const auto& [rate, seed] : {std::pair(10.0, 11u), std::pair(5.0, 13u)}) {
    s.rate = rate;
    const Fitted found = fit(record(s, seed).csv());
    CAPTURE(rate);
    check_recovered(found[cli::fit_kinetic], kinetic_at(s, 100e-6), 0.01);
    CHECK_FALSE(found[cli::fit_length].fitted);
    CHECK_FALSE(found[cli::fit_spread].fitted);
  }
}

TEST_CASE("A fit recovers ageing from rests of differing length", "[fit]") {
  SyntheticFriction s = noisy(slide_hold_slide());
  s.growth = grown;
  const Fitted fitted = fit(record(s, 11).csv());
  const cli::FitFrame& frame = fitted.result.frame;
  CHECK(frame.speed == Approx(100e-6));
  check_recovered(fitted[cli::fit_kinetic], kinetic_at(s, frame.speed), 0.01);
  check_recovered(fitted[cli::fit_length], s.length * grown(frame.age), 3e-6);
  check_recovered(fitted[cli::fit_ageing], beta / grown(frame.age), 0.012);
  // The record cannot show these two: every age is far above the millisecond from which ageing begins, and a
  // single speed shows no strengthening.
  CHECK_FALSE(fitted[cli::fit_ageing_time].fitted);
  CHECK_THAT(fitted[cli::fit_ageing_time].why, Contains("do as well"));
  CHECK_THAT(fitted[cli::fit_strengthening].why, Contains("one speed only"));
  // Checks that the returned material contains the fitted values.
  const bristle::Material& m = fitted.result.material;
  CHECK(m.ageing_strength > 0.0);
  CHECK(m.kinetic_coefficient(frame.speed) == Approx(fitted[cli::fit_kinetic].value).epsilon(1e-6));
  CHECK(fitted.result.peak.value == Approx(m.peak_coefficient(frame.age)).epsilon(1e-6));
  const std::string scene = cli::fit_toml(fitted.data, {}, fitted.result);
  CHECK_THAT(scene, Contains("ageing_form = \"logarithmic\"") && Contains("fall_per_decade = "));
  CHECK_THAT(cli::fit_table(fitted.data, fitted.result), Contains("this form is") && Contains("notes"));
  CHECK(fitted.result.curve.size() == fitted.data.samples());
}

TEST_CASE("A fit finds that a contact had rested before its record", "[fit]") {
  std::vector<Piece> pieces = slide_hold_slide();
  pieces.insert(pieces.begin(), {100, 0});
  SyntheticFriction s = noisy(pieces);
  s.growth = grown;
  RecordedFriction whole = record(s, 11);
  for (std::vector<double>* column : {&whole.t, &whole.x, &whole.load, &whole.force})
    column->erase(column->begin(), column->begin() + 10000);  // leaves out the rest
  const Fitted fitted = fit(whole.csv());
  // The fit tries decades.
  CHECK(fitted.result.past.rested >= 10.0);
  CHECK(fitted.result.past.rested <= 1000.0);
  CHECK_THAT(cli::fit_table(fitted.data, fitted.result), Contains("had rested for some"));
  check_recovered(fitted[cli::fit_ageing], beta / grown(fitted.result.frame.age), 0.012);
}

TEST_CASE("A fit recovers ageing and strengthening with speed together", "[fit]") {
  SyntheticFriction s = noisy(velocity_steps());
  s.growth = grown;
  s.strengthening = 0.01;
  s.strengthening_speed = 1e-6;
  const Fitted fitted = fit(record(s, 11).csv());
  const cli::FitFrame& frame = fitted.result.frame;
  check_recovered(fitted[cli::fit_kinetic], kinetic_at(s, frame.speed), 0.01);
  check_recovered(fitted[cli::fit_length], s.length * grown(frame.age), 2e-6);
  check_recovered(fitted[cli::fit_ageing], beta / grown(frame.age), 0.015);
  check_recovered(fitted[cli::fit_strengthening], s.strengthening, 0.006);
  CHECK(fitted.result.material.speed_strengthening == fitted[cli::fit_strengthening].value);
  CHECK_FALSE(fitted[cli::fit_damping].fitted);
}

TEST_CASE("Ageing and strengthening are not found where there is none, or nothing that shows them", "[fit]") {
  SECTION("speeds and rests of bristles that do not age") {
    const Fitted fitted = fit(record(noisy(velocity_steps()), 11).csv());
    CHECK(fitted[cli::fit_ageing].value == 0.0);
    CHECK(fitted[cli::fit_strengthening].value == 0.0);
    CHECK(fitted.result.frame.speed == 0.0);
  }
  SECTION("one speed, no rest") {
    SyntheticFriction s = noisy({{1, 50e-6}, {1, -50e-6}, {1, 50e-6}, {1, -50e-6}, {1, 50e-6}});
    s.growth = grown;
    const Fitted fitted = fit(record(s, 11).csv());
    for (const auto p : {cli::fit_ageing, cli::fit_strengthening}) {
      CHECK(fitted[p].value == 0.0);
      CHECK_THAT(fitted[p].why, Contains("one speed and no rest"));
    }
  }
  SECTION("steady sliding at six speeds, one way: only the difference of the two shows") {
    // Takes a sample every five seconds. The body moves by a snap length or more between samples, so each
    // shows a steady force only.
    SyntheticFriction s =
        noisy({{50, 1e-3}, {100, 0.1e-3}, {300, 20e-6}, {600, 4e-6}, {100, 0.3e-3}, {200, 40e-6}});
    s.rate = 0.2;
    s.strengthening = 0.02;
    s.strengthening_speed = 1e-8;
    const Fitted fitted = fit(record(s, 12).csv());
    CHECK_FALSE(fitted[cli::fit_ageing].fitted);
    CHECK_FALSE(fitted[cli::fit_strengthening].fitted);
    CAPTURE(cli::fit_table(fitted.data, fitted.result));
    CHECK_THAT(fitted[cli::fit_ageing].why, Contains("does not tell ageing from strengthening"));
  }
}

TEST_CASE("A fit tells ageing that comes to an end from ageing that goes on", "[fit]") {
  SyntheticFriction s = noisy(velocity_steps());
  s.growth = [](double age) { return 1.0 + 0.15 * (1.0 - std::exp(-age / 0.5)); };
  const Fitted fitted = fit(record(s, 11).csv());
  CHECK(fitted.result.frame.form == bristle::AgeingForm::saturating);
  CHECK_FALSE(fitted.result.frame.form_assumed);
  check_recovered(fitted[cli::fit_ageing], 0.15, 0.03);
  check_recovered(fitted[cli::fit_ageing_time], 0.5, 0.3);
  CHECK(fitted.result.material.ageing_form == bristle::AgeingForm::saturating);
}

TEST_CASE("Friction that differs with the direction is told from an offset of the sensor by the load",
          "[fit]") {
  SyntheticFriction s;
  s.motion = loops_and_strokes;
  s.rate = 100.0;
  s.noise = 0.01;
  s.asymmetry = 0.05;
  s.drift = [](double) { return 0.03; };
  s.load = [](double t) { return 2.0 + std::sin(1.3 * t); };
  s.most_load = 3.0;
  s.bristles = 2700;
  const Fitted several = fit(record(s, 11).csv());
  check_recovered(several[cli::fit_asymmetry], 0.05, 0.02);
  check_recovered(several[cli::fit_offset], 0.03, 0.015);
  check_recovered(several.result.forward, 1.05 * s.kinetic, 0.01);
  check_recovered(several.result.backward, 0.95 * s.kinetic, 0.01);
  CHECK_THAT(cli::fit_table(several.data, several.result), Contains("kinetic towards +x"));

  s.load = [](double) { return 2.0; };
  s.most_load = 0.0;
  const Fitted one = fit(record(s, 11).csv());
  CHECK_FALSE(one[cli::fit_asymmetry].fitted);
  CHECK_THAT(one[cli::fit_asymmetry].why, Contains("one load only"));
  // A fit without a difference of directions takes it as offset: 0.03 N, and 5 % of 0.35 x 2 N in sliding,
  // less in small loops.
  CHECK(one[cli::fit_offset].value ==
        Approx(0.03 + 0.75 * 0.05 * 0.35 * 2.0).margin(0.25 * 0.05 * 0.35 * 2.0));
  REQUIRE(one.result.notes.size() == 1);
  CHECK_THAT(one.result.notes[0],
             Contains("differs with the direction") && Contains("one load does not tell"));
}

TEST_CASE("A record in the plane is fitted as one isotropic contact", "[fit]") {
  const double kinetic = 0.35, length = 15e-6, spread = 0.4;
  const std::string csv = spiral(kinetic, length, spread, 0.02, -0.03);
  const Fitted fitted = fit(csv);
  CHECK(fitted.data.axes == 2);
  check_recovered(fitted[cli::fit_kinetic], kinetic, 0.01);
  check_recovered(fitted[cli::fit_length], length, 1.5e-6);
  check_recovered(fitted[cli::fit_spread], spread, 0.1);
  check_recovered(fitted[cli::fit_offset], 0.02, 0.006);
  check_recovered(fitted[cli::fit_offset_y], -0.03, 0.006);
  CHECK_THAT(cli::fit_table(fitted.data, fitted.result), Contains("one isotropic contact"));
  CHECK_THAT(cli::fit_toml(fitted.data, {}, fitted.result), Contains("axes = 2"));
  CHECK_THAT(cli::fit_csv(fitted.data, fitted.result), Contains("t,x,y,load,fx,fy,fit_x,fit_y"));

  cli::FitOptions keep;
  keep.rule = SnapRule::keep;
  CHECK_THAT(refusal(csv, keep), Contains("two axes (x, y, fx, fy) need --rule redraw"));
  CHECK_THROWS_WITH(cli::judge_rivals(cli::parse_fit_columns(csv, "data.csv"), {}, 3.0),
                    Contains("--rivals has one axis"));
  // Refuses a record of two position axes with one column of force.
  std::string half = "t,x,y,load,fx\n";
  for (int i = 0; i < 40; ++i) half += fmt::format("{},{},{},1,1\n", i, i % 7, i % 5);
  CHECK_THAT(refusal(half), Contains("column y varies, and there is no column fy"));
}

TEST_CASE("A stage that runs at a constant speed is no encoder", "[fit]") {
  // Record with 80 um between samples of motion: rest, then forward; rest, then back.
  std::string csv = "t,x,load,force\n";
  double x = 0.0;
  for (int i = 0; i < 400; ++i) {
    const double v = i % 200 < 60 ? 0.0 : i < 200 ? 80e-6 : -80e-6;
    x += v;
    csv += fmt::format("{},{:.9g},2,{}\n", 0.01 * i, x, v > 0.0 ? 0.7 : v < 0.0 ? -0.7 : 0.1 * (i % 3));
  }
  const cli::FitData data =
      cli::prepare_fit_data(cli::parse_fit_columns(csv, "data.csv"), cli::ForceSign::automatic, {});
  CHECK(data.quantum == 0.0);
  CHECK(data.longest_rest == Approx(0.6).margin(0.011));
}

TEST_CASE("A rest that an encoder sees stays a rest", "[fit]") {
  // Record of a creep of one encoder count every five samples, with a rest of 100 samples in the middle.
  std::string csv = "t,x,load,force\n";
  for (int i = 0; i < 300; ++i) {
    const int creep = i < 100 ? i : i < 200 ? 100 : i - 100;
    csv += fmt::format("{},{:.9g},2,{}\n", 0.01 * i, 1e-6 * std::floor(0.2 * creep + 0.01 * (creep % 2)),
                       0.7 + 0.01 * (i % 5));
  }
  const cli::FitData data =
      cli::prepare_fit_data(cli::parse_fit_columns(csv, "data.csv"), cli::ForceSign::by_body, {});
  CHECK(data.quantum == Approx(1e-6));
  CHECK(data.path[120].x == data.path[180].x);
  CHECK(data.path[20].x < data.path[22].x);  // the fit smooths the steps of the creeping part
}

TEST_CASE("An encoder is seen behind the digits of the file", "[fit]") {
  // Record of a swing in which an encoder count is 5.5 units of the file's last digit, so moves are 5, 6, 11,
  // 16, 17, ... units. Near the turns, two counts are up to twenty samples apart.
  const double digit = 1e-6, count = 5.5 * digit;
  std::string csv = "t,x,load,force\n";
  std::vector<double> speed;
  for (int i = 0; i < 800; ++i) {
    const double t = 0.01 * i, x = 300e-6 * std::sin(t);
    speed.push_back(300e-6 * std::cos(t));
    csv += fmt::format("{},{:.9g},2,{:.6g}\n", t, digit * std::round(count * std::round(x / count) / digit),
                       0.7 * std::tanh(speed.back() / 2e-5) + 0.01 * (i % 3));
  }
  const cli::FitData data =
      cli::prepare_fit_data(cli::parse_fit_columns(csv, "data.csv"), cli::ForceSign::by_body, {});
  CHECK(data.quantum == Approx(count).epsilon(1e-3));
  for (std::size_t i = 30; i + 30 < speed.size(); ++i) {
    CAPTURE(i);
    REQUIRE(std::abs(data.velocity[i] - speed[i]) < 0.25 * 300e-6);
    // Samples at more than 0.3 of the highest speed must not be taken for a rest.
    if (std::abs(speed[i]) > 0.3 * 300e-6) REQUIRE(data.velocity[i] != 0.0);
  }
}

}  // namespace bristle_test::test_fit_time
