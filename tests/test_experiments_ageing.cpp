// The experiments that show ageing: slide-hold-slide, steps in speed, the critical stiffness of stick-slip.
// Rate-and-state friction is compared with closed forms and a fine solution of its equations; the brush that
// ages with the tables and closed forms for small ageing.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "expect.hpp"
#include "experiment_runs.hpp"
#include "reference_table.hpp"
#include "tools/libraries/experiments/subject.hpp"
#include "tools/libraries/stability/pulled.hpp"

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
  const double way = -std::log(0.5 * std::expm1(first * std::exp(-1.0))) - 0.02;
  CHECK(finding(result, "evolution_path", "rate_state") == Approx(way).margin(0.021));
  for (const char* phenomenon : {"direct_effect", "speed_fall", "evolution_path"}) {
    CHECK(is_shown(result, phenomenon, "rate_state"));
  }
}

TEST_CASE("Velocity step: GMS follows the speed over a time, not over a way", "[experiment]") {
  // Both speeds are near the Stribeck velocity, where friction of the LuGre model falls with speed.
  const ExperimentResult result =
      run("velocity-step", {"speeds=2e-4,5e-4", "attraction_rate=10", "repeats=2", "factor=1.2", "path=40"},
          {"gms", "lugre"});
  CHECK(is_shown(result, "speed_fall", "gms"));
  CHECK_FALSE(is_shown(result, "evolution_path", "gms"));
  CHECK(is_shown(result, "evolution_path", "lugre"));
}

namespace {

constexpr double length = 2e-5;  // presliding length of the experiments, m

// Settings of the tables' brush: no residual, no renewal, no damper, a tau of 10 ms. The tables have speeds
// in lengths per tau and forces in mean snap lengths; kinetic friction at high speed is m2 / 2.
const Sets plain_law = {"residual=0", "renewal=0", "aged_damper=0", "viscous=0", "ageing_time=0.01"};
double speed_of(double w) { return w * length / 0.01; }
double fast_deflection(const std::string& dist) {
  return dist == "uniform_0.5_1.5" ? 0.5 * (1.0 + 1.0 / 12.0) : 0.5 * (1.0 + 0.09);
}

// Error of the infinite brush at a resolution of 8, mean snap lengths.
constexpr double resolution_error = 2e-3;

// Mean deflection over the presliding length in steady sliding at v, by quadrature: a bristle survives a path
// r beyond the residual with probability S(r / g(r / v)), times that of not being renewed on the way. Uniform
// lengths, half to one and a half.
struct RubbedLaw {
  double residual, renewal, beta, tau;

  double survival(double r) const { return std::clamp(1.5 - r / (1.0 - residual), 0.0, 1.0); }
  double factor(double age) const { return 1.0 + beta * std::log1p(age / tau); }

  // Integrates by the midpoint rule; nu solves (1 + kappa) nu int T = 1 with T = S exp(-kappa nu r).
  template <class Integrand>
  double integral(const Integrand& f) const {
    const int n = 4000;
    const double h = 4.0 / n;
    double sum = 0.0;
    for (int i = 0; i < n; ++i) sum += h * f(h * (i + 0.5));
    return sum;
  }
  double rate_at(double v) const {
    double low = 0.0, high = 10.0;
    for (int k = 0; k < 60; ++k) {
      const double nu = 0.5 * (low + high);
      const double whole = integral([&](double r) { return left(r, v, nu); });
      ((1.0 + renewal) * nu * whole < 1.0 ? low : high) = nu;
    }
    return 0.5 * (low + high);
  }
  double left(double r, double v, double nu) const {
    return survival(r / factor(r * length / v)) * std::exp(-renewal * nu * r);
  }
  double deflection(double v) const {
    const double nu = rate_at(v);
    return residual + integral([&](double r) { return r * left(r, v, nu); }) /
                          integral([&](double r) { return left(r, v, nu); });
  }
  // Returns how much the peak rises per growth of all snap lengths, both relative, for a small growth at
  // once, as in a hold. Snaps come late by that growth, so the falls of force that they bring are missing,
  // and those of the bristles that they would have renewed.
  double rise() const {
    const double fast = 1e30;
    const double nu = rate_at(fast);
    const double whole = integral([&](double r) { return left(r, fast, nu); });
    const double bent = integral([&](double r) { return r * left(r, fast, nu); }) / whole;
    const double mean =
        1.0 - residual;  // lengths have the density 1 / mean between half the mean and one and a half
    const auto moment = [&](int power) {
      return integral([&](double d) {
               const bool inside = d > 0.5 * mean && d < 1.5 * mean;
               return inside ? std::pow(d, power) / mean * std::exp(-renewal * nu * d) : 0.0;
             }) /
             whole;
    };
    return moment(2) + renewal * bent * moment(1);
  }
};

}  // namespace

