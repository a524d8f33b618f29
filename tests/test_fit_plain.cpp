// `bristle fit` of the plainest records: Coulomb's friction with presliding below what the samples show,
// outliers, few rows, strokes that grow.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>

#include <fmt/format.h>

#include "tests/fit_helpers.hpp"
#include "tools/libraries/fitting/judge.hpp"

namespace bristle_test::test_fit_plain {

using Catch::Matchers::Contains;

namespace {

/// Returns a record under a constant load: friction that has the sign of the speed (smoothed over `smooth`,
/// m/s) and grows with it, with noise.
std::string coulomb(int rows, double dt, double load, double kinetic, double viscous, double smooth,
                    double noise, const std::function<double(double)>& place) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, noise);
  std::string csv = "t,x,load,force\n";
  for (int i = 0; i < rows; ++i) {
    const double t = i * dt, v = (place(t + dt) - place(t - dt)) / (2.0 * dt);
    csv += fmt::format("{:.9g},{:.9g},{},{:.9g}\n", t, place(t), load,
                       kinetic * load * std::tanh(v / smooth) + viscous * v + normal(random));
  }
  return csv;
}

}  // namespace

TEST_CASE("Friction without presliding in the samples: kinetic and viscous, no peak", "[fit]") {
  const auto place = [](double t) {
    const double hertz = t < 10.0 ? 0.2 : t < 20.0 ? 0.5 : 1.0;
    return 5e-3 * std::sin(2.0 * M_PI * hertz * t);
  };
  for (const auto& [rows, dt, smooth] : {std::tuple(3000, 0.01, 1e-9), std::tuple(1500, 0.02, 1e-6)}) {
    CAPTURE(rows);
    const Fitted fitted = fit(coulomb(rows, dt, 2.5, 0.25, 8.0, smooth, 0.01, place), any_brush());
    check_recovered(fitted[cli::fit_kinetic], 0.25, 0.005);
    check_recovered(fitted[cli::fit_viscous], 8.0, 1.0);
    CHECK_FALSE(fitted[cli::fit_length].fitted);
    CHECK_FALSE(fitted.result.peak.fitted);
    CHECK_THAT(cli::fit_table(fitted.data, fitted.result), !Contains("peak"));
    CHECK(fitted.result.residual_rms < 0.03);
  }
}

TEST_CASE("What few rows cannot tell is held at what fits; an outlier is named", "[fit]") {
  const auto place = [](double t) { return 1e-3 * std::sin(2.0 * M_PI * 0.3 * t); };
  const std::string whole = coulomb(600, 0.01, 2.0, 0.3, 0.0, 1e-5, 0.005, place);
  const Fitted thin = fit(coulomb(100, 0.06, 2.0, 0.3, 0.0, 1e-5, 0.005, place), any_brush());
  CHECK(thin[cli::fit_kinetic].value == Approx(0.3).epsilon(0.03));
  std::string spiked = whole;
  const std::size_t begin = spiked.find('\n') + 1, end = spiked.find('\n', begin);
  spiked.replace(begin, end - begin, "0,0,2,40");
  const Fitted fitted = fit(spiked, any_brush());
  CHECK(fitted.data.samples() == 599);
  CHECK_THAT(cli::fit_table(fitted.data, fitted.result), Contains("row 1 (40 N)"));
  for (const Fitted& f : {fit(whole, any_brush()), fitted})
    CHECK(f[cli::fit_kinetic].value == Approx(0.3).epsilon(0.02));
}

TEST_CASE("A coefficient that no material has is doubted, and the load's unit with it", "[fit]") {
  const auto place = [](double t) { return 1e-3 * std::sin(2.0 * M_PI * 0.3 * t); };
  for (const auto& [load, kinetic, doubted] :
       {std::tuple(2.0, 0.3, false), {2000.0, 0.0003, true}, {0.2, 2.9, true}, {1.0, 2.9, false}}) {
    CAPTURE(load, kinetic);
    const Fitted fitted =
        fit(coulomb(600, 0.01, load, kinetic, 0.0, 1e-5, 0.005 * load * kinetic, place), any_brush());
    CHECK(fitted[cli::fit_kinetic].value == Approx(kinetic).epsilon(0.02));
    const std::string table = cli::fit_table(fitted.data, fitted.result);
    CHECK((table.find("is unusual") != table.npos) == doubted);
    if (doubted) CHECK_THAT(table, Contains("unit of the load"));
  }
}

TEST_CASE("Friction that falls short of its limit around turns does not pass for a lubricant", "[fit]") {
  const auto place = [](double t) {
    return (t < 4.0 ? 20e-6 : t < 8.0 ? 200e-6 : 2e-3) * std::sin(2.0 * M_PI * 0.5 * t);
  };
  const Fitted fitted = fit(coulomb(6000, 0.002, 2.5, 0.3, 0.0, 1e-5, 0.01, place), any_brush());
  check_recovered(fitted[cli::fit_kinetic], 0.3, 0.005);
  CHECK(fitted[cli::fit_damping].value == 0.0);
  CHECK_FALSE(fitted[cli::fit_length].fitted);
  CHECK(fitted.result.residual_rms < 0.02);
}

TEST_CASE("Rivals of strokes that grow are fitted and judged over the whole range", "[fit]") {
  const auto place = [](double t) {
    return (t < 4.0 ? 20e-6 : t < 8.0 ? 200e-6 : 2e-3) * std::sin(2.0 * M_PI * 0.5 * t);
  };
  const std::string csv = coulomb(6000, 0.002, 2.5, 0.3, 0.0, 1e-5, 0.01, place);
  cli::FitOptions options = any_brush();
  const cli::FitColumns columns = cli::parse_fit_columns(csv, "data.csv");
  const cli::Judgements all = cli::judge_rivals(columns, options);
  CHECK(all.within_range());
  CHECK(all.fitted_samples == 3000);
  CHECK(all.fitted_stroke == Approx(4e-3).epsilon(0.02));
  CHECK(all.judged_stroke == Approx(4e-3).epsilon(0.02));
  CHECK(all.fitted_speed == Approx(2e-3 * M_PI).epsilon(0.02));
  CHECK(all.judged_speed == Approx(2e-3 * M_PI).epsilon(0.02));
  for (const cli::Judgement& j : all.models) CHECK(j.judged.all < 2.0 * j.fitted);
  options.fit_until = 4.0;  // strokes of a hundredth of what follows
  CHECK_FALSE(cli::judge_rivals(columns, options).within_range());
}

}  // namespace bristle_test::test_fit_plain
