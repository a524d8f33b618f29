// `bristle fit` in the plane, and of positions that an encoder or a programmed stage gives. The data come
// from brute_force.hpp.
#include <catch2/catch.hpp>

#include <cmath>
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

  CHECK_THROWS_WITH(cli::judge_rivals(cli::parse_fit_columns(csv, "data.csv"), {}),
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
  // 16, 17, ... units. Near the reversals, two counts are up to twenty samples apart.
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
