// The experiments that show ageing: slide-hold-slide and steps in speed. Rate-and-state friction is compared
// with closed forms and a fine solution of its equations, strengthening with speed with its closed form.
// Tests of the infinite brush hold the brush that ages against the tables.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "experiment_runs.hpp"

namespace bristle_test::test_experiments_ageing {

using cli::ExperimentResult;
using cli::SeriesRow;

namespace {

// Rate-and-state parameters of the experiments: mu0 0.4 at v0 = 1 mm/s, load 2.5 N, kinetic force 1 N.
constexpr double mu0 = 0.4, v0 = 1e-3, load = 2.5;

double steady_coefficient(double a, double b, double v) { return mu0 + (a - b) * std::log(v / v0); }

// A slider on a spring: its position z and ln theta by Runge-Kutta, with friction in the asinh form printed
// by Rice and Ben-Zion.
struct Slider {
  double a, b, length, stiffness, z, theta;

  void move(double v, double duration, long steps) {
    const auto rate = [&](double q, double log_theta) {
      const double c = (mu0 + b * (log_theta + std::log(v0 / length))) / a;
      const double slip = 2.0 * v0 * std::exp(-c) * std::sinh(stiffness * q / (a * load));
      return std::pair{v - slip, std::exp(-log_theta) - slip / length};
    };
    const double h = duration / static_cast<double>(steps);
    double s = std::log(theta);
    for (long k = 0; k < steps; ++k) {
      const auto [z1, s1] = rate(z, s);
      const auto [z2, s2] = rate(z + 0.5 * h * z1, s + 0.5 * h * s1);
      const auto [z3, s3] = rate(z + 0.5 * h * z2, s + 0.5 * h * s2);
      const auto [z4, s4] = rate(z + h * z3, s + h * s3);
      z += h / 6.0 * (z1 + 2.0 * z2 + 2.0 * z3 + z4);
      s += h / 6.0 * (s1 + 2.0 * s2 + 2.0 * s3 + s4);
    }
    theta = std::exp(s);
  }
  double force() const { return stiffness * z; }
};

}  // namespace

TEST_CASE("Slide-hold-slide: rate and state relaxes, heals and peaks as its equations say", "[experiment]") {
  const double a = 0.012, b = 0.03, v = 1e-4, length = 1e-5, stiffness = 2e4;
  const ExperimentResult result =
      run("slide-hold-slide",
          {set("direct_effect", a), set("state_effect", b), set("speed", v), set("state_length", length),
           set("stiffness", stiffness), "holds=1,10", "settling=40"},
          {"rate_state"});
  for (const double duration : {1.0, 10.0}) {
    INFO("held for " << duration << " s");
    Slider slider{a, b, length, stiffness, steady_coefficient(a, b, v) * load / stiffness, length / v};
    slider.move(0.0, duration, 40000);
    const double relaxed = slider.force();
    double peak = 0.0;
    // Takes samples as often as the experiment does: 100 steps in each of 4 presliding lengths of 20 um.
    for (int k = 0; k < 400; ++k) {
      slider.move(v, 2e-7 / v, 50);
      peak = std::max(peak, slider.force());
    }
    double found_relaxed = 0.0;
    for (const SeriesRow& row : rows_of(result, "trace", "rate_state")) {
      if (row.values[0] == duration && row.values[2] == 0.0) found_relaxed = row.values[3];
    }
    // Tolerance: the experiment integrates in some hundred pieces with errors of up to 1e-7 in F / (a N) and
    // in psi (RateState::tolerance), which is 3e-9 N and 8e-9 N.
    CHECK(found_relaxed == Approx(relaxed).margin(1e-6));
    const auto row = at(rows_of(result, "peak", "rate_state"), duration, 0.0);
    REQUIRE(row);
    CHECK(row->values[3] == Approx(peak).margin(1e-6));
  }
}

TEST_CASE(
    "Slide-hold-slide: on a stiff contact the peak of rate and state is b ln(1 + v t / Dc) above its sliding",
    "[experiment]") {
  const double v = 1e-4, b = 0.04;  // the experiment's defaults: a 0.02, Dc 20 um
  const ExperimentResult result =
      run("slide-hold-slide", {"stiffness=1e9", "steps_per_length=2000"}, {"rate_state"});
  const double steady = steady_coefficient(0.02, b, v) * load;
  for (const SeriesRow& row : rows_of(result, "peak", "rate_state")) {
    const double expected = steady + b * load * std::log(1.0 + row.values[0] * v / 2e-5);
    // In the first step (1/2000 of Dc) the state theta is up to 5000 times its steady value; at the end of
    // that step it has decayed by exp(-x/Dc).
    CHECK(row.values[3] == Approx(expected).margin(b * load * 1e-3));
  }
  CHECK(finding(result, "healing", "rate_state") == Approx(100.0 * b / mu0).epsilon(0.03));
  CHECK(is_shown(result, "healing", "rate_state"));
  CHECK(is_shown(result, "hold_relaxation", "rate_state"));
}

TEST_CASE("Velocity step: rate and state jumps by a ln(ratio) and comes down by b over its length",
          "[experiment]") {
  const double a = 0.015, b = 0.035, length = 2e-5, factor = 3.0;
  const ExperimentResult result = run("velocity-step",
                                      {set("direct_effect", a), set("state_effect", b), "stiffness=1e9",
                                       "repeats=2", "speeds=1e-6,1e-5,1e-4", "settling=30"},
                                      {"rate_state"});
  for (const bool up : {true, false}) {
    const double ratio = up ? factor : 1.0 / factor;
    for (const SeriesRow& row : rows_of(result, up ? "up" : "down", "rate_state")) {
      INFO((up ? "up" : "down") << " from " << row.values[0] << ", x = " << row.values[1]);
      const double after = (up ? factor : 1.0) * row.values[0];
      const double x = row.values[1] * 2e-5 / length;
      // After a step in speed the state theta decays from Dc/v1 to Dc/v2 as exp(-x/Dc).
      const double coefficient =
          steady_coefficient(a, b, after) + b * std::log1p((ratio - 1.0) * std::exp(-x));
      // The previous step in speed was ten lengths before. Allows what the last quarter of that path still
      // has of it, on average.
      CHECK(row.values[2] == Approx(coefficient * load).margin(b * load * factor * 2.0 * std::exp(-7.5)));
    }
  }
  CHECK(finding(result, "speed_fall", "rate_state") == Approx(100.0 * (b - a) / mu0).epsilon(0.003));
  // The first sample is a fiftieth of Dc after the step in speed: b ln(1 + 2 exp(-1/50)) instead of b ln 3.
  const double late = b * (std::log1p(2.0 * std::exp(-0.02)) / std::log(3.0) - 1.0);
  CHECK(finding(result, "direct_effect", "rate_state") == Approx(100.0 * (a + late) / mu0).epsilon(0.003));
  // Path x after which the friction b ln(1 + 2 exp(-x)) has fallen to 1/e of its first sample.
  const double first = std::log1p(2.0 * std::exp(-0.02));
  const double path = -std::log(0.5 * std::expm1(first * std::exp(-1.0))) - 0.02;
  CHECK(finding(result, "evolution_path", "rate_state") == Approx(path).margin(0.021));
  for (const char* phenomenon : {"direct_effect", "speed_fall", "evolution_path"}) {
    CHECK(is_shown(result, phenomenon, "rate_state"));
  }
}

TEST_CASE("Velocity step: GMS follows the speed over a time, not over a path", "[experiment]") {
  // Both speeds are near the Stribeck velocity, where friction of the LuGre model falls with speed.
  const ExperimentResult result =
      run("velocity-step", {"speeds=2e-4,5e-4", "attraction_rate=10", "repeats=2", "factor=1.2", "path=40"},
          {"gms", "lugre"});
  CHECK(is_shown(result, "speed_fall", "gms"));
  CHECK_FALSE(is_shown(result, "evolution_path", "gms"));
  CHECK(is_shown(result, "evolution_path", "lugre"));
}

TEST_CASE("Velocity step: strengthening with speed raises friction at once by a ln(v2 / v1)",
          "[experiment]") {
  const double a = 0.008, speed = 1e-6;
  const Sets sets = {"aged_damper=0", "viscous=0", "repeats=2", "steps_per_length=1000"};
  const ExperimentResult without = run("velocity-step", sets, {"brush_aged"});
  const ExperimentResult with =
      run("velocity-step", sets + Sets{set("strengthening", a), set("strengthening_speed", speed)},
          {"brush_aged"});
  CHECK_FALSE(is_shown(without, "direct_effect", "brush_aged"));
  CHECK(is_shown(with, "direct_effect", "brush_aged"));
  CHECK(is_shown(with, "speed_fall", "brush_aged"));
  for (const SeriesRow& row : rows_of(with, "step", "brush_aged")) {
    const double v = row.values[0];
    INFO("from " << v << " m/s");
    // Expected change over kinetic friction, per e-fold of speed. The first sample is a thousandth of a
    // length after the step, by which a thousandth of the fall of 5 % has happened.
    const double expected =
        a / mu0 * (std::asinh(1.5 * v / speed) - std::asinh(0.5 * v / speed)) / std::log(3.0);
    CHECK(row.values[2] == Approx(expected).margin(6e-4));
    const auto plain = at(rows_of(without, "step", "brush_aged"), v, 1e-9 * v);
    REQUIRE(plain);
    CHECK(row.values[3] == Approx(plain->values[3] - expected).margin(1e-6));
  }
}

}  // namespace bristle_test::test_experiments_ageing