TEST_CASE("The brush that ages slides at every speed as the table says", "[experiment]") {
  int points = 0;
  const std::vector<Row> table = read_table("ageing_steady.csv");
  for (const char* dist : {"uniform_0.5_1.5", "lognormal_cv0.3"}) {
    for (const char* beta : {"0.05", "0.1"}) {
      std::string speeds;
      for (const Row& row : table) {
        if (row.at("dist") != dist || row.at("beta") != beta || row.at("variant") != "redraw") continue;
        speeds += (speeds.empty() ? "speeds=" : ",") +
                  std::to_string(speed_of(number(row, "v_tau_over_dbar")) * 1e9) + "e-9";
      }
      const ExperimentResult result =
          run("stribeck",
              plain_law + law_of(dist) + Sets{std::string("ageing=") + beta, speeds, "dt=0.1", "path=30"},
              {"brush_aged"});
      for (const Row& row : table) {
        if (row.at("dist") != dist || row.at("beta") != beta || row.at("variant") != "redraw") continue;
        const double v = speed_of(number(row, "v_tau_over_dbar"));
        INFO(dist << ", beta " << beta << " at " << v << " m/s");
        const auto found = at(rows_of(result, "dry", "brush_aged"), v, 1e-6 * v);
        REQUIRE(found);
        expect_near(found->values[1] * fast_deflection(dist), number(row, "f_kinetic_ref"), resolution_error,
                    "mean deflection");
        ++points;
      }
    }
  }
  CHECK(points >= 28);
}

TEST_CASE("Slide-hold-slide: the peaks of the brush that ages are those of the table", "[experiment]") {
  const std::vector<Row> table = read_table("ageing_hold.csv");
  std::map<std::string, Sets> runs;  // settings and holds of each slide-hold-slide run, by law, beta, speed
  int points = 0;
  for (const Row& first : table) {
    const std::string key = first.at("dist") + first.at("beta") + first.at("v_tau_over_dbar");
    if (first.at("variant") != "redraw" || runs.count(key)) continue;
    std::vector<const Row*> rows;
    std::string holds;
    for (const Row& row : table) {
      const double hold = 0.01 * number(row, "hold_over_tau");
      if (row.at("dist") + row.at("beta") + row.at("v_tau_over_dbar") != key || hold == 0.0) continue;
      rows.push_back(&row);
      holds += (holds.empty() ? "holds=" : ",") + std::to_string(hold);
    }
    runs[key] = {holds};
    const ExperimentResult result = run("slide-hold-slide",
                                        plain_law + law_of(first.at("dist")) +
                                            Sets{holds, "ageing=" + first.at("beta"),
                                                 set("speed", speed_of(number(first, "v_tau_over_dbar"))),
                                                 "steps_per_length=50", "settling=12"},
                                        {"brush_aged"});
    for (const Row* row : rows) {
      INFO(key << ", held for " << row->at("hold_over_tau"));
      const double hold = 0.01 * number(*row, "hold_over_tau");
      const auto found = at(rows_of(result, "peak", "brush_aged"), hold, 1e-6 * hold);
      REQUIRE(found);
      expect_near(found->values[3] * fast_deflection(first.at("dist")),
                  number(*row, "peak_over_kinetic") * number(*row, "kinetic"), 2.0 * resolution_error,
                  "peak");
      ++points;
    }
  }
  CHECK(points >= 60);
}

TEST_CASE("Velocity step: the brush that ages follows the table", "[experiment]") {
  int points = 0;
  std::map<std::string, ExperimentResult> runs;
  for (const Row& row : read_table("ageing_velocity_step.csv")) {
    const double v1 = number(row, "v1_tau_over_dbar"), v2 = number(row, "v2_tau_over_dbar");
    const double x = number(row, "x_after_step_over_dbar");
    if (x == 0.0 || x > 5.0) continue;
    const std::string key =
        row.at("dist") + row.at("beta") + row.at("v1_tau_over_dbar") + "," + row.at("v2_tau_over_dbar");
    if (!runs.count(key)) {
      const double slow = speed_of(std::min(v1, v2));
      runs[key] = run(
          "velocity-step",
          plain_law + law_of(row.at("dist")) +
              Sets{"ageing=" + row.at("beta"), set("factor", std::max(v1, v2) / std::min(v1, v2)),
                   "speeds=" + set("", slow).substr(1) + "," + set("", 2.0 * slow).substr(1), "repeats=1"},
          {"brush_aged"});
    }
    INFO(key << ", x = " << x);
    const double slow = speed_of(std::min(v1, v2));
    for (const SeriesRow& found : rows_of(runs[key], v2 > v1 ? "up" : "down", "brush_aged")) {
      if (std::abs(found.values[0] - slow) > 1e-6 * slow || std::abs(found.values[1] - x) > 1e-6) continue;
      expect_near(found.values[2] * fast_deflection(row.at("dist")), number(row, "f"), resolution_error,
                  "mean deflection");
      ++points;
    }
  }
  CHECK(points >= 60);
}

