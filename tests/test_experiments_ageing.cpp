// The experiments that show ageing: slide-hold-slide, steps in speed, the critical stiffness of stick-slip.
// Rate and state against closed forms and a fine solution of its equations; the brush that ages against the
// tables and the closed forms of small ageing.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "expect.hpp"
#include "experiment_runs.hpp"
#include "reference_table.hpp"

using namespace bristle_test;
using cli::ExperimentResult;
using cli::SeriesRow;

namespace {

// Rate and state in the experiments: mu0 0.4 at v0 = 1 mm/s, load 2.5 N, kinetic force 1 N.
constexpr double mu0 = 0.4, v0 = 1e-3, load = 2.5;

double steady_coefficient(double a, double b, double v) { return mu0 + (a - b) * std::log(v / v0); }

// z and ln theta of a slider on a spring, by Runge-Kutta; asinh as printed by Rice and Ben-Zion.
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
    // As the experiment looks: 100 steps in each of 4 presliding lengths of 20 um.
    for (int k = 0; k < 400; ++k) {
      slider.move(v, 2e-7 / v, 50);
      peak = std::max(peak, slider.force());
    }
    double found_relaxed = 0.0;
    for (const SeriesRow& row : rows_of(result, "trace", "rate_state")) {
      if (row.values[0] == duration && row.values[2] == 0.0) found_relaxed = row.values[3];
    }
    // Tolerance of a piece 1e-7 of a N, some hundred pieces.
    CHECK(found_relaxed == Approx(relaxed).margin(1e-6));
    const SeriesRow* row = at(rows_of(result, "peak", "rate_state"), duration, 0.0);
    REQUIRE(row);
    CHECK(row->values[3] == Approx(peak).margin(1e-6));
  }
}

TEST_CASE(
    "Slide-hold-slide: on a stiff contact the peak of rate and state is b ln(1 + v t / Dc) above its "
    "sliding",
    "[experiment]") {
  const double v = 1e-4, b = 0.04;  // the defaults: a 0.02, Dc 20 um
  const ExperimentResult result =
      run("slide-hold-slide", {"stiffness=1e9", "steps_per_length=2000"}, {"rate_state"});
  const double steady = steady_coefficient(0.02, b, v) * load;
  for (const SeriesRow& row : rows_of(result, "peak", "rate_state")) {
    const double expected = steady + b * load * std::log(1.0 + row.values[0] * v / 2e-5);
    // Within the first step, 1/2000 of Dc at a theta that is up to 5000 times the steady one: at its end the
    // state has worn off by exp(-x/Dc).
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
      // theta moves from Dc/v1 to Dc/v2 as exp(-x/Dc).
      const double coefficient =
          steady_coefficient(a, b, after) + b * std::log1p((ratio - 1.0) * std::exp(-x));
      // The way before is ten lengths: what is left of the step before, and the mean of its last quarter.
      CHECK(row.values[2] == Approx(coefficient * load).margin(b * load * factor * 2.0 * std::exp(-7.5)));
    }
  }
  CHECK(finding(result, "speed_fall", "rate_state") == Approx(100.0 * (b - a) / mu0).epsilon(0.003));
  // The first look is a fiftieth of a length after the step: b ln(1 + 2 exp(-1/50)) instead of b ln 3.
  const double late = b * (std::log1p(2.0 * std::exp(-0.02)) / std::log(3.0) - 1.0);
  CHECK(finding(result, "direct_effect", "rate_state") == Approx(100.0 * (a + late) / mu0).epsilon(0.003));
  // ln(1 + 2 exp(-x)) = ln 3 / e up to the first look: x = -ln((3^(1/e) - 1) / 2).
  const double first = std::log1p(2.0 * std::exp(-0.02));
  const double way = -std::log(0.5 * std::expm1(first * std::exp(-1.0))) - 0.02;
  CHECK(finding(result, "evolution_way", "rate_state") == Approx(way).margin(0.021));
  for (const char* phenomenon : {"direct_effect", "speed_fall", "evolution_way"}) {
    CHECK(is_shown(result, phenomenon, "rate_state"));
  }
}

TEST_CASE("Velocity step: GMS follows the speed over a time, not over a way", "[experiment]") {
  // Near the Stribeck velocity, where its friction falls at both speeds.
  const ExperimentResult result =
      run("velocity-step", {"speeds=2e-4,5e-4", "attraction_rate=10", "repeats=2"}, {"gms", "lugre"});
  CHECK(is_shown(result, "speed_fall", "gms"));
  CHECK_FALSE(is_shown(result, "evolution_way", "gms"));
  CHECK(is_shown(result, "evolution_way", "lugre"));
}

TEST_CASE("Critical stiffness: bisection and linear theory find (b - a) N / Dc behind the contact's spring",
          "[experiment]") {
  struct Case {
    double a, b, length;
  };
  for (const Case& c : {Case{0.02, 0.04, 2e-5}, {0.01, 0.018, 1e-5}, {0.03, 0.04, 4e-5}}) {
    INFO("a " << c.a << ", b " << c.b << ", Dc " << c.length);
    const ExperimentResult result = run("critical-stiffness",
                                        {set("direct_effect", c.a), set("state_effect", c.b),
                                         set("state_length", c.length), "speeds=1e-5", "settling=40"},
                                        {"rate_state"});
    // Springs in series; the slider's inertia adds m v^2 / (N a Dc) of itself, 1e-7 (Rice and Ruina 1983).
    const double slip = (c.b - c.a) * load / c.length;
    const double expected = 1.0 / (1.0 / slip - 1.0 / 1e5);
    const double found = rows_of(result, "bisection", "rate_state").front().values[1];
    const double theory = rows_of(result, "theory", "rate_state").front().values[1];
    CHECK(theory == Approx(expected).epsilon(0.005));
    CHECK(found == Approx(expected).epsilon(0.03));  // bisected to 2 %
    CHECK(is_shown(result, "linear_theory", "rate_state"));
  }
}

TEST_CASE("Critical stiffness: inertia makes a heavy slider unstable on stiffer springs", "[experiment]") {
  // k_c = k (1 + m v^2 / (N a Dc)) (Rice and Ruina 1983): a slider of 25 kg at 0.2 mm/s doubles it.
  const ExperimentResult result =
      run("critical-stiffness", {"mass=25", "speeds=2e-4", "stiffness=1e9", "settling=40"}, {"rate_state"});
  const double expected = 2500.0 * (1.0 + 25.0 * 4e-8 / (2.5 * 0.02 * 2e-5));
  CHECK(rows_of(result, "theory", "rate_state").front().values[1] == Approx(expected).epsilon(0.01));
  CHECK(rows_of(result, "bisection", "rate_state").front().values[1] == Approx(expected).epsilon(0.03));
}

TEST_CASE("Critical stiffness: where friction does not fall with speed no spring makes it stick and slip",
          "[experiment]") {
  const ExperimentResult result = run("critical-stiffness", {"speeds=5e-5", "state_effect=0.01"},
                                      {"coulomb", "dahl", "maxwell_slip", "rate_state", "brush_rubbed"});
  for (const char* model : {"coulomb", "dahl", "maxwell_slip", "rate_state", "brush_rubbed"}) {
    INFO(model);
    CHECK(finding(result, "critical_stiffness", model) == 0.0);
    CHECK(finding(result, "linear_theory", model) == 0.0);
  }
}