TEST_CASE("Friction of the brush that ages lags behind the speed as the table says", "[experiment]") {
  for (const Row& row : read_table("ageing_lag.csv")) {
    const double v = speed_of(number(row, "v0_tau_over_dbar"));
    const double omega = number(row, "Omega_dbar_over_v0") * v / length;
    INFO(row.at("dist") << ", beta " << row.at("beta") << ", Omega " << row.at("Omega_dbar_over_v0"));
    const ExperimentResult result =
        run("friction-lag",
            plain_law + law_of(row.at("dist")) +
                Sets{"ageing=" + row.at("beta"), set("velocity_mean", v), set("velocity_amplitude", 0.9 * v),
                     set("omegas", omega), "cycles=4", set("dt", 0.02 * length / v)},
            {"brush_aged"});
    const SeriesRow found = rows_of(result, "width", "brush_aged").front();
    const double fast = fast_deflection(row.at("dist"));
    expect_near(found.values[1] * fast, number(row, "f_at_v0_accelerating"), resolution_error, "speeding up");
    expect_near(found.values[2] * fast, number(row, "f_at_v0_decelerating"), resolution_error,
                "slowing down");
  }
}

TEST_CASE(
    "With little ageing friction falls by beta per e-fold of speed, and peaks grow by 2 beta per e-fold "
    "of the hold",
    "[experiment]") {
  const double beta = 0.005, tau = 0.01;
  for (const bool rubbed : {false, true}) {
    INFO((rubbed ? "with residual and renewal" : "redraw"));
    const RubbedLaw none{rubbed ? 0.1 : 0.0, rubbed ? 1.0 : 0.0, 0.0, tau};
    const RubbedLaw law{none.residual, none.renewal, beta, tau};
    const double fast = none.deflection(1.0), ages = (fast - none.residual) / fast;
    const Sets sets = plain_law + Sets{set("residual", none.residual), set("renewal", none.renewal),
                                       set("ageing", beta), "resolution=32"};
    // When ages far exceed tau, at slow speeds, dF/d ln v is -beta of the friction beyond the residual.
    const ExperimentResult slid =
        run("stribeck", sets + Sets{"speeds=1e-7,1e-6,1e-5", "dt=0.1", "path=20"}, {"brush_aged"});
    const std::vector<SeriesRow> rows = rows_of(slid, "dry", "brush_aged");
    const double slope =
        (rows[1].values[1] - rows[0].values[1]) / std::log(rows[1].values[0] / rows[0].values[0]);
    CHECK(slope == Approx(-beta * ages).epsilon(0.05));
    for (const SeriesRow& row : rows) {
      CHECK(row.values[1] == Approx(law.deflection(row.values[0]) / fast).margin(1e-3));
    }
    // Lets the contact rest far longer than a bristle ages in sliding.
    const ExperimentResult held =
        run("slide-hold-slide", sets + Sets{"speed=1e-4", "holds=1e3,1e5,1e7", "steps_per_length=400"},
            {"brush_aged"});
    const double healing = 0.01 * finding(held, "healing", "brush_aged");
    const double expected = beta * none.rise() / fast;
    if (!rubbed) CHECK(expected == Approx(2.0 * beta).epsilon(1e-3));
    // Longer snap lengths delay the peak, until which more bristles have snapped; so healing per decade is
    // divided by g of the hold, here of the middle one.
    CHECK(healing * law.factor(1e5) == Approx(expected).epsilon(0.05));
  }
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

TEST_CASE("Break-away of the brush that ages falls with the force rate as its snap lengths do",
          "[experiment]") {
  // A first pull follows the virgin curve with all snap lengths longer by g of the pull's duration, the age
  // of all bristles. A light block adds little inertia.
  const double tau = 0.01, beta = 0.05;
  const Row row = find_row(read_table("summary.csv"), {{"dist", "uniform_0.5_1.5"}, {"variant", "redraw"}});
  const double young = number(row, "f_peak") / number(row, "f_kinetic");
  const ExperimentResult result =
      run("break-away",
          plain_law + Sets{"law=uniform", set("ageing", beta), "mass=0.01", "rates=0.02,0.2,2",
                           "loads=2.4,2.5", "rests=0.1", "dt=2e-3", "resolution=32"},
          {"brush_aged"});
  for (const SeriesRow& found : rows_of(result, "rate", "brush_aged")) {
    INFO(found.values[0] << " N/s");
    const double time = found.values[3] / found.values[0];
    const double expected = young * (1.0 + beta * std::log1p(time / tau));
    CHECK(found.values[3] == Approx(expected).epsilon(0.005));
  }
}

}  // namespace bristle_test::test_experiments_ageing
